import { expect } from '@playwright/test';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { test } from './page';
import { policyPath, runProgram } from './program';

/// The page as one file, as `./upswing demo --file` writes it.

test('one file holds the page: without a server or a network it balances, and it learns', async ({
  page,
  context,
}) => {
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  try {
    const file = join(folder, 'my page.html');
    expect(runProgram('demo', policyPath('fast'), '--file', file)).toContain('my page.html');
    await context.setOffline(true);
    const asked: string[] = [];
    page.on('request', (request) => asked.push(new URL(request.url()).protocol));
    await page.goto(`${pathToFileURL(file).href}#agent=d3qn&on=1`);
    await expect(page.locator('#agent-on')).toBeEnabled();
    await page.waitForFunction(() => upswing.isComplete);
    const upright = await page.evaluate(() => {
      for (let k = 0; k < 200 * 15; ++k) upswing.world.advance();
      return upswing.world.uprightFor;
    });
    expect(upright).toBeGreaterThan(5);
    await page.evaluate(() => (location.hash = '#learn=fast&seed=1'));
    await expect(page.locator('#learn-updates')).not.toHaveText('0');
    await page.evaluate(() => upswing.learn.stop());
    await page.getByRole('button', { name: 'How the default agent learned' }).click();
    await page.locator('#learn-scrub').fill('0');
    await expect(page.locator('#learn-where')).toHaveText('on the stage: after 0 steps');
    expect(asked.filter((one) => !['file:', 'blob:', 'data:'].includes(one))).toEqual([]);
  } finally {
    rmSync(folder, { recursive: true });
  }
});
