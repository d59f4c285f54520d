// npm run measure: how large the built page is, how soon it paints, how smoothly it runs, and how much
// of a processor it takes. Figures of this machine, for docs/page.md; no test.
import { chromium } from '@playwright/test';
import { gzipSync } from 'node:zlib';
import { preview } from 'vite';

const SECONDS = 10;
const BROWSERS = 5; // fresh ones; medians

const server = await preview({
  preview: { port: 0 },
  build: { outDir: process.env.UPSWING_PAGE ?? '../build/web' },
});
const address = server.resolvedUrls.local[0];
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

/// Figures of one visit in a browser that has nothing cached.
async function visit(executablePath) {
  const browser = await chromium.launch({
    executablePath,
    args: ['--no-sandbox', '--disable-gpu'],
  });
  const page = await browser.newPage();
  const bodies = [];
  page.on('response', (response) => bodies.push(response.body()));
  await page.goto(address);
  await page.waitForFunction(
    () => globalThis.upswing && !document.querySelector('fieldset:disabled'),
  );
  const ready = await page.evaluate(() => performance.now());
  const paint = await page.evaluate(
    () => performance.getEntriesByName('first-contentful-paint')[0].startTime,
  );
  const sizes = (await Promise.all(bodies)).map((body) => gzipSync(body).length);

  await page.click('#agent-on');
  const devtools = await page.context().newCDPSession(page);
  await devtools.send('Performance.enable');
  const taskSeconds = async () => {
    const { metrics } = await devtools.send('Performance.getMetrics');
    return metrics.find(({ name }) => name === 'TaskDuration').value;
  };
  const before = await taskSeconds();
  const frames = await page.evaluate(
    (seconds) =>
      new Promise((resolve) => {
        const start = performance.now();
        let count = 0;
        const frame = () => {
          ++count;
          if (performance.now() - start < 1000 * seconds) requestAnimationFrame(frame);
          else resolve((1000 * count) / (performance.now() - start));
        };
        requestAnimationFrame(frame);
      }),
    SECONDS,
  );
  const share = ((await taskSeconds()) - before) / SECONDS;
  await browser.close();
  return { paint, ready, kilobytes: sizes.reduce((sum, size) => sum + size) / 1000, frames, share };
}

const visits = [];
for (let k = 0; k < BROWSERS; ++k) visits.push(await visit(process.env.UPSWING_CHROMIUM));
await server.close();
const of = (name) => median(visits.map((one) => one[name]));
console.log(`first load     ${of('kilobytes').toFixed(0)} kB, compressed with gzip`);
console.log(`first paint    ${of('paint').toFixed(0)} ms`);
console.log(`ready          ${of('ready').toFixed(0)} ms`);
console.log(`frames         ${of('frames').toFixed(1)} a second, with the agent on`);
console.log(`main thread    ${(100 * of('share')).toFixed(0)}% of one processor`);
