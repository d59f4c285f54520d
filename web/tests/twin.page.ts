import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, slide, startFrom, test } from './page';

/// Two pendulums side by side, with the same start and disturbances.

/// Advances both, and returns their states.
const run = (page: Page, seconds: number) =>
  page.evaluate((duration) => {
    const { world } = upswing;
    for (let k = 0; k < 200 * duration; ++k) world.advance();
    const of = ({ state, torque, uprightFor }: typeof world) => ({
      state,
      torque,
      upright: uprightFor ?? 0,
    });
    return { first: of(world), twin: of(world.twin!) };
  }, seconds);

test('with the same agent they stay together to the bit', async ({ stage: page }) => {
  await open(page, '#agent=fast&on=1');
  await startFrom(page, 0);
  await run(page, 1).catch(() => {}); // only the first one
  await page.getByLabel('Second agent').selectOption('fast');
  await expect(page.locator('#twin-scene')).toBeVisible();
  const together = async (seconds: number) => {
    const { first, twin } = await run(page, seconds);
    expect(twin).toEqual(first);
    return first;
  };
  await together(2);
  await slide(page, 'mass2', 1.2);
  await slide(page, 'delay', 1);
  await together(2);
  await page.getByRole('button', { name: 'Shove to the left' }).click();
  const shoved = await together(0.1);
  await page.evaluate(() => {
    upswing.world.drag = { link: 2, along: 0.4, target: { x: 0.5, z: 0.2 } };
  });
  const dragged = await together(0.5);
  expect(dragged.state).not.toEqual(shoved.state);
  await page.evaluate(() => (upswing.world.drag = null));
  await page.getByRole('button', { name: 'Run the agent' }).click();
  expect((await together(0.5)).torque).toBe(0);
  await page.getByRole('button', { name: 'Reset', exact: true }).click();
  expect((await together(0)).state).toEqual({ q1: 0, q2: 0, w1: 0, w2: 0 });
  await page.getByLabel('Second agent').selectOption('');
  await expect(page.locator('#twin-scene')).toBeHidden();
  expect(await page.evaluate(() => upswing.world.twin)).toBeNull();
});

test('a link sets both agents, and only the adaptive one balances', async ({ stage: page }) => {
  await open(page, '#everything');
  await page.getByRole('link', { name: 'Light link' }).click();
  await expect(page.locator('#twin-name')).toHaveText('Adaptive Dueling Double DQN');
  await expect(page.locator('#first-name')).toHaveText('Dueling Double DQN');
  await expect(page).toHaveURL(/twin=d3qn-adaptive/);
  await startFrom(page, 0);
  const { first, twin } = await run(page, 20);
  expect(first.upright).toBeLessThan(5);
  expect(twin.upright).toBeGreaterThan(10);
  await page.getByRole('button', { name: 'Resume' }).click();
  await expect(page.locator('#twin-badge')).toHaveText(/balanced for/);
});

test('at any size both are fully visible', async ({ stage: page }) => {
  await open(page, '#agent=fast&twin=sac');
  for (const [width, height] of [
    [320, 640],
    [820, 1180],
    [1440, 900],
  ] as const) {
    await page.setViewportSize({ width, height });
    // Layout adapts to the size a frame later.
    await page.evaluate(async () => {
      for (let k = 0; k < 3; ++k) await new Promise(requestAnimationFrame);
    });
    for (const id of ['scene', 'twin-scene']) {
      const scene = page.locator(`#${id}`);
      await scene.scrollIntoViewIfNeeded();
      await expect(scene).toBeInViewport({ ratio: 1 });
      expect((await scene.boundingBox())!.width).toBeGreaterThan(110);
    }
    const wide = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
    expect(wide, `${width} × ${height}`).toBe(false);
  }
});
