import { test as base, expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import type {} from '../src/page/global';

/// A test that fails if the page writes errors or warnings to the console, unless `complains` is set.
/// The page draws 15 times a second: without a graphics card, that is most of what a test costs.
export const test = base.extend<{ complains: boolean; silent: void }>({
  complains: [false, { option: true }],
  silent: [
    async ({ context, complains }, use) => {
      await context.addInitScript(() => {
        const { requestAnimationFrame: soon } = globalThis;
        globalThis.requestAnimationFrame = (draw) => Number(setTimeout(() => soon(draw), 50));
      });
      const complaints: string[] = [];
      context.on('console', (message) => {
        if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
      });
      context.on('weberror', (error) => complaints.push(String(error.error())));
      await use();
      if (!complains) expect(complaints).toEqual([]);
    },
    { auto: true },
  ],
});

/// Opens the page, everything that it has, and waits until the pendulum hangs in it.
export async function open(page: Page, hash = '#everything'): Promise<void> {
  await page.goto(`./${hash}`);
  await expect(page.locator('#agent-on')).toBeEnabled();
}

/// Simulates so many seconds at once, and returns the rows
/// [t, q1, q2, w1, w2, torque] of each control step.
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
  const pause = page.getByRole('button', { name: 'Pause' });
  if (await pause.isVisible()) await pause.click();
  await page.evaluate((s) => upswing.world.reset(s), { q1, q2, w1, w2 });
}

/// How long (s) both links have been upright; 0 if they are not.
export function balanced(page: Page): Promise<number> {
  return page.evaluate(() => upswing.world.uprightFor ?? 0);
}

/// The largest difference in q1, q2, w1, w2 over two trajectories' common rows.
export function largestDifference(rows: number[][], others: number[][]): number {
  expect(rows.length).toBeGreaterThan(0);
  expect(others.length).toBeGreaterThanOrEqual(rows.length);
  const differences = rows.flatMap((row, k) =>
    [1, 2, 3, 4].map((i) => Math.abs(row[i]! - others[k]![i]!)),
  );
  return Math.max(...differences);
}

/// Sets a slider as a hand would.
export async function slide(page: Page, id: string, value: number): Promise<void> {
  await page.locator(`#${id}`).fill(String(value));
}

/// Where a point of the pendulum's plane (m) is on the screen.
export function onScreen(page: Page, x: number, z: number): Promise<{ x: number; y: number }> {
  return page.evaluate(
    async (point) => {
      // What was asked for before is laid out and drawn.
      for (let k = 0; k < 3; ++k) await new Promise(requestAnimationFrame);
      const { left, top } = document.getElementById('scene')!.getBoundingClientRect();
      const [px, py] = upswing.scene.at(point);
      return { x: left + px, y: top + py };
    },
    { x, z },
  );
}
