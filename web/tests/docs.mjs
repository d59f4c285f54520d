import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from '@playwright/test';
import { launchOptions } from './chromium.mjs';

/// docs.mjs SITE [sheets]: looks at the documentation in the folder SITE as readers see it. Prints a
/// line for each problem, and ends with 1 if there is one.
/// - The sheets of the course are printed whole, on A4 and Letter.
/// - axe finds no problem on the kinds of pages; not with "sheets".

const [site, only] = process.argv.slice(2);

const SHEETS = ['sheet-1', 'sheet-2', 'sheet-2-browser', 'sheet-3', 'sheet-4', 'answers'];
const MARGINS = 30; // mm, left and right together (docs/_static/style.css)
const PAPERS = { A4: 210, Letter: 215.9 }; // width, mm
const WIDE = { width: 1366, height: 650 };
const PHONE = { width: 390, height: 844 };
const PAGES = [
  { name: 'index', colorScheme: 'light', viewport: WIDE },
  { name: 'search', colorScheme: 'dark', viewport: WIDE },
  { name: 'answers', colorScheme: 'dark', viewport: PHONE },
];

const browser = await chromium.launch(launchOptions);
const problems = [];

async function visit(name, options, look) {
  const page = await browser.newPage(options);
  const query = name === 'search' ? '?q=my+own+robot' : '';
  await page.goto(pathToFileURL(join(site, `${name}.html`)).href + query);
  await look(page);
  await page.close();
}

/// Texts that paper of this width would cut off, and other parts that it should not show.
function cutOff() {
  const found = [];
  const walker = document.createTreeWalker(document.querySelector('article'), NodeFilter.SHOW_TEXT);
  const range = document.createRange();
  for (let text = walker.nextNode(); text; text = walker.nextNode()) {
    let end = innerWidth;
    for (let box = text.parentElement; box; box = box.parentElement) {
      const { overflowX } = getComputedStyle(box);
      if (overflowX !== 'visible') end = Math.min(end, box.getBoundingClientRect().right);
    }
    range.selectNodeContents(text);
    const over = Math.round(range.getBoundingClientRect().right - end);
    if (over > 0 && text.data.trim())
      found.push(`${over} px of "${text.data.trim().slice(0, 60)}"`);
  }
  for (const other of document.querySelectorAll('.skip-to-content, footer, .sidebar-drawer')) {
    if (other.getClientRects().length > 0)
      found.push(`${other.className || other.tagName} is printed`);
  }
  return found;
}

for (const sheet of SHEETS) {
  await visit(`course/${sheet}`, {}, async (page) => {
    await page.emulateMedia({ media: 'print' });
    for (const [paper, width] of Object.entries(PAPERS)) {
      const inches = (width - MARGINS) / 25.4;
      await page.setViewportSize({ width: Math.floor(96 * inches), height: 900 });
      for (const cut of await page.evaluate(cutOff)) problems.push(`${sheet} on ${paper}: ${cut}`);
    }
  });
}

if (only !== 'sheets') {
  const axe = readFileSync(new URL('../node_modules/axe-core/axe.min.js', import.meta.url), 'utf8');
  for (const { name, ...screen } of PAGES) {
    await visit(name, screen, async (page) => {
      if (name === 'search') await page.locator('.search li').first().waitFor();
      await page.addScriptTag({ content: axe });
      const found = await page.evaluate(async () => {
        const { violations } = await globalThis.axe.run({ resultTypes: ['violations'] });
        return violations.map(({ id, nodes }) => `${id} of ${nodes[0].target.join(' ')}`);
      });
      for (const fault of found) problems.push(`${name}, ${screen.colorScheme}: ${fault}`);
    });
  }
}

await browser.close();
for (const problem of problems) console.log(problem);
process.exitCode = problems.length > 0 ? 1 : 0;
