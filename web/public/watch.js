// Before the first paint: the view that the address asks for, or that was chosen last, as views.ts does.
{
  const fields = new URLSearchParams(location.hash.slice(1));
  let last = null;
  try {
    last = localStorage.getItem('upswing-view');
  } catch {
    // this browser keeps nothing
  }
  const everything = fields.size > 0 || last === 'everything';
  const { dataset } = document.documentElement;
  if (fields.has('tour')) dataset.view = 'tour';
  else if (fields.has('learn')) dataset.view = 'learn';
  else if (everything) dataset.view = 'everything';
}

// Says what is wrong if the page's script cannot be loaded or read. That script is one module, so
// nothing of it runs then; once it runs, it reports by itself.
addEventListener(
  'error',
  ({ target, message }) => {
    if (document.documentElement.dataset.script) return;
    const isScript = target instanceof HTMLScriptElement;
    if (!isScript && !message) return; // an icon, say
    const reason = isScript
      ? `its script ${new URL(target.src).pathname}, or a part of it, is missing`
      : `this browser does not understand its script (${String(message).slice(0, 100)})`;
    const problem = document.getElementById('problem');
    problem.textContent = `The page could not start: ${reason}. Try to reload it.`;
    problem.hidden = false;
    document.getElementById('loading').hidden = true;
  },
  true,
);
