import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import type { Page as Upswing } from '../src/page/page';

declare global {
  var upswing: Upswing;
}

/// Opens the page and waits until the pendulum hangs in it. What it says on the console is returned.
export async function open(page: Page, hash = ''): Promise<string[]> {
  const complaints: string[] = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  await page.goto(`./${hash}`);
  await expect(page.locator('#agent-on')).toBeEnabled();
  return complaints;
}

/// Lets so many seconds of the pendulum's time go by at once, and returns the rows
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
    for (let k = 0; k < duration * 200; ++k) world.advance();
    world.onMoment = onMoment;
    return rows;
  }, seconds);
}

/// From this state at rest or not, with time standing still but for run().
export async function startFrom(page: Page, q1: number, q2 = 0, w1 = 0, w2 = 0): Promise<void> {
  const pause = page.locator('#pause');
  if ((await pause.getAttribute('aria-pressed')) === 'false') await pause.click();
  await page.evaluate((s) => upswing.world.reset(s), { q1, q2, w1, w2 });
}

/// How long (s) both links have been upright; 0 if they are not.
export function balanced(page: Page): Promise<number> {
  return page.evaluate(() => {
    const { world } = upswing;
    return world.uprightSince === null ? 0 : world.time - world.uprightSince;
  });
}

/// The largest difference in q1, q2, w1, w2 over two trajectories' common rows.
export function largestDifference(rows: number[][], others: number[][]): number {
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
    ([px, pz]) => {
      const canvas = document.getElementById('scene')!;
      const { left, top, width, height } = canvas.getBoundingClientRect();
      const { plant } = upswing.world;
      const reach = Math.max(1, plant.length1 + plant.length2);
      const scale = (0.44 * Math.min(width, height)) / reach;
      return { x: left + width / 2 + scale * px, y: top + height / 2 - scale * pz };
    },
    [x, z] as const,
  );
}
