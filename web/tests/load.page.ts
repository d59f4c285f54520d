import { expect } from '@playwright/test';
import type { Page, Response } from '@playwright/test';
import { gzipSync } from 'node:zlib';
import { open, shift, test } from './page';

for (const { view, hash, most } of [
  { view: 'a new visitor', hash: '', most: 1.85e6 },
  { view: 'everything, with the large agent,', hash: '#everything', most: 2.34e6 },
]) {
  test(`${view} loads at most ${most / 1e6} MB compressed from one host, and nothing moves`, async ({
    page,
  }) => {
    await page.setViewportSize({ width: 1440, height: 900 });
    const responses: Response[] = [];
    page.on('response', (response) => responses.push(response));
    const hosts = new Set<string>();
    page.on('request', (request) => hosts.add(new URL(request.url()).host));
    const wasm = page.waitForResponse(/\.wasm$/);
    await open(page, hash);
    expect((await wasm).headers()['content-type']).toBe('application/wasm');
    await page.waitForLoadState('networkidle');
    expect([...hosts]).toEqual([new URL(page.url()).host]);
    await expect(page.locator('#loading')).toBeHidden();
    const bodies = await Promise.all(responses.map((response) => response.body()));
    const sizes = bodies.map((body) => gzipSync(body).length);
    expect(sizes.length).toBeGreaterThan(4);
    expect(sizes.reduce((sum, size) => sum + size, 0)).toBeLessThan(most);
    expect(await shift(page)).toBeLessThan(0.05);
  });
}

test('every preloaded font is shown, and loads once', async ({ page }) => {
  await open(page);
  const fonts = await page.evaluate(async () => {
    await document.fonts.ready;
    const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
    const faces = rules.filter((rule) => rule instanceof CSSFontFaceRule).map(({ style }) => style);
    return [...document.querySelectorAll<HTMLLinkElement>('link[rel="preload"]')].map(
      ({ href }) => {
        const face = faces.find((face) =>
          face.getPropertyValue('src').includes(new URL(href).pathname),
        );
        const family = face?.getPropertyValue('font-family').replaceAll('"', '');
        return {
          shown: [...document.fonts].find((font) => font.family === family)?.status,
          loads: performance.getEntriesByName(href).length,
        };
      },
    );
  });
  expect(fonts).toEqual(fonts.map(() => ({ shown: 'loaded', loads: 1 })));
  expect(fonts.length).toBeGreaterThan(0);
});

test.describe("limits of the page's content security policy", () => {
  test.use({ complains: true });
  test('text is never run as code', async ({ stage: page }) => {
    await open(page);
    const refused = await page.evaluate(async () => {
      const blocked: string[] = [];
      addEventListener('securitypolicyviolation', (event) => blocked.push(event.blockedURI));
      setTimeout('globalThis.ran = true');
      const place = document.body.appendChild(document.createElement('div'));
      place.innerHTML = '<img src="none" onerror="globalThis.ran = true">';
      const script = document.createElement('script');
      script.src = 'https://example.com/script.js';
      place.append(script);
      await new Promise((resolve) => setTimeout(resolve, 300));
      place.remove();
      return { ran: 'ran' in globalThis, blocked: blocked.sort() };
    });
    expect(refused).toEqual({
      ran: false,
      blocked: ['eval', 'https://example.com/script.js', 'inline'],
    });
  });
});

test.describe('missing or broken parts are reported', () => {
  test.use({ complains: true });

  /// The page shows the reason instead of its loading text.
  async function expectProblem(page: Page, words: string | RegExp): Promise<void> {
    await expect(page.locator('#problem')).toContainText(words);
    await expect(page.locator('#loading')).toBeHidden();
    await expect(page.locator('#badge')).toBeHidden();
    await expect(page.locator('#agent-on')).toBeDisabled();
  }

  test('a browser without WebAssembly gets a message', async ({ page }) => {
    await page.addInitScript(() => Reflect.deleteProperty(globalThis, 'WebAssembly'));
    await page.goto('./#everything');
    await expectProblem(page, 'no WebAssembly');
  });

  for (const [what, pattern, name] of [
    ['MuJoCo', /\.wasm$/, '.wasm'],
    ['the list of agents', /agents\.json$/, 'agents/agents.json'],
  ] as const) {
    test(what, async ({ page }) => {
      await page.route(pattern, (route) => route.fulfill({ status: 200, body: 'broken' }));
      await page.goto('./#everything');
      await expectProblem(page, 'could not start');
      for (const [answer, words] of [
        [{ status: 404 }, 'is missing'],
        [{ status: 500 }, 'the server says 500'],
        [null, 'cannot be fetched'],
      ] as const) {
        await page.unroute(pattern);
        await page.route(pattern, (route) => (answer ? route.fulfill(answer) : route.abort()));
        await page.reload();
        await expectProblem(page, words);
        await expectProblem(page, name);
      }
    });
  }

  test('without a policy the page runs, and offers the others', async ({ page }) => {
    const message = page.locator('#message');
    await page.route(/d3qn\.safetensors$/, (route) =>
      route.fulfill({ status: 200, body: 'broken' }),
    );
    await page.goto('./#everything');
    await expect(message).toContainText('Agent "d3qn" cannot be used');
    await expect(message).toContainText('not a valid safetensors file');
    await expect(page.locator('#agent-what')).toContainText('could not be loaded');
    await expect(page.locator('#badge')).toHaveText('hanging');
    await expect(page.locator('#agent-on')).toBeDisabled();
    for (const [answer, words] of [
      [{ status: 404 }, 'agents/dqn.safetensors is missing'],
      [null, 'cannot be fetched'],
    ] as const) {
      await page.unrouteAll();
      await page.route(/\bdqn\.safetensors$/, (route) =>
        answer ? route.fulfill(answer) : route.abort(),
      );
      await page.locator('#agent').selectOption('dqn');
      await expect(message).toContainText('Agent "dqn" cannot be used');
      await expect(message).toContainText(words);
      await expect(page.locator('#agent-on')).toBeDisabled();
    }
    await page.locator('#agent').selectOption('fast');
    await expect(page.locator('#agent-on')).toBeEnabled();
    await expect(page.locator('#agent-text')).toContainText('8-48-32');
    await expect(message).toBeHidden();
  });

  test('without MuJoCo the page uses its own physics, and says so', async ({ page }) => {
    await page.route(/mujoco.*\.wasm$/, (route) => route.fulfill({ status: 404 }));
    await page.goto('./#agent=fast&on=1');
    await expect(page.locator('#message')).toContainText('MuJoCo could not start');
    await expect(page.locator('#message')).toContainText('.wasm is missing');
    await expect(page.locator('#problem')).toBeHidden();
    await expect(page.locator('#badge')).toHaveText(/balanced for/);
  });

  for (const what of ['missing', 'no answer'] as const) {
    test(`the script itself: ${what}`, async ({ page }) => {
      await page.route(/assets\/index-.*\.js$/, (route) =>
        what === 'missing' ? route.fulfill({ status: 404 }) : route.abort(),
      );
      await page.goto('./#everything');
      await expectProblem(page, /its script .*index-.*\.js, or a part of it, is missing/);
    });
  }

  test('a script that the browser cannot read', async ({ page }) => {
    await page.route(/assets\/index-.*\.js$/, (route) =>
      route.fulfill({ contentType: 'text/javascript', body: 'let let = ?;' }),
    );
    await page.goto('./#everything');
    await expectProblem(page, 'does not understand its script');
  });

  test('without any script a sentence appears after a while', async ({ page }) => {
    await page.route(/\.js$/, (route) => route.abort());
    await page.goto('./#everything');
    const slow = page.locator('#slow');
    await expect(slow).toBeHidden();
    await page.evaluate(() => {
      for (const animation of document.getAnimations()) animation.finish();
    });
    await expect(slow).toBeVisible();
    await expect(slow).toContainText('a part of the page is missing');
  });

  test('a server that falls silent', async ({ page }) => {
    await page.clock.install();
    await page.route(/\.wasm$/, () => {}); // never answers
    const asked = page.waitForRequest(/\.wasm$/);
    await page.goto('./', { waitUntil: 'commit' });
    await asked;
    await expect(page.locator('#loading')).toBeVisible();
    await page.clock.fastForward(15_000);
    await expect(page.locator('#loading')).toBeVisible();
    await page.clock.fastForward(16_000);
    await expectProblem(page, 'nothing arrived for 30 s');
  });

  test('JavaScript is switched off', async ({ browser }) => {
    const context = await browser.newContext({ javaScriptEnabled: false });
    const page = await context.newPage();
    await page.goto('./#everything');
    await expect(page.locator('noscript p')).toBeVisible();
    for (const id of ['loading', 'badge', 'buttons', 'agent']) {
      await expect(page.locator(`#${id}`)).toBeHidden();
    }
    await context.close();
  });
});
