// npm run measure: size of the built page, time to its first paint, frame rate, and processor time.
// Measurements for docs/howto/page.md, not a test.
import { gzipSync } from 'node:zlib';
import { ready, serve, visit } from './visit.mjs';

const SECONDS = 10;
const VISITS = 5; // medians of them

const server = await serve();
const medianOf = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

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

  const devtools = await page.context().newCDPSession(page);
  // Processor time of the thread only, because other programs may run.
  await devtools.send('Performance.enable', { timeDomain: 'threadTicks' });
  const metrics = async () => {
    const { metrics } = await devtools.send('Performance.getMetrics');
    return Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
  };
  // With the agent on and the map in sight: one pendulum, two, and one with a planning agent.
  const run = async () => {
    await page.evaluate(() => document.getElementById('map').scrollIntoView({ block: 'end' }));
    const before = await metrics();
    const frames = await page.evaluate(framesIn, SECONDS);
    const after = await metrics();
    return {
      frames,
      thread: (after.TaskDuration - before.TaskDuration) / SECONDS,
      script: (after.ScriptDuration - before.ScriptDuration) / SECONDS,
    };
  };
  await page.click('#agent-on');
  const one = await run();
  await page.selectOption('#twin', 'd3qn-adaptive');
  const two = await run();
  await page.selectOption('#twin', '');
  await page.selectOption('#agent', 'mpc');
  const mpc = await run();
  return { ...start, kilobytes: sizes.reduce((sum, size) => sum + size) / 1000, one, two, mpc };
}

/// Seconds until a new visitor sees the pendulum swing. `bits`: bits per second of a network that
/// answers after 40 ms; 0: no limit.
async function firstSwing(page, bits) {
  if (bits) {
    const devtools = await page.context().newCDPSession(page);
    await devtools.send('Network.emulateNetworkConditions', {
      offline: false,
      latency: 40,
      downloadThroughput: bits / 8,
      uploadThroughput: bits / 8,
    });
  }
  await page.goto(server.address, { waitUntil: 'commit' });
  const swings = await page.waitForFunction(
    () => Math.abs(globalThis.upswing?.world.state.q1 ?? 0) > 0.05 && performance.now() / 1000,
  );
  return swings.jsonValue();
}

/// Runs in the page: frames per second.
function framesIn(seconds) {
  return new Promise((resolve) => {
    const begin = performance.now();
    let count = 0;
    const frame = () => {
      ++count;
      if (performance.now() - begin < 1000 * seconds) requestAnimationFrame(frame);
      else resolve((1000 * count) / (performance.now() - begin));
    };
    requestAnimationFrame(frame);
  });
}

const visits = [];
for (let k = 0; k < VISITS; ++k) visits.push(await visit({}, measure));
const swings = {};
for (const bits of [0, 1.6e6]) {
  const seconds = [];
  for (let k = 0; k < VISITS; ++k) {
    seconds.push(await visit({}, (page) => firstSwing(page, bits)));
  }
  swings[bits] = medianOf(seconds);
}
await server.close();
const of = (name) => medianOf(visits.map((one) => one[name]));
const percent = (share) => `${(100 * share).toFixed(0)}%`;
console.log(`first load     ${of('kilobytes').toFixed(0)} kB, compressed with gzip`);
console.log(`first paint    ${of('paint').toFixed(0)} ms`);
console.log(`ready          ${of('ready').toFixed(0)} ms`);
console.log(
  `first swing    ${swings[0].toFixed(2)} s, at 1.6 Mbit/s ${swings[1.6e6].toFixed(2)} s`,
);
for (const [name, what] of [
  ['one', 'one pendulum'],
  ['two', 'two pendulums'],
  ['mpc', 'one with mpc'],
]) {
  const median = (key) => medianOf(visits.map((visit) => visit[name][key]));
  console.log(
    `${what.padEnd(15)}${median('frames').toFixed(1)} frames a second; main thread ` +
      `${percent(median('thread'))} of one processor, script ${percent(median('script'))}`,
  );
}
