import { expect } from '@playwright/test';
import { open, shift, test } from './page';

/// The page on a phone, with fingers.

test.use({ viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true });

test('on a phone nothing moves while the page loads, and fingers drag, scroll and tap', async ({
  page,
}) => {
  await open(page);
  await page.waitForLoadState('networkidle');
  expect(await shift(page)).toBeLessThan(0.05);
  const widths = await page.evaluate(() => [document.body.scrollWidth, innerWidth]);
  expect(widths[0]).toBeLessThanOrEqual(widths[1]!);

  // A finger on the pendulum does not scroll, one next to it does.
  const prevented = () =>
    page.evaluate(() => {
      const canvas = document.getElementById('scene')!;
      const { left, top, width, height } = canvas.getBoundingClientRect();
      return [0, 0.45 * width].map((aside) => {
        const touch = new Touch({
          identifier: 1,
          target: canvas,
          clientX: left + width / 2 + aside,
          clientY: top + height / 2 + 60,
        });
        const event = new TouchEvent('touchstart', { changedTouches: [touch], cancelable: true });
        return !canvas.dispatchEvent(event);
      });
    });
  // On a slow machine the canvas changes its size even after the page is ready.
  await expect.poll(prevented).toEqual([true, false]);

  await page.locator('#agent-on').tap();
  await expect(page.locator('#badge')).toHaveText(/swinging up|balanced/);

  // A swipe over a slider scrolls and changes nothing.
  const slider = page.locator('#gravity');
  await slider.scrollIntoViewIfNeeded();
  const { x, y, width } = (await slider.boundingBox())!;
  const session = await page.context().newCDPSession(page);
  const before = await page.evaluate(() => scrollY);
  const touch = (type: 'touchStart' | 'touchMove', moved: number) =>
    session.send('Input.dispatchTouchEvent', {
      type,
      touchPoints: [{ x: x + 0.9 * width, y: y + 5 - moved }],
    });
  await touch('touchStart', 0);
  for (let moved = 12; moved < 150; moved += 12) await touch('touchMove', moved);
  await session.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await expect.poll(() => page.evaluate(() => scrollY)).toBeGreaterThan(before + 50);
  await expect(slider).toHaveValue('9.81');
});
