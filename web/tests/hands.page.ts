import { expect } from '@playwright/test';
import { balanced, onScreen, open, run, startFrom, test } from './page';

const state = () => upswing.world.state;

test('a drag pulls the balanced pendulum down, and the agent brings it back', async ({
  stage: page,
}) => {
  await open(page, '#agent=d3qn&on=1');
  await run(page, 8);
  await expect(page.locator('#badge')).toHaveText(/balanced for/);
  const tip = await onScreen(page, 0, 0.98);
  const away = await onScreen(page, 0.9, 0.1);
  await page.mouse.move(tip.x, tip.y);
  await page.mouse.down();
  await page.mouse.move(away.x, away.y, { steps: 5 });
  await expect.poll(() => page.evaluate(() => upswing.world.push !== null)).toBe(true);
  await expect(page.locator('#badge')).toHaveText('swinging up');
  await page.mouse.up();
  expect(await page.evaluate(() => upswing.world.drag)).toBeNull();
  await run(page, 10);
  await expect(page.locator('#badge')).toHaveText(/balanced for [1-9]/);
});

test('a shove moves the pendulum to the side of its arrow', async ({ stage: page }) => {
  await open(page);
  for (const [name, key, side] of [
    ['Shove to the right', 'ArrowRight', -1],
    ['Shove to the left', 'ArrowLeft', 1],
  ] as const) {
    await startFrom(page, 0);
    await page.getByRole('button', { name }).click();
    await run(page, 0.3);
    const shoved = await page.evaluate(state);
    // The arrow outlasts the shove.
    const [arrow, none] = await page.evaluate((side) => {
      const { scene, world } = upswing;
      const { context, element, width } = scene.canvas;
      const { q1, q2 } = world.state;
      scene.draw(world, world.state, []); // at the canvas's present size
      const [x, y] = scene.at({
        x: -(Math.sin(q1) + Math.sin(q1 + q2)) / 2,
        z: -(Math.cos(q1) + Math.cos(q1 + q2)) / 2,
      });
      const ratio = element.width / width;
      const pixel = () => {
        scene.draw(world, world.state, []);
        return context.getImageData((x - 30 * side) * ratio, y * ratio, 1, 1).data.join();
      };
      const drawn = pixel();
      world.shoved = null;
      return [drawn, pixel()];
    }, side);
    expect(arrow).not.toBe(none);
    expect(Math.sign(shoved.q1 + shoved.q2)).toBe(side); // a positive angle is to the left
    await startFrom(page, 0);
    await page.keyboard.press(key);
    await run(page, 0.3);
    const pressed = await page.evaluate(state);
    expect(pressed.q1).toBeCloseTo(shoved.q1, 9);
  }
});

test('the agent withstands one shove, not ten, and gets up again', async ({ stage: page }) => {
  await open(page, '#agent=d3qn&on=1');
  await startFrom(page, Math.PI);
  await run(page, 3);
  const before = await page.evaluate(state);
  await page.getByRole('button', { name: 'Shove to the left' }).click();
  const rows = await run(page, 20);
  const farthest = Math.max(
    ...rows.map((row) => Math.abs(row[1]! + row[2]! - before.q1 - before.q2)),
  );
  expect(farthest).toBeGreaterThan(0.05);
  expect(await balanced(page)).toBeGreaterThan(1);
});

test('a shove during a drag is not kept for later', async ({ stage: page }) => {
  await open(page);
  await startFrom(page, 0);
  await page.evaluate(() => {
    upswing.world.drag = { link: 2, along: 0.5, target: { x: 0, z: -1 } };
    upswing.world.shoveTo(1);
  });
  await run(page, 1);
  await page.evaluate(() => (upswing.world.drag = null));
  await run(page, 0.1);
  expect(await page.evaluate(() => upswing.world.push)).toBeNull();
});

test('one hand at a time, with the left button of a mouse', async ({ stage: page }) => {
  await open(page);
  const [tip, aside] = [await onScreen(page, 0, -0.9), await onScreen(page, 0.5, 0.5)];
  const drag = () => page.evaluate(() => upswing.world.drag?.target ?? null);
  await page.mouse.move(tip.x, tip.y);
  await page.mouse.down({ button: 'right' });
  expect(await drag()).toBeNull();
  await page.mouse.up({ button: 'right' });
  await page.mouse.down();
  const held = await drag();
  expect(held).not.toBeNull();
  await page.evaluate(({ x, y }) => {
    const canvas = document.getElementById('scene')!;
    for (const type of ['pointerdown', 'pointermove', 'pointerup']) {
      const place = { clientX: x, clientY: y };
      canvas.dispatchEvent(new PointerEvent(type, { pointerId: 77, button: 0, ...place }));
    }
  }, aside);
  expect(await drag()).toEqual(held);
  await page.mouse.up();
  expect(await drag()).toBeNull();
});

test('a mere touch while paused changes nothing', async ({ stage: page }) => {
  await open(page);
  await startFrom(page, 1, 0.5, 2, -1);
  const elbow = await onScreen(page, -0.3 * Math.sin(1), -0.3 * Math.cos(1));
  await page.mouse.click(elbow.x, elbow.y);
  expect(await page.evaluate(state)).toEqual({ q1: 1, q2: 0.5, w1: 2, w2: -1 });
});

test('while paused, dragging sets the start', async ({ stage: page }) => {
  await open(page);
  await page.getByRole('button', { name: 'Pause' }).click();
  const drag = async (from: [number, number], to: [number, number]) => {
    const [a, b] = [await onScreen(page, ...from), await onScreen(page, ...to)];
    await page.mouse.move(a.x, a.y);
    await page.mouse.down();
    await page.mouse.move(b.x, b.y);
    await page.mouse.up();
  };
  await drag([0, -0.3], [0.4, 0]); // the upper link to the right
  let posed = await page.evaluate(state);
  expect(posed.q1).toBeCloseTo(-Math.PI / 2, 1);
  expect(posed.q2).toBeCloseTo(0, 5);
  await drag([0.8, 0], [0.5, 0.4]); // the lower link up
  posed = await page.evaluate(state);
  expect(posed.q1 + posed.q2).toBeCloseTo(-Math.PI, 1);
  expect([posed.w1, posed.w2]).toEqual([0, 0]);
});
