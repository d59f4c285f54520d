import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { changed } from './file';
import { advance, balanced, open, run, test } from './page';
import { readPolicy } from './program';

/// An agent that goes to the pose that the visitor chooses.

const UP_DOWN = 'Upper link up, lower link down';
const DOWN_UP = 'Upper link down, lower link up';

const pose = (page: Page, name: string) => page.getByRole('button', { name, exact: true });

/// Expects both links to stand still, at these absolute angles (rad; 0 hanging).
async function expectRest(page: Page, [first, second]: [number, number]): Promise<void> {
  const { q1, q2, w1, w2 } = await page.evaluate(() => upswing.world.state);
  const lean = (angle: number, from: number) => Math.acos(Math.cos(angle - from));
  expect(lean(q1, first)).toBeLessThan(0.3);
  expect(lean(q1 + q2, second)).toBeLessThan(0.3);
  expect(Math.max(Math.abs(w1), Math.abs(w2))).toBeLessThan(0.3);
}

test('a visitor sends the pendulum from pose to pose', async ({ stage: page }) => {
  await open(page);
  const goals = page.getByRole('group', { name: 'Pose to reach' });
  await expect(goals).toBeHidden();
  await page.locator('#agent').selectOption('any-pose');
  await expect(goals).toBeVisible();
  await expect(page.locator('#agent-what')).toContainText('from any pose at rest to any other');
  await expect(pose(page, 'Both links up')).toHaveAttribute('aria-pressed', 'true');
  await page.getByRole('button', { name: 'Run the agent' }).click();
  await run(page, 8);
  await expectRest(page, [Math.PI, Math.PI]);
  await expect(page.locator('#badge')).toHaveText(/^balanced for/);

  await pose(page, UP_DOWN).click();
  await expect(pose(page, UP_DOWN)).toHaveAttribute('aria-pressed', 'true');
  await expect(pose(page, 'Both links up')).toHaveAttribute('aria-pressed', 'false');
  await expect(page).toHaveURL(/goal=up-down/);
  await advance(page, 8);
  await expectRest(page, [Math.PI, 0]);
  expect(await balanced(page)).toBeGreaterThan(3);
  await expect(page.locator('#badge')).toHaveText(/^in the pose for/);
  await expect(page.locator('#live')).toHaveText('in the pose');
  await expect(page.locator('#height-value')).toHaveText(/m, goal 0\.00 m$/);

  // With the keyboard, and again in the middle of the motion.
  await pose(page, 'Both links up').focus();
  await page.keyboard.press('Space');
  expect(await balanced(page)).toBe(0);
  await advance(page, 0.5);
  await page.keyboard.press('Tab');
  await page.keyboard.press('Tab');
  await page.keyboard.press('Enter');
  await expect(pose(page, DOWN_UP)).toHaveAttribute('aria-pressed', 'true');
  await advance(page, 10);
  await expectRest(page, [0, Math.PI]);
  expect(await balanced(page)).toBeGreaterThan(3);

  await page.locator('#agent').selectOption('d3qn');
  await expect(goals).toBeHidden();
  await expect(page).not.toHaveURL(/goal=/);
});

test('a link names the pose, and a policy of a visitor has the buttons, too', async ({
  stage: page,
}) => {
  await open(page, '#agent=any-pose&goal=down-up&on=1');
  await advance(page, 10);
  await expectRest(page, [0, Math.PI]);
  const file = changed(readPolicy('any-pose'), () => {});
  await page
    .locator('#file')
    .setInputFiles({ name: 'mine.safetensors', mimeType: '', buffer: Buffer.from(file) });
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#agent-what')).toContainText('A policy for any pose');
  await pose(page, UP_DOWN).click();
  await advance(page, 10);
  await expectRest(page, [Math.PI, 0]);
});
