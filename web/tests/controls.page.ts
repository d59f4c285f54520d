import { expect } from '@playwright/test';
import { readFileSync, truncateSync, writeFileSync } from 'node:fs';
import { open, run, slide, startFrom, test } from './page';
import { policyPath, readPolicy } from './program';

const time = () => upswing.world.time;

test('pause stands still, step goes on by 0.02 s, reset hangs', async ({ stage: page }) => {
  await open(page, '#on=1');
  await page.getByRole('button', { name: 'Pause' }).click();
  const stopped = await page.evaluate(time);
  await page.waitForTimeout(200);
  expect(await page.evaluate(time)).toBe(stopped);
  await startFrom(page, 1);
  await page.getByRole('button', { name: 'Step' }).click();
  expect(await page.evaluate(time)).toBeCloseTo(stopped + 0.02, 9);
  await page.getByRole('button', { name: 'Reset', exact: true }).click();
  expect(await page.evaluate(() => upswing.world.state)).toEqual({ q1: 0, q2: 0, w1: 0, w2: 0 });
  await page.getByRole('button', { name: 'Resume' }).click();
  await expect.poll(() => page.evaluate(time)).toBeGreaterThan(stopped + 0.1);
});

test('speed', async ({ stage: page }) => {
  await open(page);
  const rate = async () => {
    const [t, start] = await page.evaluate(() => [upswing.world.time, performance.now()]);
    await page.waitForTimeout(1000);
    const [later, end] = await page.evaluate(() => [upswing.world.time, performance.now()]);
    return (1000 * (later! - t!)) / (end! - start!);
  };
  await slide(page, 'speed', 0.1);
  const slow = await rate();
  await slide(page, 'speed', 2);
  const fast = await rate();
  // A busy machine may drop frames. Then the page does not jump.
  expect(slow).toBeLessThan(0.15);
  expect(fast).toBeGreaterThan(5 * slow);
  expect(fast).toBeLessThan(2.2);
});

test('only by keyboard', async ({ page }) => {
  await open(page);
  await page.keyboard.press('g');
  await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'true');
  await page.keyboard.press('Space');
  await expect(page.locator('#pause')).toHaveText('Resume');
  await page.keyboard.press('.'); // to the agent's next decision
  const stopped = await page.evaluate(time);
  await page.keyboard.press('.');
  expect(await page.evaluate(time)).toBeCloseTo(stopped + 0.02, 9);
  // The tab key reaches every control, and sliders keep the arrow keys.
  const reached = new Set<string>();
  for (let k = 0; k < 60; ++k) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => document.activeElement!.id));
  }
  for (const id of ['agent-on', 'pause', 'step', 'reset', 'shove-left', 'speed', 'agent', 'file']) {
    expect(reached, id).toContain(id);
  }
  await page.locator('#mass1').focus();
  await page.keyboard.press('ArrowRight');
  expect(await page.evaluate(() => upswing.world.plant.mass1)).toBeCloseTo(1.05, 9);
  await page.locator('#agent-on').focus();
  await page.keyboard.press('Enter');
  await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'false');
});

test('keys can be switched off, and stay so', async ({ stage: page }) => {
  await open(page);
  await page.getByText('Keyboard', { exact: true }).click();
  await page.locator('#keys').uncheck();
  await page.locator('body').click({ position: { x: 1, y: 1 } });
  const nothing = async () => {
    for (const key of ['g', ' ', '.', 'r', 'ArrowLeft']) await page.keyboard.press(key);
    await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'false');
    await expect(page.locator('#pause')).toHaveText('Pause');
    expect(await page.evaluate(() => upswing.world.push)).toBeNull();
  };
  await nothing();
  await page.goto('about:blank');
  await open(page);
  await nothing();
  await page.getByText('Keyboard', { exact: true }).click();
  await page.locator('#keys').check();
  await page.locator('body').click({ position: { x: 1, y: 1 } });
  await page.keyboard.press('g');
  await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'true');
});

test('while paused, the keyboard sets the start', async ({ stage: page }) => {
  await open(page);
  await expect(page.locator('#pose')).toBeHidden();
  await startFrom(page, 3, -1, 2, 1);
  const upper = page.getByLabel('Angle of the upper link', { exact: true });
  await expect(page.locator('output[for=pose-q1]')).toHaveText('172°');
  await upper.focus();
  await page.keyboard.press('End');
  const state = () => page.evaluate(() => upswing.world.state);
  let posed = await state();
  expect(posed).toEqual({ q1: Math.PI, q2: -1, w1: 2, w2: 1 }); // the other variables as before
  await page.keyboard.press('ArrowLeft');
  const lower = page.getByLabel('Angle of the lower link to it', { exact: true });
  await expect(lower).toHaveAttribute('aria-valuetext', '−57°');
  await lower.focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  posed = await state();
  expect(posed.q1).toBeCloseTo((179 * Math.PI) / 180, 9);
  expect(posed.q2).toBeCloseTo((-179 * Math.PI) / 180, 9);
  await expect(page.locator('#badge')).toHaveText('paused');
  await page.getByRole('button', { name: 'Resume' }).click();
  await expect(page.locator('#pose')).toBeHidden();
});

test('the trail shows the last 20 s, at any frame rate and speed', async ({ stage: page }) => {
  await open(page);
  await startFrom(page, 0);
  await page.locator('#reset').click(); // and clears the trail
  const ages = () =>
    page.evaluate(async () => {
      const { scene, world } = upswing;
      const draw = scene.draw.bind(scene);
      const seen = new Promise<number[]>((resolve) => {
        scene.draw = (w, state, trail) => {
          draw(w, state, trail);
          resolve(trail.map(({ t }) => world.time - t));
        };
      });
      const result = await seen;
      scene.draw = draw;
      return result;
    });
  await run(page, 0.5); // no frame in between
  expect((await ages()).length).toBe(25);
  await run(page, 25);
  const long = await ages();
  expect(long.length).toBe(1000);
  expect(Math.max(...long)).toBeCloseTo(20, 9);
});

test('a policy dropped on the page', async ({ stage: page }) => {
  await open(page);
  const bytes = [...readFileSync(policyPath('fast'))];
  await page.evaluate((content) => {
    const data = new DataTransfer();
    data.items.add(new File([new Uint8Array(content)], 'mine.safetensors'));
    dispatchEvent(new DragEvent('drop', { dataTransfer: data, cancelable: true }));
  }, bytes);
  await expect(page.locator('#agent option:checked')).toHaveText('mine.safetensors (yours)');
});

test('a broken policy is refused with a reason, and the agent stays', async ({
  stage: page,
}, info) => {
  await open(page, '#agent=d3qn');
  const whole = Buffer.from(readPolicy('fast'));
  const files = [
    ['cut.safetensors', whole.subarray(0, whole.length - 100), 'not a valid safetensors file'],
    ['text.safetensors', Buffer.from('<script>alert(1)</script>'), 'not a valid safetensors file'],
    ['empty.safetensors', Buffer.alloc(0), 'not a valid safetensors file'],
    ['huge.safetensors', Buffer.alloc(0), 'it is larger than 16 MB'],
  ] as const;
  for (const [name, bytes, reason] of files) {
    const path = info.outputPath(name);
    writeFileSync(path, bytes);
    if (name.startsWith('huge')) truncateSync(path, 17 * 1024 * 1024); // makes it longer
    await page.locator('#file').setInputFiles(path);
    await expect(page.locator('#message')).toContainText(
      `"${name}" cannot be used as a policy: ${reason}`,
    );
    await expect(page.locator('#agent')).toHaveValue('d3qn');
  }
});

test('the trajectory can be saved', async ({ stage: page }) => {
  await open(page, '#on=1');
  await page.waitForTimeout(500);
  await page.getByRole('button', { name: 'Pause' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save CSV' }).click();
  const csv = readFileSync(await (await download).path(), 'utf8').split('\n');
  expect(csv[0]).toBe('t,q1,q2,w1,w2,torque');
  expect(csv.length).toBeGreaterThan(5);
});

test('dark and light', async ({ stage: page }) => {
  await open(page);
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await background();
  await page.locator('#theme').click();
  expect(await background()).not.toBe(light);
  await page.locator('#theme').click();
  expect(await background()).toBe(light);
});

test('dark where the system is dark, on canvases too', async ({ stage: page }) => {
  await open(page);
  const colors = () =>
    page.evaluate(() => [
      getComputedStyle(document.body).backgroundColor,
      upswing.scene.canvas.color('ink'),
    ]);
  const light = await colors();
  await page.emulateMedia({ colorScheme: 'dark' });
  await expect.poll(colors).not.toContain(light[0]);
  await expect.poll(colors).not.toContain(light[1]);
});
