import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { advance, balanced, open, run, test } from './page';
import { readPolicy } from './program';

/// The guided tour: how a visitor comes to it and leaves it, and that what it says is so.

// The numbers of steps.
const SHOVE = 4;

/// Opens the page as a new visitor does, or at a step of the tour.
async function visit(page: Page, hash = ''): Promise<void> {
  await open(page, hash);
}

const heading = (page: Page) => page.locator('.step:not([inert]) h2');
const answer = (page: Page) => page.locator('.step:not([inert]) .answer');

/// At a step, with time standing still, so that only run() advances it.
async function stopAt(page: Page, step: number): Promise<void> {
  await visit(page, `#tour=${step}`);
  await page.evaluate(() => {
    upswing.clock.advance = () => true;
  });
}

/// From hanging or from where it is, so many seconds; how long it was upright at the end without a break.
async function held(page: Page, seconds: number): Promise<number> {
  await advance(page, seconds);
  return balanced(page);
}

test('a new visitor gets the tour, which begins by itself with a swing-up', async ({ page }) => {
  await visit(page);
  await expect(heading(page)).toHaveText('Two links, one motor');
  await expect(page.locator('#charts')).toBeHidden();
  await expect(page.locator('#badge')).toHaveText(/balanced/);
  await expect(answer(page)).toContainText('Balanced');
});

test('nothing moves by itself where motion is not wanted', async ({ stage: page }) => {
  await page.emulateMedia({ reducedMotion: 'reduce' });
  await visit(page);
  await run(page, 1);
  expect(await page.evaluate(() => upswing.world.state)).toEqual({ q1: 0, q2: 0, w1: 0, w2: 0 });
  await page.getByRole('button', { name: 'Swing up' }).click();
  await expect(page.locator('#badge')).toHaveText(/swinging up|balanced/);
});

test('from step to step, by buttons, numbers and address, and back', async ({ stage: page }) => {
  await visit(page);
  const steps = await page.locator('.step h2').allTextContents();
  for (const title of steps.slice(1)) {
    await page.getByRole('button', { name: 'Next' }).click();
    await expect(heading(page)).toHaveText(title);
    await expect(heading(page)).toBeFocused();
  }
  // On the keyboard's way the numbers come last.
  await page.locator('#tour-end').focus();
  await page.keyboard.press('Tab');
  await expect(page.locator('#dots button').first()).toBeFocused();
  await expect(page).toHaveURL(new RegExp(`#tour=${steps.length}$`));
  await page.reload();
  await expect(heading(page)).toHaveText(steps.at(-1)!);
  await page.getByRole('button', { name: 'Back' }).click();
  await expect(heading(page)).toHaveText(steps.at(-2)!);
  await page.goBack(); // of the browser
  await expect(heading(page)).toHaveText(steps.at(-1)!);
  await page.getByRole('button', { name: 'Step 1:' }).click();
  await expect(heading(page)).toHaveText(steps[0]!);
  for (const hash of ['#tour', '#tour=-3', '#tour=none', '#tour=1e9', '#tour=2.4']) {
    await visit(page, hash);
    await expect(heading(page)).toHaveCount(1);
    await expect(page.locator('#message')).toBeHidden();
  }
});

test('a link with settings shows everything, and who chose a view finds it again', async ({
  stage: page,
}) => {
  await page.goto('./#agent=fast&mass2=1.2');
  await expect(page.locator('#agent')).toHaveValue('fast');
  await expect(page.locator('#tour')).toBeHidden();
  const comeBack = async () => {
    await page.goto('about:blank');
    await page.goto('./');
    await expect(page.locator('fieldset:disabled')).toHaveCount(0);
  };
  await comeBack(); // a link of somebody else's is no choice
  await expect(page.locator('#tour')).toBeVisible();
  await page.getByRole('link', { name: 'Everything', exact: true }).click();
  await expect(page.locator('#charts')).toBeVisible();
  await expect(page.locator('#tour')).toBeHidden();
  await comeBack();
  await expect(page.locator('#tour')).toBeHidden();
  await page.getByRole('link', { name: 'Tour', exact: true }).click();
  await expect(page.locator('#tour')).toBeVisible();
  await comeBack();
  await expect(page.locator('#tour')).toBeVisible();
});

test('only the keys that a step names act, and another step goes on', async ({ stage: page }) => {
  await stopAt(page, 1);
  const now = () =>
    page.evaluate(() => ({ on: upswing.world.agentOn, state: upswing.world.state }));
  await expect.poll(async () => (await now()).on).toBe(true);
  await advance(page, 0.5);
  const before = await now();
  for (const key of ['Space', 'g', 'r', '.', 'ArrowLeft']) await page.keyboard.press(key);
  expect(await now()).toEqual(before);
  await advance(page, 0.2);
  expect(await page.evaluate(() => upswing.world.shoved)).toBeNull();
  await expect(page.locator('#badge')).not.toHaveText(/paused/);
  await open(page, '#everything');
  await page.locator('#pause').click();
  await open(page, `#tour=${SHOVE}`);
  await expect(page.locator('#badge')).not.toHaveText(/paused/);
  await page.keyboard.press('ArrowLeft');
  await advance(page, 0.2);
  expect(await page.evaluate(() => upswing.world.shoved)).not.toBeNull();
});

test('you are the motor: an arrow is its whole torque, and holding one lifts nothing', async ({
  stage: page,
}) => {
  await stopAt(page, 2);
  for (const [key, button, torque] of [
    ['ArrowLeft', 'Turn to the left', 5],
    ['ArrowRight', 'Turn to the right', -5],
  ] as const) {
    await page.keyboard.down(key);
    const rows = await run(page, 20);
    expect(rows.every((row) => row[5] === torque)).toBe(true);
    const highest = rows.map((row) => -Math.cos(row[1]!) - Math.cos(row[1]! + row[2]!));
    expect(Math.max(...highest)).toBeLessThan(1); // of 2 upright
    await page.keyboard.up(key);
    await page.getByRole('button', { name: button }).hover();
    await page.mouse.down();
    expect((await run(page, 0.02)).at(-1)![5]).toBe(torque);
    await page.mouse.up();
    expect((await run(page, 0.02)).at(-1)![5]).toBe(0);
    // The tour looks at the height once in a few frames: the pendulum stays up until it has.
    await expect(answer(page)).toContainText(/Your best: \d+% of the way up/);
    await page.evaluate(() => upswing.reset());
  }
  await page.getByRole('button', { name: 'Next' }).click();
  await page.keyboard.down('ArrowLeft'); // a shove again
  expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
  await page.keyboard.up('ArrowLeft');
});

test('the agent has the same motor, and learned for 80 minutes', async ({ stage: page }) => {
  await stopAt(page, 2);
  await page.keyboard.down('ArrowRight');
  await run(page, 1.3);
  await page.keyboard.up('ArrowRight');
  await page.getByRole('button', { name: 'Next' }).click(); // it takes over in the middle of a swing
  await expect(page.locator('#agent')).toHaveValue('d3qn');
  await page.getByRole('button', { name: 'Give it the motor' }).click();
  const rows = await run(page, 15);
  expect(Math.max(...rows.map((row) => Math.abs(row[5]!)))).toBe(5);
  expect(await balanced(page)).toBeGreaterThan(5);
  await expect(answer(page)).toContainText('in 80 minutes of swinging');
  const text = Buffer.from(readPolicy('d3qn')).toString('latin1');
  const steps = Number(/"step":"(\d+)"/.exec(text)![1]);
  expect(Math.abs((steps * 0.02) / 4800 - 1)).toBeLessThan(0.1);
});

test('it catches one shove, falls after seven, and gets up again', async ({ stage: page }) => {
  await stopAt(page, 4);
  for (const name of ['Shove to the left', 'Shove to the right']) {
    for (const [count, falls] of [
      [1, false],
      [7, true],
    ] as const) {
      await page.evaluate(() => upswing.reset());
      expect(await held(page, 15)).toBeGreaterThan(5);
      for (let k = 0; k < count; ++k) {
        await page.locator('#step-shove').getByRole('button', { name }).click();
        await run(page, 0.2);
      }
      expect((await held(page, 4)) < 4, `${count} of ${name}`).toBe(falls);
      expect(await held(page, 16)).toBeGreaterThan(5);
    }
  }
});

test('the agent fails below 0.8 kg, the one that learned on many does not', async ({
  stage: page,
}) => {
  await stopAt(page, 5);
  const mass = page.locator('#tour-mass');
  const [low, high] = await Promise.all(['min', 'max'].map((end) => mass.getAttribute(end)));
  expect([low, high]).toEqual(['0.7', '1.3']);
  const fails = [0.7, 0.75];
  for (const kilograms of [...fails, 0.8, 0.85, 0.9, 1.1, 1.2, 1.3]) {
    await mass.fill(String(kilograms)); // and it starts over
    expect(await page.evaluate(() => upswing.world.state.q1)).toBe(0);
    const failed = (await held(page, 20)) < 5;
    expect(failed, `${kilograms} kg`).toBe(fails.includes(kilograms));
  }
  await page.getByRole('button', { name: 'Next' }).click();
  expect(await held(page, 20)).toBeLessThan(5);
  await page.getByRole('radio', { name: 'on many' }).check();
  await expect(page.locator('#agent')).toHaveValue('d3qn-adaptive');
  expect(await page.evaluate(() => upswing.world.plant.mass2)).toBe(0.75);
  expect(await held(page, 20)).toBeGreaterThan(10);
  await expect(answer(page)).toContainText('It holds: it feels out');
  await page.getByRole('radio', { name: 'learned on one' }).check(); // it has to swing up itself
  expect(await held(page, 20)).toBeLessThan(5);
  await expect(answer(page)).toContainText('fails again and again');
});

test('the bars are what it expects, and the highest is taken', async ({ stage: page }) => {
  await stopAt(page, 7);
  await expect(page.locator('#q')).toBeVisible();
  await page.evaluate(() => upswing.reset());
  const best: number[] = [];
  for (let k = 0; k < 40; ++k) {
    const [q, torques, applied] = await page.evaluate(() => {
      upswing.world.advanceToControl();
      for (let i = 0; i < 40; ++i) upswing.world.advance();
      upswing.world.look();
      const decision = upswing.world.decision;
      if (decision?.kind !== 'q') throw new Error('no Q-values');
      const taken = upswing.world;
      taken.advance();
      return [[...decision.q], [...decision.torques], taken.torque] as const;
    });
    expect(torques[q.indexOf(Math.max(...q))]).toBe(applied);
    best.push(Math.max(...q));
  }
  expect(await balanced(page)).toBeGreaterThan(2);
  expect(best.at(-1)!).toBeGreaterThan(1.5 * best[0]!); // at the top it expects most
  expect(best.at(-1)!).toBeGreaterThan(0.95 * Math.max(...best));
});

test('every pose at once: the brightest is upright, and a click starts there', async ({
  stage: page,
}) => {
  await visit(page, '#tour=8');
  await expect(page.locator('#map-value')).toHaveText(/^\d+ to \d+$/);
  await stopAt(page, 8);
  /// Of a grid of poses at rest, the one of which the agent expects most, and least.
  const [most, least] = await page.evaluate(() => {
    const poses: [number, number, number][] = [];
    for (let i = -12; i <= 12; ++i) {
      for (let k = -12; k <= 12; ++k) {
        const [q1, q2] = [Math.PI + (i * Math.PI) / 12, (k * Math.PI) / 12];
        const decision = upswing.world.decisionAt({ q1, q2, w1: 0, w2: 0 });
        if (decision?.kind === 'q') poses.push([i, k, Math.max(...decision.q)]);
      }
    }
    poses.sort((a, b) => b[2] - a[2]);
    return [poses[0]!, poses.at(-1)!];
  });
  expect([most[0], most[1]]).toEqual([0, 0]);
  expect(most[2]).toBeGreaterThan(1.5 * least[2]);
  const box = (await page.locator('#map').boundingBox())!;
  // Clicks on the names of the axes start nothing.
  const before = await page.evaluate(() => upswing.world.state);
  await page.locator('#map').click({ position: { x: 7, y: box.height / 2 } });
  await page.locator('#map').click({ position: { x: box.width / 2, y: box.height - 7 } });
  expect(await page.evaluate(() => upswing.world.state)).toEqual(before);
  // A click a quarter of the way in: both links half a turn back.
  await page.locator('#map').click({
    position: { x: 16 + (box.width - 16) / 4, y: (3 * (box.height - 18)) / 4 },
  });
  const { q1, q2 } = await page.evaluate(() => upswing.world.state);
  expect(q1).toBeCloseTo(Math.PI / 2, 1);
  expect(q2).toBeCloseTo(-Math.PI / 2, 1);
  expect(await held(page, 20)).toBeGreaterThan(5);
});

const SIZES = [
  [360, 640],
  [390, 844],
  [820, 1180],
  [1440, 900],
  [2560, 1300],
] as const;

test('at any size pendulum, words, control and buttons are on one screen', async ({
  stage: page,
}) => {
  await visit(page);
  const count = await page.locator('.step').count();
  for (let step = 1; step <= count; ++step) {
    if (step > 1) await page.locator('#tour-next').click();
    for (const [width, height] of SIZES) {
      await page.setViewportSize({ width, height });
      const seen = await page.evaluate(async (step) => {
        scrollTo({ top: 0, behavior: 'instant' });
        const one = (selector: string) =>
          [...document.querySelectorAll(selector)].filter((found) => found.checkVisibility());
        const now = '.step:not([inert])';
        const groups = [
          ...[one('#scene'), one('#tour-next, #tour-end'), one(`${now} h2`)],
          one(`${now} fieldset, #map`),
          ...(step === 7 ? [one('#q')] : []),
        ];
        const shares = new Promise<number[]>((resolve) => {
          const observer = new IntersectionObserver((entries) => {
            observer.disconnect();
            resolve(entries.map(({ intersectionRatio }) => intersectionRatio));
          });
          for (const element of groups.flat()) observer.observe(element);
        });
        return {
          counts: groups.map(({ length }) => length),
          least: Math.min(...(await shares)),
          scrolls: document.documentElement.scrollWidth > innerWidth,
        };
      }, step);
      expect(seen, `step ${step}, ${width} × ${height}`).toEqual({
        counts: seen.counts.map(() => 1),
        least: 1,
        scrolls: false,
      });
    }
  }
});
