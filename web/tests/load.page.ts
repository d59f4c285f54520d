import { expect } from '@playwright/test';
import { gzipSync } from 'node:zlib';
import { open, test } from './page';

test('the page loads and asks nobody else', async ({ page }) => {
  const hosts = new Set<string>();
  page.on('request', (request) => hosts.add(new URL(request.url()).host));
  const wasm = page.waitForResponse(/\.wasm$/);
  await open(page);
  expect((await wasm).headers()['content-type']).toBe('application/wasm');
  await page.waitForLoadState('networkidle');
  expect([...hosts]).toEqual([new URL(page.url()).host]);
  await expect(page.locator('#loading')).toBeHidden();
});

test('the first load is at most 2 MB compressed', async ({ page }) => {
  const bodies: Promise<Buffer>[] = [];
  page.on('response', (response) => bodies.push(response.body()));
  await open(page);
  await page.waitForLoadState('networkidle');
  const sizes = (await Promise.all(bodies)).map((body) => gzipSync(body).length);
  expect(sizes.length).toBeGreaterThan(4);
  expect(sizes.reduce((sum, size) => sum + size, 0)).toBeLessThan(2e6);
});

test.describe('what the policy of the page forbids', () => {
  test.use({ complains: true });
  test('text is never run as code', async ({ page }) => {
    await open(page);
    const refused = await page.evaluate(async () => {
      const blocked: string[] = [];
      addEventListener('securitypolicyviolation', (event) => blocked.push(event.blockedURI));
      setTimeout('globalThis.ran = true');
      document.body.insertAdjacentHTML(
        'beforeend',
        '<img src="none" onerror="globalThis.ran = true">',
      );
      const script = document.createElement('script');
      script.src = 'https://example.com/script.js';
      document.body.append(script);
      await new Promise((resolve) => setTimeout(resolve, 300));
      return { ran: 'ran' in globalThis, blocked: blocked.sort() };
    });
    expect(refused).toEqual({
      ran: false,
      blocked: ['eval', 'https://example.com/script.js', 'inline'],
    });
  });
});

test.describe('what is missing or broken is told', () => {
  test.use({ complains: true });

  test('a browser without WebAssembly is told so', async ({ page }) => {
    await page.addInitScript(() => Reflect.deleteProperty(globalThis, 'WebAssembly'));
    await page.goto('./');
    await expect(page.locator('#message')).toContainText('no WebAssembly');
    await expect(page.locator('#agent-on')).toBeDisabled();
  });

  for (const [what, pattern] of [
    ['MuJoCo', /\.wasm$/],
    ['the list of agents', /agents\.json$/],
    ['a policy', /\.safetensors$/],
  ] as const) {
    test(what, async ({ page }) => {
      await page.route(pattern, (route) => route.fulfill({ status: 200, body: 'broken' }));
      await page.goto('./');
      await expect(page.locator('#message')).toContainText(/could not start|cannot be used/);
      await page.unroute(pattern);
      await page.route(pattern, (route) => route.abort());
      await page.goto('about:blank');
      await page.goto('./');
      await expect(page.locator('#message')).toContainText(/could not start|cannot be used/);
    });
  }
});
