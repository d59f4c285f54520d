import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, test } from './page';

/// A visitor's reward as an expression.

const problem = (page: Page) => page.locator('#reward-problem');
const terms = (page: Page) => page.locator('#reward-terms');

async function openReward(page: Page): Promise<void> {
  await open(page, '#learn');
  await page.locator('#learn-options > summary').click();
  const details = page.locator('#reward-details');
  const missing = await details.evaluate((found) => (found as HTMLElement).hidden);
  test.skip(Boolean(missing), 'the core has no setting reward');
  await details.locator('summary').click();
}

test('a reward is learned at once, and its terms are drawn', async ({ stage: page }) => {
  await openReward(page);
  await page.locator('#learn-slow').uncheck();
  await page.locator('#reward-text').fill('high: h;\neffort: -0.1*abs(tau)');
  await page.locator('#reward-learn').click();
  await expect(page).toHaveURL(/reward=high%3A\+h%3B\+effort%3A/);
  await expect(terms(page)).toBeVisible();
  const label = /^Reward per step of each term: high \d\.\d\d, effort −\d\.\d\d$/;
  await expect.poll(() => terms(page).evaluate(({ ariaLabel }) => ariaLabel)).toMatch(label);
  await page.evaluate(() => upswing.learn.stop());
  await page.locator('#reward-reset').click();
  await expect(page.locator('#reward-text')).toHaveValue(/^energy: E;\nheight: h;/);
  await page.locator('#learn-slow').check();
});

test('a wrong expression gets one line, and a link shows and learns its reward', async ({
  stage: page,
}) => {
  await openReward(page);
  await page.locator('#learn-slow').uncheck();
  await page.locator('#reward-text').fill('E + w3');
  await page.locator('#reward-learn').click();
  await expect(problem(page)).toHaveText(/^reward: term1: expected a known name, got "w3"/);
  await open(page, '#learn=fast&seed=1&reward=up%3A+h');
  await expect(page.locator('#reward-text')).toHaveValue('up: h');
  await expect(problem(page)).toHaveText('');
  await expect(terms(page)).toHaveAttribute('aria-label', /up /);
  await page.locator('#learn-slow').check();
});
