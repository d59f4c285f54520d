import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { advance, balanced, open, test } from './page';

/// The visitor's own agent in the tour, the steps that change pendulum, reward and pose, and the page
/// at rest.

const [LEARN, SHOVE, CHANGE, BET, REWARD, POSE, VALUES, MAP, END] = [3, 4, 6, 5, 7, 8, 9, 10, 11];
const RECIPE = 'learn=fast&seed=7';

const words = (page: Page) => page.locator('.step:not([inert]) > p').first();
const answer = (page: Page) => page.locator('.step:not([inert]) .answer');
const agentOf = (page: Page) => page.locator('#agent');

/// Gives the visitor an agent that learned here: the small one that comes with the page.
const learned = (page: Page) =>
  page.evaluate(async (recipe) => {
    const bytes = await (await fetch('agents/fast.safetensors')).arrayBuffer();
    await upswing.keepLearned({ file: new File([bytes], 'mine'), recipe }, false);
  }, RECIPE);

const stopTime = (page: Page) => page.evaluate(() => void (upswing.clock.advance = () => true));

test('without a training the steps show the agent of the page, and say so', async ({
  stage: page,
}) => {
  for (const step of [SHOVE, CHANGE, BET, VALUES, MAP]) {
    await open(page, `#tour=${step}`);
    await expect(agentOf(page)).toHaveValue('d3qn');
    await expect(words(page).locator('.shipped')).toBeVisible();
    await expect(words(page).locator('.yours')).toBeHidden();
  }
});

test('the agent that learned here is the one of all later steps, and in their links', async ({
  stage: page,
}) => {
  await open(page, `#tour=${SHOVE}`);
  await learned(page);
  // It takes over the step that is shown.
  await expect(agentOf(page)).toHaveValue('own');
  await expect(page.locator('#message')).toContainText('takes over');
  for (const step of [SHOVE, CHANGE, BET, VALUES, MAP, END]) {
    await open(page, `#tour=${step}`);
    await expect(agentOf(page)).toHaveValue('own');
    await expect(page).toHaveURL(new RegExp(`#tour=${step}&${RECIPE}$`));
    if (step === END) continue;
    await expect(words(page).locator('.yours')).toBeVisible();
    await expect(words(page).locator('.shipped')).toBeHidden();
  }
  // The rival in the bet stays.
  await open(page, `#tour=${BET}`);
  await expect(page.locator('#twin-name')).toHaveText('learned on many');
  await expect(page.locator('#first-name')).toHaveText('yours, learned on one');
});

test('a link to a step lets its agent learn where it is opened, once', async ({ page }) => {
  await page.goto(`./#tour=${SHOVE}&${RECIPE}`);
  await page.waitForFunction(() => globalThis.upswing?.isComplete);
  await expect.poll(() => page.workers().length).toBe(1);
  await expect(agentOf(page)).toHaveValue('d3qn');
  const recipe = await page.evaluate(() => upswing.learn.address);
  expect(recipe).toBe(RECIPE);
  await page.evaluate(() => upswing.learn.stop());
});

test('a lighter link: one slider first, then the others, and the answer says when it fails', async ({
  stage: page,
}) => {
  await open(page, `#tour=${CHANGE}`);
  await stopTime(page);
  await expect(page.locator('#change-sliders .slider:visible')).toHaveCount(1);
  await expect(page.locator('#change-choice')).toBeHidden();
  await page.evaluate(() => upswing.reset());
  await advance(page, 6);
  expect(await balanced(page)).toBeGreaterThan(2);
  const mass = page.locator('#change-mass2');
  await mass.fill('0.95');
  await expect(page.locator('#change-choice')).toBeVisible();
  expect(await page.evaluate(() => upswing.world.plant.mass2)).toBe(0.95);
  await advance(page, 5);
  await expect(answer(page)).toHaveText('Still up with 0.95 kg. Go on!');
  await mass.fill('0.5');
  const until = (upright: boolean) =>
    page.evaluate(async (upright) => {
      const { world } = upswing;
      while ((world.uprightFor ?? 0) > 0 !== upright) world.advance();
      for (let k = 0; k < 12; ++k) await new Promise(requestAnimationFrame); // two answers
    }, upright);
  await until(false);
  await until(true); // whirls past upright
  await expect(answer(page)).toHaveText('It fell, and tries again …');
  await advance(page, 14);
  await expect(answer(page)).toHaveText(/^It fails with 0\.5 kg/);
  // The laboratory's slider shows the same value.
  await expect(page.locator('#mass2')).toHaveValue('0.5');
  for (const name of ['upper mass', 'lower length', 'damping', 'gravity', 'size']) {
    await page.getByRole('button', { name, exact: true }).click();
    await expect(page.locator('#change-sliders .slider:visible')).toHaveCount(1);
  }
  await page.locator('#change-size').fill('-1');
  expect(await page.evaluate(() => upswing.world.plant.size)).toBe(0.1);
});

test('a reward that prefers a side is learned, and leaves the own training as it is', async ({
  stage: page,
}) => {
  await open(page, `#tour=${LEARN}`);
  await page.locator('#tour-learn').click();
  await expect(page.locator('#tour-count')).not.toBeEmpty();
  const before = await page.evaluate(() => upswing.learn.address);
  await page.evaluate(() => upswing.learn.toggle()); // leaves the processor to the other one
  await page
    .locator('#dots')
    .getByRole('button', { name: `Step ${REWARD}:` })
    .click();
  await page.getByRole('button', { name: 'Spin fast' }).click();
  await expect(answer(page)).toHaveText(/^It spins, \d\.\d turns a second/);
  expect(await page.evaluate(() => upswing.agents.ownName)).toBeNull();
  await expect(page.locator('#reward-problem')).toContainText('mirror is off');
  await page
    .locator('#dots')
    .getByRole('button', { name: `Step ${LEARN}:` })
    .click();
  await expect.poll(() => page.evaluate(() => upswing.learn.address)).toBe(before);
  await expect(page.locator('#tour-learn')).toHaveText('Resume');
  await page.evaluate(() => upswing.learn.stop());
});

test('the lazy agent gets no answer before it has tried anything', async ({ stage: page }) => {
  await open(page, `#tour=${REWARD}`);
  await page.getByRole('button', { name: 'Be lazy' }).click();
  // It hangs at rest before it has tried anything.
  await expect(page.locator('#reward-count')).toHaveText(/^Trial \d/);
  await expect(answer(page)).toHaveText('It tries …');
  await expect(answer(page)).toHaveText(/^It hangs and rests/);
  await expect(page.locator('#badge')).toBeHidden(); // the goal is another one
});

test('an empty reward is refused', async ({ stage: page }) => {
  await open(page, '#learn');
  await page.locator('#reward-details > summary').click();
  await page.locator('#reward-text').fill(' ');
  for (const button of ['#reward-learn', '#learn-start']) {
    await page.evaluate((one) => document.querySelector<HTMLElement>(one)!.click(), button);
    await expect(page.locator('#reward-problem')).toHaveText(/^The reward is empty/);
    expect(await page.evaluate(() => upswing.learn.running)).toBe(false);
  }
  await page.locator('#reward-reset').click();
  await page.locator('#reward-details > summary').click();
});

test('any pose: the pictures choose it, and the answer counts', async ({ stage: page }) => {
  await open(page, `#tour=${POSE}`);
  await stopTime(page);
  await page.evaluate(() => upswing.reset());
  await advance(page, 10);
  await expect(answer(page)).toHaveText('1 of 4 poses. Choose another one.');
  await page.getByRole('button', { name: 'Both links up' }).click();
  await advance(page, 10);
  await expect(answer(page)).toHaveText('2 of 4 poses. Choose another one.');
});

test('a pendulum that stands still is not drawn, and a shove wakes the page', async ({
  stage: page,
}) => {
  await open(page, `#tour=${SHOVE}`);
  await page.evaluate(() => upswing.choose('sac')); // which stands still
  await page.evaluate(() => upswing.reset());
  await advance(page, 40);
  /// Drawings within half a second.
  const drawings = () =>
    page.evaluate(async () => {
      const { scene } = upswing;
      const { draw } = Object.getPrototypeOf(scene) as typeof scene;
      let count = 0;
      scene.draw = (...given) => {
        ++count;
        draw.apply(scene, given);
      };
      await new Promise((resolve) => setTimeout(resolve, 500));
      delete (scene as Partial<typeof scene>).draw;
      return count;
    });
  await expect.poll(drawings).toBe(0);
  const badge = page.locator('#badge');
  const before = await badge.textContent();
  await expect(badge).not.toHaveText(before!); // its seconds go on
  await page.locator('#tour-shove-left').click();
  await expect.poll(drawings).toBeGreaterThan(0);
});

test('on a phone the pendulum stays in sight while a slider is dragged', async ({
  stage: page,
}) => {
  await page.setViewportSize({ width: 390, height: 664 });
  await open(page, '#everything');
  const slider = page.locator('#gravity');
  await slider.scrollIntoViewIfNeeded();
  await expect(page.locator('#scene')).not.toBeInViewport();
  const { x, y, width, height } = (await slider.boundingBox())!;
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + width / 3, y + height / 2);
  await expect(page.locator('#scene')).toBeInViewport({ ratio: 0.9 });
  const now = (await slider.boundingBox())!;
  expect(Math.abs(now.y - y)).toBeLessThanOrEqual(1); // the slider stays under the finger
  const stage = (await page.locator('#stage').boundingBox())!;
  expect(stage.y + stage.height <= y || stage.y >= y + height).toBe(true);
  await page.mouse.up();
  await expect(page.locator('#scene')).not.toBeInViewport();
});
