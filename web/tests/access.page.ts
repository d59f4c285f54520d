import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import type { AxeResults } from 'axe-core';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { test } from './page';

/// The rules of WCAG 2.2 AA and good practice that axe-core can check, in each theme and view.

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/// What axe finds in a part of the page, each with where it is: by all rules, or by those of colour.
async function violations(page: Page, rules: 'all' | 'colours', part = 'html'): Promise<string[]> {
  await page.evaluate(axe);
  return page.evaluate(
    async ({ rules, part }) => {
      const { axe: checker } = globalThis as never as {
        axe: { run: (context: string, options: object) => Promise<AxeResults> };
      };
      const found = await checker.run(part, {
        resultTypes: ['violations'],
        ...(rules === 'colours' && { runOnly: ['cat.color'] }),
      });
      return found.violations.flatMap(({ id, nodes }) =>
        nodes.map(({ html, failureSummary }) => `${id}: ${html.slice(0, 120)} ${failureSummary}`),
      );
    },
    { rules, part },
  );
}

const ready = (page: Page) => expect(page.locator('fieldset:disabled')).toHaveCount(0);

// A theme changes nothing but colours.
for (const [name, media, rules] of [
  ['light', { colorScheme: 'light' }, 'all'],
  ['dark', { colorScheme: 'dark' }, 'colours'],
  ['forced colours', { forcedColors: 'active' }, 'colours'],
] as const) {
  test(`${name}: axe finds nothing in any step of the tour, nor in everything`, async ({
    page,
  }) => {
    await page.emulateMedia(media);
    await page.goto('./#tour');
    await ready(page);
    const steps = await page.locator('.step').count();
    for (let step = 1; step <= steps; ++step) {
      if (step > 1) await page.locator('#tour-next').click();
      const part = step === 1 ? 'html' : '.step:not([inert])'; // what else is there stays
      expect(await violations(page, rules, part), `step ${step}`).toEqual([]);
    }
    await page.goto('./#learn');
    await page.getByLabel('four seeds at once').check();
    await page.getByRole('button', { name: 'Learn', exact: true }).click();
    await expect(page.locator('#learn-updates')).not.toHaveText('0');
    await page.locator('#learn-start').click();
    expect(await violations(page, rules), 'learn').toEqual([]);
    await page.getByRole('link', { name: 'Everything', exact: true }).click();
    await page.evaluate(async () => {
      for (const details of document.querySelectorAll('details')) details.open = true;
      // Formulas that are too wide can then be focused, a frame later.
      for (let k = 0; k < 3; ++k) await new Promise(requestAnimationFrame);
    });
    expect(await violations(page, rules)).toEqual([]);
    await page.setViewportSize({ width: 320, height: 256 }); // 1280 × 1024 at 400%
    await page.locator('#pause').click(); // with the sliders of a paused pendulum
    expect(await violations(page, rules)).toEqual([]);
  });
}

test('at 400% the tour goes down, not sideways, and all of it can be reached', async ({ page }) => {
  await page.setViewportSize({ width: 320, height: 256 });
  await page.goto('./#tour');
  await ready(page);
  const steps = await page.locator('.step').count();
  for (let step = 1; step <= steps; ++step) {
    if (step > 1) await page.locator('#tour-next').click();
    const now = page.locator('.step:not([inert])');
    for (const one of await now.locator('h2, p:not(:empty), fieldset').all()) {
      await one.scrollIntoViewIfNeeded();
      await expect(one).toBeInViewport({ ratio: 0.9 });
    }
    expect(
      await page.evaluate(() => document.documentElement.scrollWidth),
      `step ${step}`,
    ).toBeLessThanOrEqual(320);
  }
});
