import { expect } from '@playwright/test';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { Core } from '../src/core';
import { Learner } from '../src/learn/learner';
import type { Session } from '../src/learn/session';
import { coreModule } from './core';
import { firefox, inFirefox } from './firefox.mjs';
import { test } from './page';
import { policyPath, runProgram } from './program';

/// The page as one file, as `./upswing demo --file` writes it.

const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
const file = join(folder, 'my page.html');
const address = pathToFileURL(file).href;
test.beforeAll(() => {
  expect(runProgram('demo', policyPath('fast'), '--file', file)).toContain('my page.html');
});
test.afterAll(() => rmSync(folder, { recursive: true }));

test('one file holds the page: without a server or a network it balances, and it learns', async ({
  page,
  context,
}) => {
  await context.setOffline(true);
  const asked: string[] = [];
  page.on('request', (request) => asked.push(new URL(request.url()).protocol));
  await page.goto(`${address}#agent=d3qn&on=1`);
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
  await page.locator('#learn-options > summary').click();
  await page.getByRole('button', { name: 'How the default agent learned' }).click();
  await page.locator('#learn-scrub').fill('0');
  await expect(page.locator('#learn-where')).toHaveText('on the stage: after 0 steps');
  // A visitor's controller has its sandbox, too.
  await page.evaluate(() => (location.hash = '#write'));
  await page.locator('#write-run').click();
  await expect.poll(() => page.evaluate(() => Math.abs(upswing.world.byHand))).toBe(5);
  expect(asked.filter((one) => !['file:', 'blob:', 'data:'].includes(one))).toEqual([]);
});

/// Runs in the page: the policy after some steps of the address's training, its numbers in a text.
async function learned(): Promise<string> {
  const wait = () => new Promise((resolve) => setTimeout(resolve, 100));
  while (!(globalThis as { upswing?: object }).upswing) await wait();
  const { learn } = upswing as never as { learn: { session: Session | null; stop(): void } };
  for (;;) {
    learn.session?.hurry();
    const found = learn.session?.checkpoints.find(({ step }) => step === 6144);
    if (found) {
      learn.stop();
      return Array.from(new Uint8Array(found.file as ArrayBuffer)).join();
    }
    await wait();
  }
}

test('in Firefox it learns the same bits as in Node', async () => {
  test.skip(!firefox, 'no Firefox (UPSWING_FIREFOX, or one on the PATH)');
  const learner = new Learner(await Core.start(await coreModule()), 'fast', 1);
  learner.run(192);
  expect(learner.report()).toMatchObject({ steps: 6144, updates: 227 });
  const there = await inFirefox(`${address}#learn=fast&seed=1`, learned);
  expect(there).toBe(Array.from(new Uint8Array(learner.policy())).join());
});
