import { expect } from '@playwright/test';
import { onScreen, open, startFrom, test } from './page';

/// Typefaces, numbers, nouns, and the page's card on other sites.

test('the page uses its own two typefaces, with their licence next to them', async ({
  stage: page,
}) => {
  await open(page);
  const loaded = await page.evaluate(async () => {
    await document.fonts.ready;
    return [...document.fonts].filter(({ status }) => status === 'loaded').map((f) => f.family);
  });
  expect(loaded.map((name) => name.replaceAll('"', ''))).toEqual(
    expect.arrayContaining(['Hanken Grotesk', 'Bricolage Grotesque']),
  );
  const licence = await page.request.get('./fonts/OFL.txt');
  expect(await licence.text()).toContain('SIL Open Font License, Version 1.1');
});

test('a negative number has a true minus sign', async ({ stage: page }) => {
  await open(page);
  await startFrom(page, 0, -0.5, -2, 0);
  await expect(page.locator('output[for=pose-q2]')).toHaveText('−29°');
  await expect(page.locator('output[for=pose-w1]')).toHaveText('−2 rad/s');
  await expect(page.locator('#height-value')).toHaveText(/^−0\.\d\d m of/);
  await page.evaluate(() => upswing.world.reset({ q1: 0, q2: 0, w1: 0, w2: 0 }));
  await expect(page.locator('#energy-value')).toHaveText('−9.81 J of 9.81 J');
});

test('a noun lights its thing, under a mouse and from a tap to the next', async ({
  stage: page,
}) => {
  await open(page);
  const lit = () => page.evaluate(() => upswing.scene.lit);
  await page.evaluate(
    () => (document.querySelector<HTMLDetailsElement>('#explain > details')!.open = true),
  );
  const noun = page.locator('#explain .noun[data-thing=motor]');
  await noun.hover();
  await expect.poll(lit).toBe('motor');
  await page.mouse.move(1, 1);
  await expect.poll(lit).toBeNull();
  await noun.dispatchEvent('pointerdown', { pointerType: 'touch' });
  await expect.poll(lit).toBe('motor');
  const { x, y } = await onScreen(page, 0.9, 0.9);
  await page.mouse.click(Math.max(x, 1), Math.max(y, 1));
  await expect.poll(lit).toBeNull();
  const colors = await page
    .locator('#explain .noun')
    .evaluateAll((nouns) => nouns.map((one) => getComputedStyle(one).color));
  expect(new Set(colors).size).toBe(4);
});

test("the page's card is 1200 × 630, at most 150 kB", async ({ stage: page }) => {
  await open(page);
  const card = page.locator('meta[property="og:image"]');
  const response = await page.request.get((await card.getAttribute('content'))!);
  const bytes = await response.body();
  expect(bytes.length).toBeLessThan(150_000);
  expect([bytes.readUInt32BE(16), bytes.readUInt32BE(20)]).toEqual([1200, 630]);
  await expect(page.locator('meta[name="twitter:card"]')).toHaveAttribute(
    'content',
    'summary_large_image',
  );
  await expect(page.locator('footer')).toContainText('Sangil Lee');
});
