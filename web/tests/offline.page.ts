import { expect } from '@playwright/test';
import { open, test } from './page';

/// The page without a network, after a visit with one.

test.use({ serviceWorkers: 'allow' });

test('after the first visit the page works offline, and online it is never an old one', async ({
  page,
  context,
}) => {
  // Left behind by an older page.
  await page.goto('./icon.svg');
  await page.evaluate(() => caches.open('upswing-older'));
  await page.goto('about:blank');
  await open(page, '#agent=d3qn');
  await page.waitForFunction(() => navigator.serviceWorker.controller?.state === 'activated');
  const kept = await page.evaluate(() => caches.keys());
  expect(kept).toEqual([expect.stringMatching(/^upswing-[0-9a-f]{16}$/)]);

  await context.setOffline(true);
  await page.reload();
  await expect(page.locator('#agent-on')).toBeEnabled();
  await page.waitForFunction(() => upswing.isComplete);
  await expect(page.locator('#agent')).toHaveValue('d3qn');
  await page.evaluate(() => (location.hash = '#learn=fast&seed=1'));
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  await page.evaluate(() => upswing.learn.stop());
  await page.evaluate(() => (location.hash = '#write'));
  await page.locator('#write-run').click();
  await page.waitForFunction(() => upswing.world.byHand !== 0);

  await context.setOffline(false);
  await page.evaluate(async (name) => {
    const cache = await caches.open(name);
    await cache.put('./', new Response('an older page'));
  }, kept[0]!);
  await page.reload();
  await expect(page.locator('#agent-on')).toBeEnabled();
});
