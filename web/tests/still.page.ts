import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, test } from './page';

/// A page at rest draws nothing, and draws again after any change.

/// Counts the frames that the page requests from now on. They follow each other at once, and its clock
/// runs ten times as fast, because a page comes to rest after a number of frames and some time.
async function countFrames(page: Page): Promise<() => Promise<number>> {
  await page.evaluate(() => {
    const now = performance.now.bind(performance);
    performance.now = () => 10 * now();
    Object.assign(globalThis, { framesAsked: 0 });
    globalThis.requestAnimationFrame = (draw) => {
      ++(globalThis as never as { framesAsked: number }).framesAsked;
      return Number(setTimeout(() => draw(performance.now()), 1));
    };
  });
  return () => page.evaluate(() => (globalThis as never as { framesAsked: number }).framesAsked);
}

/// Waits until the page has requested no frame for 0.1 s, many times as long as a frame takes.
async function settle(frames: () => Promise<number>): Promise<number> {
  let before = -1;
  await expect(async () => {
    const now = await frames();
    const still = now === before;
    before = now;
    expect(still).toBe(true);
  }).toPass({ intervals: [100] });
  return before;
}

test('a page that hangs still or is paused asks for no frame until something changes', async ({
  page,
}) => {
  await open(page, '#agent=fast');
  await page.evaluate(() => (upswing.scene.draw = () => {})); // drawings do not matter here
  const frames = await countFrames(page);
  await settle(frames);
  await page.locator('#agent-on').click();
  await expect.poll(() => page.evaluate(() => upswing.world.state.q1)).not.toBe(0);
  await page.locator('#pause').click();
  let asked = await settle(frames);
  await page.waitForTimeout(500);
  expect(await frames()).toBe(asked);
  const changes: [string, () => Promise<unknown>][] = [
    ['a slider', () => page.locator('#pose-q1').fill('90')],
    ['the theme', () => page.locator('#theme').click()],
    ['a step', () => page.locator('#step').click()],
    ['a script', () => page.evaluate(() => upswing.world.reset())],
    ['the size of the window', () => page.setViewportSize({ width: 900, height: 700 })],
    ['another agent', () => page.locator('#agent').selectOption('dqn')],
  ];
  for (const [what, change] of changes) {
    await change();
    await expect.poll(frames, { message: what }).toBeGreaterThan(asked);
    asked = await settle(frames);
  }
  await page.locator('#pause').click();
  await expect.poll(frames).toBeGreaterThan(asked + 20); // it moves

  // The first hold of a key or pointer moves a page at rest.
  const torque = () => page.evaluate(() => upswing.world.torque);
  for (const arrow of ['ArrowRight', '#motor-right']) {
    await open(page, '#tour=2');
    await settle(frames);
    if (arrow.startsWith('#')) await page.locator(arrow).hover();
    await settle(frames);
    await (arrow.startsWith('#') ? page.mouse.down() : page.keyboard.down(arrow));
    await expect.poll(torque, { message: arrow, timeout: 10_000 }).toBe(-5);
    await (arrow.startsWith('#') ? page.mouse.up() : page.keyboard.up(arrow));
  }
});
