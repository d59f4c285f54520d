import { Agents } from './page/agents';
import { startSimulator } from './page/boot';
import { element } from './page/dom';
import { warn } from './page/message';
import { Page } from './page/page';
import { World } from './world';

try {
  element('loading').hidden = false;
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
  page.run();
} catch (error) {
  const reason = error instanceof Error ? error.message : String(error);
  warn(`The page could not start: ${reason}.`);
  element('badge').hidden = true;
  console.error(error);
} finally {
  element('loading').hidden = true;
}
