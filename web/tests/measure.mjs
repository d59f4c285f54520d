// npm run measure: how large the built page is, how soon it paints, how smoothly it runs, and how much
// of a processor it takes. Measurements of this machine for docs/page.md, not a test.
import { gzipSync } from 'node:zlib';
import { ready, serve, visit } from './visit.mjs';

const SECONDS = 10;
const VISITS = 5; // medians of them

const server = await serve();
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

async function measure(page) {
  const bodies = [];
  page.on('response', (response) => bodies.push(response.body()));
  await page.goto(`${server.address}#everything`);
  await ready(page);
  const start = await page.evaluate(() => ({
    ready: performance.now(),
    paint: performance.getEntriesByName('first-contentful-paint')[0].startTime,
  }));
  const sizes = (await Promise.all(bodies)).map((body) => gzipSync(body).length);

  await page.click('#agent-on');
  await page.evaluate(() => document.getElementById('map').scrollIntoView({ block: 'end' }));
  const devtools = await page.context().newCDPSession(page);
  await devtools.send('Performance.enable');
  const metrics = async () => {
    const { metrics } = await devtools.send('Performance.getMetrics');
    return Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
  };
  const before = await metrics();
  const frames = await page.evaluate(
    (seconds) =>
      new Promise((resolve) => {
        const begin = performance.now();
        let count = 0;
        const frame = () => {
          ++count;
          if (performance.now() - begin < 1000 * seconds) requestAnimationFrame(frame);
          else resolve((1000 * count) / (performance.now() - begin));
        };
        requestAnimationFrame(frame);
      }),
    SECONDS,
  );
  const after = await metrics();
  return {
    ...start,
    kilobytes: sizes.reduce((sum, size) => sum + size) / 1000,
    frames,
    thread: (after.TaskDuration - before.TaskDuration) / SECONDS,
    script: (after.ScriptDuration - before.ScriptDuration) / SECONDS,
  };
}

const visits = [];
for (let k = 0; k < VISITS; ++k) visits.push(await visit({}, measure));
await server.close();
const of = (name) => median(visits.map((one) => one[name]));
const percent = (share) => `${(100 * share).toFixed(0)}%`;
console.log(`first load     ${of('kilobytes').toFixed(0)} kB, compressed with gzip`);
console.log(`first paint    ${of('paint').toFixed(0)} ms`);
console.log(`ready          ${of('ready').toFixed(0)} ms`);
console.log(`frames         ${of('frames').toFixed(1)} a second, with the agent on`);
console.log(
  `main thread    ${percent(of('thread'))} of one processor, of it ${percent(of('script'))} script`,
);
