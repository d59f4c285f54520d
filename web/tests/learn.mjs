// npm run measure:learn: learning time of an agent in the built page for several seeds, the page's
// frame rate meanwhile, the processor seconds of learning and of the rest of the browser (drawing),
// and memory left behind by trainings. Measurements for docs/howto/page.md, not a test. UPSWING:
// program to compare with. SEEDS: how many.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { ready, serve, visit } from './visit.mjs';

const SEEDS = Array.from({ length: Number(process.env.SEEDS ?? 10) }, (_, i) => i + 1);
const PATIENCE = 300_000; // ms
const TICKS = 100; // per second, of processor times in /proc
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

/// A training by the program with one thread, like the page's: steps, and its seconds.
function program(seed) {
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  const began = performance.now();
  const text = execFileSync(
    process.env.UPSWING ?? '../build/release/bin/upswing',
    ['train', '--agent', 'fast', '--seed', String(seed), '--threads', '1'].concat([
      '--eval-physics',
      'closed-form',
      '--out',
      join(folder, 'run'),
    ]),
    { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] },
  );
  const seconds = (performance.now() - began) / 1000;
  rmSync(folder, { recursive: true });
  return { seconds, text };
}

/// Processor seconds of each thread of the browser so far, with `worker` if it is a training's.
async function threadsOf(devtools) {
  const { processInfo } = await devtools.send('SystemInfo.getProcessInfo');
  const found = new Map();
  for (const { id } of processInfo) {
    for (const thread of readdirSync(`/proc/${id}/task`)) {
      let stat;
      try {
        stat = readFileSync(`/proc/${id}/task/${thread}/stat`, 'utf8');
      } catch {
        continue; // it has just ended
      }
      const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
      const seconds = (Number(fields[11]) + Number(fields[12])) / TICKS;
      found.set(thread, { seconds, worker: stat.includes('(DedicatedWorker') });
    }
  }
  return found;
}

/// Calls `work` and adds to its result the processor seconds of the browser meanwhile: of learning,
/// and of the rest.
async function withProcessor(page, work) {
  const devtools = await page.context().browser().newBrowserCDPSession();
  const before = await threadsOf(devtools);
  const known = new Map();
  const look = async () => {
    for (const entry of await threadsOf(devtools)) known.set(...entry); // ended ones stay
  };
  let done = false;
  const result = work().finally(() => (done = true));
  while (!done) await Promise.all([look(), page.waitForTimeout(100)]);
  const spent = (worker) =>
    [...known]
      .filter(([, thread]) => thread.worker === worker)
      .reduce((sum, [id, { seconds }]) => sum + seconds - (before.get(id)?.seconds ?? 0), 0);
  return { ...(await result), learning: spent(true), drawing: spent(false) };
}

/// A training in the page: steps, seconds from the click to the end, and frames per second.
async function learn(page, seed) {
  await page.evaluate(() => (document.getElementById('learn-options').open = true));
  await page.fill('#learn-seed', String(seed));
  await page.uncheck('#learn-slow');
  return page.evaluate(
    ({ patience }) =>
      new Promise((resolve, reject) => {
        const began = performance.now();
        let frames = 0;
        upswing.learn.start();
        const frame = () => {
          ++frames;
          const session = upswing.learn.session;
          const seconds = (performance.now() - began) / 1000;
          if (session.state === 'finished' || session.state === 'failed') {
            resolve({ seconds, frames: frames / seconds, ...session.last });
          } else if (1000 * seconds > patience) {
            reject(new Error('not solved'));
          } else {
            requestAnimationFrame(frame);
          }
        };
        requestAnimationFrame(frame);
      }),
    { patience: PATIENCE },
  );
}

const server = await serve();
await visit({ viewport: { width: 1300, height: 860 } }, async (page) => {
  await page.goto(`${server.address}#learn`);
  await ready(page);
  const devtools = await page.context().newCDPSession(page);
  await devtools.send('Performance.enable');
  /// The page's memory after garbage collection.
  const held = async () => {
    await devtools.send('HeapProfiler.collectGarbage');
    const { metrics } = await devtools.send('Performance.getMetrics');
    const all = Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
    const core = await page.evaluate(() => upswing.coreBytes);
    return {
      heap: all.JSHeapUsedSize,
      listeners: all.JSEventListeners,
      nodes: all.Nodes,
      core,
      workers: page.workers().length,
    };
  };

  console.log(
    'seed   page: s    steps  updates/s  frames/s  learning: CPU s  rest   program, one thread: s',
  );
  const rows = [];
  let before = null;
  for (const seed of SEEDS) {
    const here = await withProcessor(page, () => learn(page, seed));
    const there = program(seed);
    rows.push({ here, there });
    before ??= await held(); // after the first training, which fills caches
    console.log(
      [
        String(seed).padStart(4),
        here.seconds.toFixed(1).padStart(9),
        String(here.steps).padStart(8),
        (here.updates / here.seconds).toFixed(0).padStart(10),
        here.frames.toFixed(1).padStart(9),
        here.learning.toFixed(1).padStart(16),
        here.drawing.toFixed(1).padStart(5),
        there.seconds.toFixed(2).padStart(24),
        here.solved ? '' : '  not solved',
      ].join(' '),
    );
  }
  const of = (get) => median(rows.map(get));
  console.log(
    `median ${of(({ here }) => here.seconds).toFixed(1)} s in the page,`,
    `${of(({ there }) => there.seconds).toFixed(2)} s of the program;`,
    `frames ${of(({ here }) => here.frames).toFixed(1)} a second`,
  );
  console.log('after the first training', JSON.stringify(before));
  console.log(`after ${SEEDS.length} trainings   `, JSON.stringify(await held()));
});
await server.close();
