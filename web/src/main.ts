import { Agents } from './page/agents';
import { fetchCore, fetchMujoco } from './page/boot';
import { element } from './page/dom';
import { focusWideFormulas, foldCharts, placeCharts } from './page/layout';
import { warn } from './page/message';
import { Page } from './page/page';
import { showView, viewOf } from './page/views';
import { ClosedForm } from './simulator';
import { printable } from './text';
import { World } from './world';

const LONGEST_REASON = 300; // characters

document.documentElement.dataset.script = 'running'; // for public/watch.js and style.css

/// Starts the page with the physics of our own core.
async function start(): Promise<Page> {
  showView(viewOf(location.hash));
  placeCharts();
  foldCharts();
  focusWideFormulas();
  const progress = element<HTMLProgressElement>('progress');
  const [agents] = await Promise.all([
    Agents.fetch(),
    fetchCore((share) => (progress.value = share)),
  ]);
  const page = new Page(new World(new ClosedForm()), agents);
  globalThis.upswing = page;
  await page.open();
  for (const group of document.querySelectorAll<HTMLFieldSetElement>('fieldset')) {
    group.disabled = false;
  }
  element('badge').hidden = false;
  page.run();
  document.getElementById('first-picture')!.remove();
  return page;
}

function reasonOf(error: unknown): string {
  console.error(error);
  return printable(error instanceof Error ? error.message : String(error), LONGEST_REASON);
}

const page = await start().catch((error: unknown) => {
  const problem = element('problem');
  problem.textContent = `The page could not start: ${reasonOf(error)}. Try to reload it.`;
  problem.hidden = false;
  return null;
});
element('loading').hidden = true;

/// Keeps the page for visits without a network; not the one of `./upswing demo`.
function keepForLater(): void {
  if (!location.protocol.startsWith('http') || location.hostname === 'localhost') return;
  void navigator.serviceWorker?.register('./sw.js').catch(() => {}); // some browsers keep nothing
}

// MuJoCo is larger than everything else, so the pendulum does not wait for it.
try {
  if (page) page.continueIn(await fetchMujoco());
  keepForLater();
} catch (error) {
  const instead = 'Upswing’s own equations of motion move the pendulum instead.';
  warn(`MuJoCo could not start: ${reasonOf(error)}. ${instead}`);
}
