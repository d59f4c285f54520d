import { expect } from '@playwright/test';
import { largestDifference, open, run, slide, startFrom, test } from './page';
import { policyPath, simulate } from './program';

const OTHER = [
  ['mass1', 1.6],
  ['mass2', 0.45],
  ['length1', 0.38],
  ['length2', 0.71],
  ['damping1', 0.05],
  ['damping2', 0.6],
  ['gravity', 3.71],
] as const;

const START = [2.5, 0.4, 0.3, -0.5] as const;
const free = (...set: string[]) =>
  simulate('--start', START.join(), '--seconds', '3', ...set.flatMap((s) => ['--set', s]));

test('each slider changes the physics as in `upswing simulate`', async ({ stage: page }) => {
  await open(page);
  const nominal = free();
  for (const [name, value] of OTHER) {
    await slide(page, name, value);
    await startFrom(page, ...START);
    const rows = await run(page, 3);
    expect(largestDifference(rows, free(`${name}=${value}`)), name).toBeLessThan(1e-9);
    expect(largestDifference(rows, nominal), name).toBeGreaterThan(0.05);
    await page.getByRole('button', { name: 'Reset sliders' }).click();
  }
  await startFrom(page, ...START);
  expect(largestDifference(await run(page, 3), nominal)).toBeLessThan(1e-9);
});

test('all of them together, live', async ({ stage: page }) => {
  await open(page);
  await startFrom(page, ...START);
  await run(page, 1);
  for (const [name, value] of OTHER) await slide(page, name, value);
  await startFrom(page, ...START);
  const rows = await run(page, 3);
  const other = free(...OTHER.map(([name, value]) => `${name}=${value}`));
  expect(largestDifference(rows, other)).toBeLessThan(1e-9);
});

test('limit of the motor, sensor noise and delay act on the agent', async ({ stage: page }) => {
  await open(page, '#agent=d3qn&on=1');
  const torques = async () => {
    await startFrom(page, 0.3);
    return (await run(page, 2)).map((row) => row[5]!);
  };
  const before = await torques();
  expect(Math.max(...before.map(Math.abs))).toBe(5);
  await slide(page, 'torque_limit', 2);
  expect(Math.max(...(await torques()).map(Math.abs))).toBe(2);
  await page.getByRole('button', { name: 'Reset Limit of the motor' }).click();
  await slide(page, 'delay', 2);
  const late = await torques();
  expect(late.slice(0, 2)).toEqual([0, 0]);
  expect(late[2]).toBe(before[0]);
  await page.getByRole('button', { name: 'Reset Delay of the motor' }).click();
  expect(await torques()).toEqual(before);
  await slide(page, 'sensor_noise', 0.1);
  expect(await torques()).not.toEqual(before);
});

test('encoders, their velocities and latency act as in `upswing simulate`', async ({
  stage: page,
}) => {
  await open(page, '#agent=d3qn&on=1&velocity_window=0.01');
  await slide(page, 'encoder_counts', 4096);
  await slide(page, 'sensor_latency', 0.005);
  await slide(page, 'velocity_filter', 0.004);
  await startFrom(page, 0.3);
  const rows = await run(page, 3);
  const flags = ['--encoder-counts', '4096', '--velocity-window', '0.01', '--sensor-latency'];
  flags.push('0.005', '--velocity-filter', '0.004', '--start', '0.3,0,0,0', '--seconds', '3');
  expect(largestDifference(rows, simulate(policyPath('d3qn'), ...flags))).toBeLessThan(1e-6);
  await expect(page.locator('output[for=encoder_counts]')).toHaveText('4096 counts');
  await page.getByRole('button', { name: 'Reset sliders' }).click();
  expect(await page.evaluate(() => upswing.world.disturbance.encoder_counts)).toBe(0);
});

test('one slider is reset, the others stay', async ({ stage: page }) => {
  await open(page);
  const back = page.getByRole('button', { name: 'Reset Gravity' });
  await expect(back).toBeDisabled();
  await slide(page, 'gravity', 3.71);
  await slide(page, 'mass1', 2);
  await back.click();
  expect(await page.evaluate(() => upswing.world.plant)).toMatchObject({ gravity: 9.81, mass1: 2 });
});

test('the address holds all settings, and restores them', async ({ stage: page }) => {
  await open(page);
  await page.locator('#agent').selectOption('fast');
  await slide(page, 'mass2', 1.25);
  await slide(page, 'sensor_noise', 0.02);
  await slide(page, 'speed', 0.5);
  await page.getByRole('button', { name: 'Run the agent' }).click();
  await expect(page).toHaveURL(/on=1/); // the address follows a little later
  const { hash } = new URL(page.url());
  await page.goto('about:blank');
  await open(page, hash);
  await expect(page.locator('#agent')).toHaveValue('fast');
  await expect(page.locator('#mass2')).toHaveValue('1.25');
  await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'true');
  const set = await page.evaluate(() => ({
    mass2: upswing.world.plant.mass2,
    noise: upswing.world.disturbance.sensor_noise,
    speed: upswing.clock.speed,
  }));
  expect(set).toEqual({ mass2: 1.25, noise: 0.02, speed: 0.5 });
});

test('settings are restored after a look at the tour', async ({ stage: page }) => {
  await open(page, '#agent=fast&gravity=14');
  await page.getByRole('link', { name: 'Tour' }).click();
  await expect(page.locator('#step-watch h2')).toBeVisible();
  await page.getByRole('link', { name: 'Everything' }).first().click();
  await expect(page.locator('#agent')).toHaveValue('fast');
  await expect(page.locator('#gravity')).toHaveValue('14');
});

test('invalid parts of an address are reported, and the rest is used', async ({ stage: page }) => {
  await open(page, '#agent=none&mass1=-3&mass2=1.5&colour=red');
  const message = page.locator('#message');
  await expect(message).toContainText('unknown agent "none"');
  await expect(message).toContainText('mass1: expected 0.01 to 100, got "-3"');
  await expect(message).toContainText('unknown setting "colour"');
  expect(await page.evaluate(() => upswing.world.plant)).toMatchObject({ mass1: 1, mass2: 1.5 });
});

test('another address in the same tab starts the page again', async ({ stage: page }) => {
  await open(page, '#agent=d3qn&on=1');
  await page.waitForTimeout(500);
  await page.evaluate(() => (location.hash = '#agent=fast&mass1=1.4'));
  await expect(page.locator('#agent')).toHaveValue('fast');
  await expect(page.locator('#mass1')).toHaveValue('1.4');
  await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'false');
  expect(await page.evaluate(() => upswing.world.state)).toEqual({ q1: 0, q2: 0, w1: 0, w2: 0 });
});
