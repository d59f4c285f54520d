import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import type { AxeResults } from 'axe-core';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { open, test } from './page';

/// Checks axe-core's rules of WCAG 2.2 AA and good practice in each theme and view.

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/// The problems that axe finds in the page, by all its rules or only those of colour.
async function violations(page: Page, rules: 'all' | 'colours'): Promise<string[]> {
  return page.evaluate(async (rules) => {
    const { axe: checker } = globalThis as never as {
      axe: { run: (context: object, options: object) => Promise<AxeResults> };
    };
    const colours = rules === 'colours';
    // Symbols of formulas have the colour of the text.
    const context = { include: ['html'], exclude: colours ? ['math *'] : [] };
    const found = await checker.run(context, {
      resultTypes: ['violations'],
      ...(colours && { runOnly: ['cat.color'] }),
    });
    return found.violations.flatMap(({ id, nodes }) =>
      nodes.map(({ html, failureSummary }) => `${id}: ${html.slice(0, 120)} ${failureSummary}`),
    );
  }, rules);
}

// A theme changes only colours.
const THEMES = [
  ['light', { colorScheme: 'light', forcedColors: 'none' }, 'all'],
  ['dark', { colorScheme: 'dark', forcedColors: 'none' }, 'colours'],
  ['forced colours', { colorScheme: 'light', forcedColors: 'active' }, 'colours'],
] as const;

async function expectNone(page: Page, what: string): Promise<void> {
  for (const [theme, media, rules] of THEMES) {
    await page.emulateMedia(media);
    expect(await violations(page, rules), `${what}, ${theme}`).toEqual([]);
  }
}

test('axe finds no problem in any step of the tour or in everything, in any theme', async ({
  page,
}) => {
  await open(page, '#tour=3'); // which shows the curve
  // Drawings do not matter here.
  await page.evaluate(() => (upswing.scene.draw = upswing.twin.scene.draw = () => {}));
  await page.evaluate(axe);
  // All steps below each other, as without scripts.
  await page.evaluate(() => {
    document.getElementById('steps')!.style.display = 'block';
    for (const step of document.querySelectorAll<HTMLElement>('.step')) step.inert = false;
  });
  await expectNone(page, 'the tour');
  await open(page, '#learn');
  await page.locator('#learn-options > summary').click();
  await page.getByLabel('four seeds at once').check();
  await page.evaluate(() => {
    document.getElementById('learn-start')!.click();
    upswing.learn.stop();
  });
  await expect(page.getByRole('radio', { name: /seed/ })).toHaveCount(4);
  await expectNone(page, 'learn');
  await open(page, '#write=cmV0dXJu');
  await page.evaluate(() => {
    for (const details of document.querySelectorAll('details')) details.open = true;
    document.getElementById('write-table')!.hidden = false;
  });
  await page.locator('#write-run').click();
  await expect(page.locator('#write-problem')).not.toBeEmpty();
  await expectNone(page, 'write');
  await page.getByRole('link', { name: 'Everything', exact: true }).click();
  await page.locator('#agent').selectOption('any-pose'); // with buttons for its goal
  await expect(page.locator('#goals')).toBeVisible();
  await page.evaluate(async () => {
    for (const details of document.querySelectorAll('details')) details.open = true;
    await globalThis.drawn(); // then formulas that are too wide can be focused
  });
  await expectNone(page, 'everything');
  await page.setViewportSize({ width: 320, height: 256 }); // 1280 × 1024 at 400%
  await page.locator('#pause').click(); // shows the sliders of a paused pendulum
  await page.emulateMedia(THEMES[0][1]);
  expect(await violations(page, 'all'), 'paused, at 400%').toEqual([]);
});

test('at 400% the tour scrolls down, not sideways, and all of it can be reached', async ({
  stage: page,
}) => {
  await page.setViewportSize({ width: 320, height: 256 });
  await open(page, '#tour');
  const steps = await page.locator('.step').count();
  for (let step = 1; step <= steps; ++step) {
    if (step > 1) await page.locator('#tour-next').click();
    const { hidden, width, dot } = await page.evaluate(async () => {
      const now = '.step:not([inert])';
      const texts = document.querySelectorAll(
        ['h2', 'p:not(:empty):not(.answer)', 'fieldset'].map((one) => `${now} ${one}`).join(),
      );
      const hidden: string[] = [];
      for (const one of texts) {
        if (!one.checkVisibility()) continue;
        one.scrollIntoView({ block: 'nearest', behavior: 'instant' });
        const share = await new Promise<number>((resolve) => {
          const observer = new IntersectionObserver(([entry]) => {
            observer.disconnect();
            resolve(entry!.intersectionRatio);
          });
          observer.observe(one);
        });
        if (share < 0.9) hidden.push(`${share} of ${one.textContent}`);
      }
      const sizes = [
        ...document.querySelectorAll('#tour-buttons > :is(button, select):not([hidden])'),
      ].map((one) => {
        const { width, height } = one.getBoundingClientRect();
        return one.checkVisibility() ? Math.min(width, height) : Infinity;
      });
      return { hidden, width: document.documentElement.scrollWidth, dot: Math.min(...sizes) };
    });
    expect(hidden, `step ${step}`).toEqual([]);
    expect(width, `step ${step}`).toBeLessThanOrEqual(320);
    expect(dot, `step ${step}`).toBeGreaterThanOrEqual(24); // large enough for a finger
  }
});
