import { expect } from '@playwright/test';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { Core } from '../src/core';
import { Learner } from '../src/learn/learner';
import { coreModule } from './core';
import { withMetadata } from './file';
import { advance, balanced, drawn, open, run, slide, startFrom, test } from './page';
import { readPolicy } from './program';

/// A training on a plant a quarter as large as the page's. Its links are not quite the page's.
const SMALL = {
  ...{ mass1: '0.0156', mass2: '0.0156', length1: '0.125', length2: '0.125' },
  ...{ damping1: '4e-4', damping2: '4e-4', torque_limit: '0.02', armature: '1e-5' },
  ...{ inertia1: '2.4e-5', inertia2: '2.4e-5', control_period: '0.01', episode_seconds: '2' },
};

const text = (id: string) => `output[for=${id}]`;

for (const id of ['d3qn', 'sac', 'any-pose', 'mpc']) {
  test(`${id} swings up and holds pendulums of 5 cm and 5 m`, async ({ stage: page }) => {
    for (const size of [0.05, 5]) {
      await open(page, `#agent=${id}&on=1&size=${size}`);
      await startFrom(page, 0);
      await advance(page, 15);
      expect(await balanced(page)).toBeGreaterThan(10);
      // The physics has the true numbers.
      const real = await page.evaluate(() => {
        const { model } = upswing.world.simulator as never as {
          model: { body_mass: Float64Array; body_pos: Float64Array; opt: { timestep: number } };
        };
        return [model.body_mass[1]!, -model.body_pos[8]!, model.opt.timestep];
      });
      const expected = [size ** 3, 0.5 * size, 0.005 * Math.sqrt(size)];
      real.forEach((number, i) => expect(number / expected[i]!).toBeCloseTo(1, 9));
    }
  });
}

test('one slider sets the size, and all values are true ones', async ({ stage: page }) => {
  await open(page, '#agent=d3qn');
  const size = page.locator('#size');
  await expect(page.locator(text('size'))).toHaveText('1 m, a guitar');
  await slide(page, 'mass2', 1.2);
  await size.focus();
  await page.keyboard.press('Home');
  await expect(page.locator(text('size'))).toHaveText('5 cm, a matchbox');
  await expect(size).toHaveAttribute('aria-valuetext', '5 cm, a matchbox');
  await expect(page.locator(text('mass2'))).toHaveText('0.15 g');
  await expect(page.locator(text('length1'))).toHaveText('0.025 m');
  await expect(page.locator(text('torque_limit'))).toHaveText('31.25 µN·m');
  await expect(page.locator('#torque_limit')).toHaveAccessibleName(/agent: ±31\.25 µN·m/);
  await page.keyboard.press('End');
  await expect(page.locator(text('size'))).toHaveText('10 m, a house');
  await expect(page.locator(text('mass2'))).toHaveText('1.2 t');
  await expect(page.locator('#height-value')).toHaveText('−10.00 m of 10.00 m');
  await slide(page, 'delay', 1);
  await expect(page.locator(text('delay'))).toHaveText('63.25 ms');
  await page.getByRole('button', { name: 'Reset Size' }).click();
  await expect(page.locator(text('mass2'))).toHaveText('1.2 kg');
  await expect(page.locator(text('delay'))).toHaveText('20 ms');
  expect(await page.evaluate(() => upswing.world.plant)).toMatchObject({ size: 1, mass2: 1.2 });
});

test('a link keeps the size, and Reset sliders sets it back', async ({ stage: page }) => {
  await open(page, '#agent=d3qn');
  await page.locator('#size').focus();
  await page.keyboard.press('End');
  await slide(page, 'mass1', 1.5);
  await expect(page).toHaveURL(/#agent=d3qn&size=10&mass1=1.5|#agent=d3qn&mass1=1.5&size=10/);
  await open(page, '#agent=d3qn&size=0.2&mass1=1.5');
  await expect(page.locator(text('size'))).toHaveText('20 cm, a pencil');
  await expect(page.locator(text('mass1'))).toHaveText('0.012 kg');
  await open(page, '#agent=d3qn&size=20');
  await expect(page.locator('#message')).toContainText('size: expected 0.05 to 10, got "20"');
  await open(page, '#agent=d3qn&size=0.2');
  await page.getByRole('button', { name: 'Reset sliders' }).click();
  await expect(page.locator(text('size'))).toHaveText('1 m, a guitar');
  await expect(page).not.toHaveURL(/size/);
});

test('a small pendulum moves faster than a large one', async ({ stage: page }) => {
  const moved = async (size: number) => {
    await open(page, `#size=${size}`);
    return page.evaluate(() => {
      upswing.stage.setPaused(true);
      const before = upswing.world.time;
      for (let k = 0; k < 50; ++k) upswing.clock.advance(0.02);
      const { time, units } = upswing.world;
      return (time - before) * units.time; // s, true ones
    });
  };
  for (const size of [0.1, 1, 9]) expect(await moved(size)).toBeCloseTo(1, 1);
});

test('its place on the screen stays, and a bar and a thing show the size', async ({
  stage: page,
}) => {
  const picture = async (size: number) => {
    await open(page, `#agent=d3qn&size=${size}`);
    await startFrom(page, 2, 0.5);
    await drawn(page);
    return page.evaluate(() => {
      const { scene } = upswing;
      const { data } = scene.canvas.context.getImageData(
        0,
        0,
        scene.canvas.element.width,
        scene.canvas.element.height,
      );
      return {
        tip: scene.at({ x: 0.3, z: 0.4 }),
        hash: data.reduce((a, b) => (31 * a + b) | 0, 7),
      };
    });
  };
  const [usual, small, large] = [await picture(1), await picture(0.05), await picture(10)];
  expect(small.tip).toEqual(usual.tip);
  expect(large.tip).toEqual(usual.tip);
  expect(new Set([usual.hash, small.hash, large.hash]).size).toBe(3);
});

test('the trajectory is saved in true numbers', async ({ stage: page }) => {
  await open(page, '#size=4');
  await startFrom(page, 1, 0, 2);
  const rows = await run(page, 1);
  const csv = await page.evaluate(() => upswing.stage.history.csv());
  const saved = csv
    .trim()
    .split('\n')
    .slice(1)
    .map((line) => line.split(',').map(Number));
  const ours = saved.slice(-rows.length);
  rows.forEach(([t, q1, , w1], k) => {
    expect(ours[k]![0]! - ours[0]![0]!).toBeCloseTo(2 * (t! - rows[0]![0]!), 9);
    expect(ours[k]![1]).toBe(q1);
    expect(ours[k]![3]).toBeCloseTo(w1! / 2, 12);
  });
});

test('a policy for another size or period is taken, and the page says so', async ({
  stage: page,
}) => {
  const learner = new Learner(await Core.start(await coreModule()), 'fast', 1, SMALL);
  const small = learner.policy();
  await open(page);
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  const bring = async (name: string, bytes: ArrayBuffer) => {
    const file = join(folder, name);
    writeFileSync(file, new Uint8Array(bytes));
    await page.locator('#file').setInputFiles(file);
  };
  try {
    await bring('quick.safetensors', withMetadata(readPolicy('fast'), 'control_period', '0.005'));
    await expect(page.locator('#agent-what')).toContainText('A policy that chooses torques');
    await page.locator('#agent-details > summary').click();
    await expect(page.locator('#agent-text')).toContainText('decides every 5 ms');
    await startFrom(page, 1);
    expect((await run(page, 0.1)).length).toBe(20);
    await bring('small.safetensors', small);
    await expect(page.locator('#message')).toContainText(
      'It learned on another pendulum, 0.25 m long. It moves the page’s at that size.',
    );
    await expect(page.locator(text('size'))).toHaveText('25 cm, a pencil');
    await expect(page.locator('#agent-text')).toContainText(
      'trained on another pendulum of 0.25 m',
    );
    await expect(page).toHaveURL(/size=0\.25/);
    await bring('slow.safetensors', withMetadata(readPolicy('fast'), 'control_period', '2'));
    await expect(page.locator('#message')).toContainText('expected 0.001 to 1 s, got 2');
  } finally {
    rmSync(folder, { recursive: true });
  }
});
