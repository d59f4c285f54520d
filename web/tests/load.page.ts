import { expect, test } from '@playwright/test';

test('the page loads MuJoCo and says nothing on the console', async ({ page }) => {
  const complaints: string[] = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) {
      complaints.push(`${message.text()} (${message.location().url})`);
    }
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  page.on('requestfailed', (request) => complaints.push(`failed: ${request.url()}`));
  const wasm = page.waitForResponse(/\.wasm$/);
  await page.goto('./');
  expect((await wasm).headers()['content-type']).toBe('application/wasm');
  await expect(page.locator('body')).toContainText(/\S/);
  await page.waitForLoadState('networkidle');
  expect(complaints).toEqual([]);
});
