import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { drawn, open, test } from './page';

/// The tour on phones, upright and on their side, and on a laptop at a zoom of 200%: the pendulum has
/// nearly half of the height, and the buttons to go on are in sight in every step.

const UPRIGHT = [
  [360, 640],
  [375, 553],
  [390, 664],
  [390, 844],
  [412, 700],
  [412, 780],
] as const;
const SIDEWAYS = [
  [667, 375],
  [844, 390],
  [683, 325], // 1366 × 650 at 200%
  [640, 360],
] as const;
const LEAST = 0.45; // of the height

interface Place {
  top: number;
  bottom: number;
  left: number;
  right: number;
}

/// Places of visible elements; null for the others.
const placesOf = (page: Page, ids: readonly string[]) =>
  page.evaluate((ids) => {
    scrollTo({ top: 0, behavior: 'instant' });
    return ids.map((id) => {
      const found = document.getElementById(id)!;
      const { top, bottom, left, right } = found.getBoundingClientRect();
      const seen = found.checkVisibility({ visibilityProperty: true });
      return seen && bottom > top ? { top, bottom, left, right } : null;
    });
  }, ids) as Promise<(Place | null)[]>;

/// Texts of the visible controls that another element covers, with the page at its top.
const coveredOf = (page: Page) =>
  page.evaluate(() => {
    scrollTo({ top: 0, behavior: 'instant' });
    const controls = '.step:not([inert]) :is(button, input, a, summary), #tour-buttons > *';
    return [...document.querySelectorAll<HTMLElement>(controls)].flatMap((one) => {
      const seen = one.checkVisibility({ visibilityProperty: true });
      if (!seen || one.closest('.visually-hidden, details[open], #change-choice')) return [];
      const { x, y, width, height } = one.getClientRects()[0]!;
      const top = document.elementFromPoint(x + width / 2, y + height / 2);
      return top && (one.contains(top) || top.contains(one)) ? [] : [one.textContent || one.id];
    });
  });

for (const [name, sizes] of [
  ['upright', UPRIGHT],
  ['on its side', SIDEWAYS],
] as const) {
  test(`${name}, the stage has 45% of the height, Next and Learn are in sight${sizes === UPRIGHT ? ' and no control is covered' : ''}`, async ({
    stage: page,
  }) => {
    await open(page, '#tour=1');
    const steps = await page.locator('.step').count();
    for (let step = 1; step <= steps; ++step) {
      if (step > 1) await page.locator('#tour-next').click();
      for (const [width, height] of sizes) {
        await page.setViewportSize({ width, height });
        await drawn(page);
        const what = `step ${step}, ${width} × ${height}`;
        const [stage, next, learn] = await placesOf(page, ['stage', 'tour-next', 'tour-learn']);
        const shown = Math.min(stage!.bottom, height) - Math.max(stage!.top, 0);
        expect(shown / height, what).toBeGreaterThanOrEqual(LEAST);
        for (const button of [next, learn]) {
          if (button) expect(button.bottom, what).toBeLessThanOrEqual(height);
          if (button) expect(button.right, what).toBeLessThanOrEqual(width);
        }
        expect(next !== null, what).toBe(step < steps);
        if (sizes === UPRIGHT) expect(await coveredOf(page), what).toEqual([]);
        const scrolls = await page.evaluate(
          () => document.documentElement.scrollWidth > innerWidth,
        );
        expect(scrolls, what).toBe(false);
      }
      await page.setViewportSize({ width: 1280, height: 720 });
    }
  });
}

for (const [width, height] of [
  [375, 553],
  [390, 664],
  [1366, 650],
] as const) {
  test(`Learn moves nothing at ${width} × ${height}, and the curve comes with its legend`, async ({
    page,
  }) => {
    await page.setViewportSize({ width, height });
    await open(page, '#tour=3');
    await expect(page.locator('#learn-figure')).toBeHidden();
    await expect(page.locator('#learn-words')).toBeVisible();
    await drawn(page);
    const ids = ['stage', 'step-learn', 'tour-learn', 'tour-next'];
    const before = await placesOf(page, ids);
    await page.locator('#tour-learn').click();
    await expect(page.locator('#tour-count')).not.toBeEmpty();
    for (const id of ['#learn-curve', '#learn-scrub', '#learn-figure figcaption']) {
      await expect(page.locator(id)).toBeInViewport({ ratio: 1 });
    }
    await expect(page.locator('#learn-words')).toBeHidden();
    const after = await placesOf(page, ids);
    after.forEach((place, i) => {
      expect(Math.abs(place!.top - before[i]!.top), ids[i]).toBeLessThanOrEqual(2);
    });
    await page.evaluate(() => upswing.learn.stop());
  });
}

test('the words about the ring leave after two seconds', async ({ stage: page }) => {
  await open(page, '#tour=3');
  const words = () => page.evaluate(() => upswing.scene.labels.map(({ text }) => text));
  await page.locator('#tour-learn').click();
  await expect.poll(words, { intervals: [50] }).toEqual(['expected points']);
  await expect.poll(words).toEqual([]);
  expect(await page.evaluate(() => upswing.learn.begun)).toBe(true);
  await page.evaluate(() => upswing.learn.stop());
});

test.describe('with fingers', () => {
  test.use({ viewport: { width: 844, height: 390 }, hasTouch: true, isMobile: true });
  test('each thumb has its arrow, and no words name keys', async ({ page }) => {
    await open(page, '#tour=2');
    for (const [width, height] of [
      [844, 390],
      [390, 664],
    ] as const) {
      await page.setViewportSize({ width, height });
      await drawn(page);
      const [left, right] = await placesOf(page, ['motor-left', 'motor-right']);
      for (const one of [left!, right!]) {
        expect(Math.min(one.right - one.left, one.bottom - one.top)).toBeGreaterThanOrEqual(56);
        expect(one.bottom).toBeLessThanOrEqual(height);
      }
      expect(left!.left).toBeLessThanOrEqual(16);
      expect(right!.right).toBeGreaterThanOrEqual(width - 16);
      await expect(page.locator('kbd:visible')).toHaveCount(0);
    }
  });
});
