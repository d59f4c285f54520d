import { test as base, expect } from '@playwright/test';
import type { BrowserContext, Page } from '@playwright/test';
import type { Clock } from '../src/page/clock';
import type {} from '../src/page/global';

/// Drawing costs most without a graphics card, so 10 frames a second are enough.
function drawSeldom(): void {
  const { requestAnimationFrame: soon } = globalThis;
  const waiting: FrameRequestCallback[] = [];
  globalThis.requestAnimationFrame = (draw) => waiting.push(draw);
  const drawAll = () => {
    for (const draw of waiting.splice(0)) soon(draw);
  };
  setInterval(() => {
    // Draws nothing while the stage waits for its next test.
    if (!document.body?.inert) drawAll();
  }, 100);
  globalThis.drawn = async () => {
    for (let k = 0; k < 4; ++k) {
      drawAll();
      await new Promise(soon);
    }
  };
}

declare global {
  var drawn: () => Promise<void>;
  var keepTime: (() => void) | undefined; // undoes hurryTimers()
}

/// Waits until earlier changes are laid out and drawn.
export const drawn = (page: Page) => page.evaluate(() => globalThis.drawn());

/// Timers that the page starts from now on run this many times as fast.
export function hurryTimers(page: Page, times: number): Promise<void> {
  return page.evaluate((times) => {
    const { setTimeout: later, setInterval: often } = globalThis;
    globalThis.setTimeout = ((call: TimerHandler, ms = 0) => later(call, ms / times)) as never;
    globalThis.setInterval = ((call: TimerHandler, ms = 0) => often(call, ms / times)) as never;
    globalThis.keepTime = () =>
      void Object.assign(globalThis, { setTimeout: later, setInterval: often });
  }, times);
}

/// Collects errors and warnings that a context's pages write to the console.
function complaintsOf(context: BrowserContext): string[] {
  const complaints: string[] = [];
  context.on('console', (message) => {
    const text = message.text();
    // Only tests read canvases back. Chromium now and then takes a font from its cache for unused; the
    // test of preloaded fonts checks that.
    if (/willReadFrequently|blocked by Playwright|preloaded using link preload/.test(text)) return;
    if (['error', 'warning'].includes(message.type())) complaints.push(text);
  });
  context.on('weberror', (error) => complaints.push(String(error.error())));
  return complaints;
}

interface Kept {
  page: Page;
  complaints: string[];
}

/// A test fails if its page writes errors or warnings to the console, unless `complains` is set.
///
/// `page` has its own browser context, and open() loads it. Tests that are not about loading take
/// `stage`: one page for all tests of a Playwright worker, which open() only resets. Loading takes
/// twenty times as long.
interface Options {
  complains: boolean;
}
export const test = base.extend<Options & { stage: Page }, { kept: Kept }>({
  complains: [false, { option: true }],
  context: async ({ context, complains }, use) => {
    await context.addInitScript(drawSeldom);
    const complaints = complaintsOf(context);
    await use(context);
    if (!complains) expect(complaints).toEqual([]);
  },
  kept: [
    async ({ browser }, use, { project }) => {
      const context = await browser.newContext({
        baseURL: project.use.baseURL,
        serviceWorkers: 'block',
      });
      await context.addInitScript(drawSeldom);
      await use({ page: await context.newPage(), complaints: complaintsOf(context) });
      await context.close();
    },
    { scope: 'worker' },
  ],
  stage: async ({ kept: { page, complaints }, complains }, use) => {
    if (page.url() !== 'about:blank') await setBack(page);
    complaints.length = 0;
    await use(page);
    await page.evaluate(() => (document.body.inert = true));
    if (!complains) expect(complaints).toEqual([]);
  },
});

/// Resets the page for a new visitor: nothing kept, chosen or learning, no mouse button down,
/// scrolled to the top.
async function setBack(page: Page): Promise<void> {
  await page.unrouteAll();
  await page.context().clearPermissions();
  await page.mouse.up();
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.emulateMedia({ colorScheme: null, forcedColors: null, reducedMotion: null });
  await page.evaluate(async () => {
    document.body.inert = false;
    globalThis.keepTime?.();
    localStorage.clear();
    delete document.documentElement.dataset.theme;
    for (const details of document.querySelectorAll('details')) {
      details.open = details.matches('#explain > :first-child, #more-charts');
    }
    delete (upswing.clock as Partial<Clock>).advance; // a test may have stopped it
    upswing.learn.forget();
    upswing.router.laboratoryHash = '';
    await upswing.agents.forgetOwn();
    scrollTo({ top: 0, behavior: 'instant' });
  });
}

/// Opens the page and waits until everything has loaded and the pendulum hangs. A loaded page
/// follows the address as it follows a visitor's link.
export async function open(page: Page, hash = '#everything'): Promise<void> {
  if (page.url() === 'about:blank') {
    await page.goto(`./${hash}`);
  } else {
    await page.evaluate(async (hash) => {
      history.replaceState(null, '', `./${hash}`);
      await upswing.open(hash);
    }, hash);
  }
  await expect(page.locator('#agent-on')).toBeEnabled();
  await page.waitForFunction(() => upswing.isComplete);
}

/// Simulates `seconds` at once.
export function advance(page: Page, seconds: number): Promise<void> {
  return page.evaluate(
    (steps) => {
      for (let k = 0; k < steps; ++k) upswing.world.advance();
    },
    Math.round(200 * seconds),
  );
}

/// Simulates `seconds` at once; returns a row [t, q1, q2, w1, w2, torque] for each control step.
export function run(page: Page, seconds: number): Promise<number[][]> {
  return page.evaluate((duration) => {
    const { world } = upswing;
    const rows: number[][] = [];
    const { onMoment } = world;
    world.onMoment = (moment) => {
      const { q1, q2, w1, w2 } = moment.state;
      rows.push([moment.t, q1, q2, w1, w2, moment.torque]);
      onMoment(moment);
    };
    const steps = Math.round(duration * 200);
    for (let k = 0; k < steps; ++k) world.advance();
    world.onMoment = onMoment;
    return rows;
  }, seconds);
}

/// Sets the state and pauses, so that only run() advances time.
export async function startFrom(page: Page, q1: number, q2 = 0, w1 = 0, w2 = 0): Promise<void> {
  const pause = page.locator('#pause');
  await expect(pause).toBeVisible(); // the view may still be changing
  if ((await pause.textContent()) === 'Pause') await pause.click();
  await expect(pause).toHaveText('Resume');
  await page.evaluate((s) => upswing.world.reset(s), { q1, q2, w1, w2 });
}

/// Layout shift since the page was opened.
export async function shift(page: Page): Promise<number> {
  return page.evaluate(
    () =>
      new Promise<number>((resolve) => {
        let sum = 0;
        new PerformanceObserver((list) => {
          for (const entry of list.getEntries()) sum += (entry as never as { value: number }).value;
        }).observe({ type: 'layout-shift', buffered: true });
        setTimeout(() => resolve(sum), 1000);
      }),
  );
}

/// How long (s) both links have been upright; 0 if they are not.
export function balanced(page: Page): Promise<number> {
  return page.evaluate(() => upswing.world.uprightFor ?? 0);
}

/// Largest difference in q1, q2, w1, w2 over the common rows of two trajectories.
export function largestDifference(rows: number[][], others: number[][]): number {
  expect(rows.length).toBeGreaterThan(0);
  expect(others.length).toBeGreaterThanOrEqual(rows.length);
  const differences = rows.flatMap((row, k) =>
    [1, 2, 3, 4].map((i) => Math.abs(row[i]! - others[k]![i]!)),
  );
  return Math.max(...differences);
}

/// Sets a slider like a visitor's hand.
export async function slide(page: Page, id: string, value: number): Promise<void> {
  const slider = page.locator(`#${id}`);
  await slider.evaluate((one) => {
    const details = one.closest('details');
    if (details) details.open = true;
  });
  await slider.fill(String(value));
}

/// Place of a point of the pendulum's plane (m) on the screen.
export async function onScreen(
  page: Page,
  x: number,
  z: number,
): Promise<{ x: number; y: number }> {
  await drawn(page);
  return page.evaluate(
    (point) => {
      const { left, top } = document.getElementById('scene')!.getBoundingClientRect();
      const [px, py] = upswing.scene.at(point);
      return { x: left + px, y: top + py };
    },
    { x, z },
  );
}
