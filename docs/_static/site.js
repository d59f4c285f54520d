// Small repairs of the site's pages.

// Paper has no links: those into the page of ./upswing demo get their address, which style.css
// prints. Addresses that no one would type are left out.
const LONGEST = 50; // characters

for (const link of document.querySelectorAll('article a[href]')) {
  const { href, hash } = link;
  const isOfPage =
    /#(tour|learn|write|agent|everything)\b/.test(hash) || href.endsWith('/gallery.html');
  if (isOfPage && href.length <= LONGEST && !link.textContent.includes('/'))
    link.dataset.address = href;
}

// For screen readers and the keyboard: names of the landmarks, and wide blocks that can be scrolled.
function name(selector, label) {
  for (const found of document.querySelectorAll(selector)) found.setAttribute('aria-label', label);
}
name('.sidebar-drawer', 'All pages');
name('.toc-drawer', 'This page');
document.querySelector('.content-icon-container')?.setAttribute('role', 'region');
name('.content-icon-container', 'Source and colours');

function reachWideBlocks() {
  for (const block of document.querySelectorAll('article :is(pre, .table-wrapper, div.math)')) {
    if (block.scrollWidth > block.clientWidth) block.tabIndex = 0;
    else block.removeAttribute('tabindex');
  }
}
reachWideBlocks();
addEventListener('resize', reachWideBlocks);
