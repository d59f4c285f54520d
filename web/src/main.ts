import { Agents } from './page/agents';
import { startSimulator } from './page/boot';
import { element } from './page/dom';
import { focusWideFormulas, placeCharts } from './page/layout';
import { Page } from './page/page';
import { showView, viewOf } from './page/views';
import { printable } from './text';
import { World } from './world';

document.documentElement.dataset.script = 'running'; // for public/watch.js and style.css

try {
  showView(viewOf(location.hash));
  placeCharts();
  focusWideFormulas();
  const progress = element<HTMLProgressElement>('progress');
  const [simulator, agents] = await Promise.all([
    startSimulator((share) => (progress.value = share)),
    Agents.fetch(),
  ]);
  const page = new Page(new World(simulator), agents);
  globalThis.upswing = page;
  await page.open();
  for (const group of document.querySelectorAll<HTMLFieldSetElement>('fieldset')) {
    group.disabled = false;
  }
  element('badge').hidden = false;
  page.run();
  document.getElementById('first-picture')!.remove();
} catch (error) {
  const reason = error instanceof Error ? error.message : String(error);
  const problem = element('problem');
  problem.textContent = `The page could not start: ${printable(reason, 300)}. Try to reload it.`;
  problem.hidden = false;
  console.error(error);
} finally {
  element('loading').hidden = true;
}
