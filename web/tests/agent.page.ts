import { expect } from '@playwright/test';
import type { QDecision } from '../src/decision';
import { advance, balanced, largestDifference, open, run, shift, startFrom, test } from './page';
import { policyPath, simulate } from './program';

test('the agent swings up and balances when it is switched on', async ({ stage: page }) => {
  await open(page);
  await expect(page.locator('#badge')).toHaveText('hanging');
  await page.getByRole('button', { name: 'Run the agent' }).click();
  await run(page, 8);
  await expect(page.locator('#badge')).toHaveText(/balanced for/);
  await expect(page.locator('#live')).toHaveText('balanced');
  await page.getByRole('button', { name: 'Run the agent' }).click(); // off: it falls
  await expect(page.locator('#badge')).toHaveText('swinging freely');
});

test('states and torques of the first 5 s equal `upswing simulate`', async ({ stage: page }) => {
  await open(page, '#agent=d3qn&on=1');
  await startFrom(page, 0);
  const rows = await run(page, 5);
  const expected = simulate(policyPath('d3qn'), '--seconds', '5');
  expect(rows.length).toBe(250);
  expect(largestDifference(rows, expected)).toBeLessThan(1e-6);
  expect(rows.map((row) => row[5])).toEqual(expected.slice(0, 250).map((row) => row[5]));
});

test('choosing another agent shows its text, curve and mark', async ({ stage: page }) => {
  await open(page);
  await expect(page.locator('#agent-what')).toContainText('the pendulum that it learned with');
  await page.locator('#agent').selectOption('d3qn-adaptive');
  await expect(page.locator('#agent-what')).toContainText('It learned on many pendulums');
  await expect(page.locator('#agent-text')).toContainText(
    'identifies its pendulum, trained on random pendulums',
  );
  await expect(page.locator('#agent-command')).toContainText('--agent d3qn-adaptive');
  const width = () =>
    page.locator('.slider:has(#mass1) .trained').evaluate((mark) => mark.clientWidth);
  const wide = await width();
  await page.locator('#agent').selectOption('d3qn');
  await expect.poll(width).toBeLessThan(wide / 2);
});

// src/agents.test.ts and src/world.test.ts check that each is up within 10 s and holds.
test('every agent can be chosen', async ({ stage: page }) => {
  await open(page);
  const [ids, chosen] = await page.evaluate(async () => {
    const ids = upswing.agents.list.map(({ id }) => id);
    const chosen: string[] = [];
    for (const id of ids) {
      const taken = await upswing.choose(id);
      if (taken) chosen.push(document.querySelector<HTMLSelectElement>('#agent')!.value);
    }
    return [ids, chosen];
  });
  expect(ids.length).toBeGreaterThan(3);
  expect(chosen).toEqual(ids);
});

test('a link brings controllers that were not learned', async ({ stage: page }) => {
  await open(page, '#agent=lqr&twin=mpc&on=1');
  await expect(page.locator('#agent-what')).toContainText('cannot swing them up');
  await expect(page.locator('#trained-on')).toHaveText('design plant');
  await expect(page.locator('#agent-command')).toHaveText('./upswing simulate lqr');
  await expect(page.locator('#twin-name')).toHaveText('MPC: always plans');
  await expect(page.locator('#q-name')).toHaveText('Decision');
  await expect(page.locator('#badge')).toHaveText('cannot swing up');
  await startFrom(page, 0);
  await advance(page, 8);
  expect(await balanced(page)).toBe(0);
  await expect(page.locator('#twin-badge')).toHaveText(/balanced for/);
  await startFrom(page, 3.13);
  await advance(page, 2);
  expect(await balanced(page)).toBe(2);
  await page.locator('#agent').selectOption('mpc');
  await page.locator('#map').scrollIntoViewIfNeeded();
  await expect(page.locator('#map-value')).toHaveText('not for one that plans');
  await expect(page).toHaveURL(/agent=mpc&twin=mpc/);
});

test('agents that come late or never disturb nothing', async ({ page }) => {
  await page.setViewportSize({ width: 844, height: 390 });
  await open(page);
  await page.waitForLoadState('networkidle');
  expect(await shift(page)).toBeLessThan(0.05);
  // A link with a slow agent does not disturb the link opened after it.
  let arrive = () => {};
  const late = new Promise<void>((resolve) => (arrive = resolve));
  await page.route(/(sac|dueling-dqn)\.safetensors$/, async (route) => {
    await late;
    await route.continue();
  });
  await page.evaluate(() => void upswing.open('#agent=sac'));
  await page.evaluate(() => upswing.open('#agent=d3qn'));
  await startFrom(page, 1.5);
  // The last of two requested agents counts.
  await page.locator('#agent').selectOption('dueling-dqn');
  await page.locator('#agent').selectOption('fast');
  const answers = ['sac', 'dueling-dqn'].map((id) => page.waitForResponse(`**/${id}.safetensors`));
  arrive();
  for (const answer of answers) await (await answer).finished();
  await page.evaluate(() =>
    Promise.all(['sac', 'dueling-dqn'].map((id) => upswing.agents.get(id))),
  );
  await expect(page.locator('#agent')).toHaveValue('fast');
  expect(await page.evaluate(() => upswing.world.policy!.controller.text)).toContain('8-48-32');
  expect(await page.evaluate(() => upswing.world.state.q1)).toBe(1.5);

  // A missing second agent is reported.
  await open(page, '#agent=fast&twin=none');
  await expect(page.locator('#message')).toContainText('unknown agent "none"');
  await page.route(/ppo\.safetensors$/, (route) => route.fulfill({ status: 200, body: 'broken' }));
  await page.getByLabel('Second agent').selectOption('ppo');
  await expect(page.locator('#message')).toContainText('Agent "ppo" cannot be used');
  await expect(page.locator('#twin-scene')).toBeHidden();
  await expect(page.getByLabel('Second agent')).toHaveValue('');
});

test('a posed pendulum is judged at once', async ({ stage: page }) => {
  await open(page, '#agent=d3qn');
  await startFrom(page, 0);
  const best = () => page.evaluate(() => Math.max(...(upswing.world.decision as QDecision).q));
  const hanging = await best();
  await expect(page.locator('#height-value')).toHaveText('−1.00 m of 1.00 m');
  await startFrom(page, Math.PI);
  expect(await best()).toBeGreaterThan(1.5 * hanging);
  await expect(page.locator('#height-value')).toHaveText('1.00 m of 1.00 m');
  await expect(page.locator('#energy')).toHaveAccessibleName('Energy: 9.81 J of 9.81 J');
  await expect(page.locator('#badge')).toHaveText('paused, upright');
});

/// The text of a preset for the default and the adaptive agent, depending on whether they balance.
const CLAIMS: Readonly<Record<string, string>> = {
  'no, no': 'neither balances',
  'no, yes': 'only the adaptive one balances',
  'yes, yes': 'both balance',
};

test('each agent does what the laboratory promises', async ({ stage: page }) => {
  await open(page);
  await expect(page.locator('#presets a').first()).toBeInViewport({ ratio: 1 });
  await expect(page.locator('#presets a')).toHaveCount(6);
  const tries = await page.locator('a[data-balances]').evaluateAll((links) =>
    links.map((link) => {
      const { balances, twinBalances } = (link as HTMLElement).dataset;
      const claim = link.querySelector('em')?.textContent;
      return { hash: link.getAttribute('href')!, balances, twinBalances, claim };
    }),
  );
  expect(tries.length).toBeGreaterThan(10);
  for (const { hash, balances, twinBalances, claim } of tries) {
    if (claim !== undefined) expect(claim, hash).toBe(CLAIMS[`${balances}, ${twinBalances}`]);
    await page.evaluate((link) => upswing.open(link), hash);
    await startFrom(page, 0);
    await advance(page, 20);
    const twin = await page.evaluate(
      () => upswing.world.twin && (upswing.world.twin.uprightFor ?? 0),
    );
    expect(twin === null, hash).toBe(twinBalances === undefined);
    for (const [held, promise] of [
      [await balanced(page), balances],
      [twin ?? 0, twinBalances],
    ] as const) {
      if (promise === 'yes') expect(held, hash).toBeGreaterThan(10);
      if (promise === 'no') expect(held, hash).toBeLessThan(5);
    }
  }
});
