import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { advance, balanced, hurryTimers, open, run, test } from './page';
import { readPolicy } from './program';

/// The guided tour: ways into it and out of it, and the truth of its sentences.

// The numbers of the steps.
const [MOTOR, LEARN, SHOVE, CHANGE, BET, POSE, VALUES, MAP] = [2, 3, 4, 6, 5, 8, 9, 10];

/// Opens the page for a new visitor, or at a step of the tour.
async function visit(page: Page, hash = ''): Promise<void> {
  await open(page, hash);
}

const heading = (page: Page) => page.locator('.step:not([inert]) h2');
const answer = (page: Page) => page.locator('.step:not([inert]) .answer');

/// Opens a step with time stopped, so that only run() advances it.
async function stopAt(page: Page, step: number): Promise<void> {
  await visit(page, `#tour=${step}`);
  await page.evaluate(() => {
    upswing.clock.advance = () => true;
  });
}

/// Runs for `seconds` from hanging or the present state. Returns the final time upright without a
/// break.
async function held(page: Page, seconds: number): Promise<number> {
  await advance(page, seconds);
  return balanced(page);
}

test('a new visitor gets the tour, which swings up before MuJoCo has loaded', async ({ page }) => {
  let arrive = () => {};
  const arrived = new Promise<void>((resolve) => (arrive = resolve));
  await page.route(/mujoco.*\.wasm$/, async (route) => {
    await arrived;
    await route.continue();
  });
  await page.goto('./');
  await page.waitForFunction(() => Math.abs(globalThis.upswing?.world.state.q1 ?? 0) > 0.5);
  const before = await page.evaluate(() => {
    upswing.clock.advance = () => true; // time stands still
    return upswing.world.state;
  });
  arrive();
  await page.waitForFunction(() => upswing.isComplete);
  await expect(page.locator('#agent')).toHaveValue('fast');
  expect(await page.evaluate(() => upswing.world.state)).toEqual(before);
  expect(await page.evaluate(() => upswing.world.agentOn)).toBe(true);

  await expect(heading(page)).toContainText('It learns to stand up in your browser');
  await expect(page.locator('#charts')).toBeHidden();
  await advance(page, 6);
  await expect(page.locator('#badge')).toHaveText(/balanced/);
  await expect(answer(page)).toContainText('Balanced, after 70 minutes of practice');
  // Then something happens: a shove, which it catches.
  await advance(page, 4);
  expect(await page.evaluate(() => upswing.world.shoved)).not.toBeNull();
  await expect(answer(page)).toContainText('even when it is shoved');
  expect(await balanced(page)).toBeGreaterThan(5);
  const text = Buffer.from(readPolicy('fast')).toString('latin1');
  const steps = Number(/"step":"(\d+)"/.exec(text)![1]);
  expect(Math.abs((steps * 0.02) / 4200 - 1)).toBeLessThan(0.1);
});

test('nothing moves by itself with reduced motion', async ({ stage: page }) => {
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
    await page.locator('#tour-next').click();
    await expect(heading(page)).toHaveText(title);
    await expect(heading(page)).toBeFocused();
  }
  // The tab key reaches the numbers last.
  await page.locator('#tour-back').focus();
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

test('a link with settings shows everything, and a chosen view is kept', async ({
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
  await comeBack(); // a stranger's link is no choice
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

test('you are the motor: an arrow gives the full torque, which cannot lift the links', async ({
  stage: page,
}) => {
  await stopAt(page, MOTOR);
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
    await expect(page.locator('#motor-best')).toHaveText('–');
    await page.getByRole('button', { name: 'Start over' }).click();
    expect(await page.evaluate(() => upswing.world.state.q1)).toBe(0);
  }
  await page.getByRole('button', { name: 'Next' }).click();
  await page.keyboard.down('ArrowLeft');
  expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
  await page.keyboard.up('ArrowLeft');
});

test('it catches one shove, falls after seven, and gets up again', async ({ stage: page }) => {
  await stopAt(page, SHOVE);
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

test('a bet: only the agent of many pendulums balances the light link', async ({ stage: page }) => {
  await stopAt(page, BET);
  await expect(page.locator('#twin-scene')).toBeVisible();
  await expect(page.locator('#first-name')).toHaveText('learned on one');
  await expect(page.locator('#twin-name')).toHaveText('learned on many');
  expect(await page.evaluate(() => upswing.world.twin!.plant.mass2)).toBe(0.65);
  await advance(page, 2); // nothing moves before the bet
  expect(await page.evaluate(() => upswing.world.state.q1)).toBe(0);
  await expect(answer(page)).toHaveText('');
  for (const [name, result] of [
    ['Learned on one', 'You lost'],
    ['Learned on many', 'You were right'],
  ] as const) {
    const bet = page.getByRole('button', { name });
    await bet.click();
    await expect(bet).toHaveAttribute('aria-pressed', 'true');
    await expect.poll(() => page.evaluate(() => upswing.world.agentOn)).toBe(true);
    await expect(answer(page)).toHaveText('Both try …');
    expect(await held(page, 20)).toBeLessThan(5);
    expect(await page.evaluate(() => upswing.world.twin!.uprightFor)).toBeGreaterThan(10);
    await expect(answer(page)).toContainText(`${result}: only the agent that learned on many`);
  }
  // A result stays, even if both balance later.
  await page.evaluate(() => (upswing.world.plant = { ...upswing.world.plant, mass2: 1 }));
  expect(await held(page, 20)).toBeGreaterThan(5);
  await page.waitForTimeout(1000); // the step checks ten times a second
  await expect(answer(page)).toContainText('You were right: only the agent');
  await page.getByRole('button', { name: 'Next' }).click();
  await expect(page.locator('#twin-scene')).toBeHidden();
});

test('a bet that both agents win or lose is a draw', async ({ stage: page }) => {
  await stopAt(page, BET);
  for (const [change, verdict] of [
    [{ mass2: 1 }, 'A draw: both balance it.'],
    [{ torque_limit: 0.5 }, 'A draw: neither balances it within 20 s.'],
  ] as const) {
    await page.getByRole('button', { name: 'Learned on many' }).click();
    await expect.poll(() => page.evaluate(() => upswing.world.plant.mass2)).toBe(0.65);
    await expect.poll(() => page.evaluate(() => upswing.world.agentOn)).toBe(true);
    await page.evaluate((change) => {
      upswing.world.plant = { ...upswing.world.plant, ...change };
    }, change);
    await advance(page, 21);
    await expect(answer(page)).toHaveText(verdict);
  }
});

test('the bars show the expected reward, and the highest is taken', async ({ stage: page }) => {
  await stopAt(page, VALUES);
  await expect(page.locator('#q')).toBeVisible();
  // Its neurons are above the bars and change with the observation.
  const neurons = page.locator('#neurons');
  await expect(neurons).toBeVisible();
  await page.evaluate(() => upswing.reset());
  await advance(page, 0.1);
  /// The picture, once brightnesses rest.
  const settled = () =>
    neurons.evaluate(async (canvas: HTMLCanvasElement) => {
      for (let last = ''; ;) {
        await globalThis.drawn();
        const picture = canvas.toDataURL();
        if (picture === last) return picture;
        last = picture;
      }
    });
  const before = await settled();
  await advance(page, 1);
  expect(await settled()).not.toBe(before);

  await page.evaluate(() => upswing.reset());
  const decisions = await page.evaluate(() =>
    Array.from({ length: 40 }, () => {
      const { world } = upswing;
      world.advanceToControl();
      for (let i = 0; i < 40; ++i) world.advance();
      world.look();
      const { decision } = world;
      if (decision?.kind !== 'q') throw new Error('no Q-values');
      world.advance();
      return { q: [...decision.q], torques: [...decision.torques], applied: world.torque };
    }),
  );
  const best = decisions.map(({ q, torques, applied }) => {
    expect(torques[q.indexOf(Math.max(...q))]).toBe(applied);
    return Math.max(...q);
  });
  expect(await balanced(page)).toBeGreaterThan(2);
  expect(best.at(-1)!).toBeGreaterThan(1.5 * best[0]!); // the largest values are at the top
  expect(best.at(-1)!).toBeGreaterThan(0.95 * Math.max(...best));

  // Each bar is lower than the tallest by its cost in points of reward.
  const [cost, all] = await page.evaluate(() => {
    const { decision, policy } = upswing.world;
    if (decision?.kind !== 'q') throw new Error('no Q-values');
    const [low, high] = [Math.min(...decision.q), Math.max(...decision.q)];
    return [(high - low) / policy!.rewardScale, high / policy!.rewardScale];
  });
  await expect(page.locator('#q-value')).toHaveText(
    `best ${all!.toFixed(0)} points, worst ${cost!.toFixed(1)} less`,
  );
  await expect(page.locator('#q-value')).toBeVisible();

  // Shoves by keyboard throw it down.
  for (let k = 0; k < 7; ++k) {
    await page.keyboard.press('ArrowLeft');
    await run(page, 0.2);
  }
  expect(await held(page, 4)).toBeLessThan(4);
});

test('the answer to the bars moves nothing', async ({ stage: page }) => {
  await stopAt(page, VALUES);
  const places = () =>
    page.evaluate(() =>
      ['#scene-box', '#q', '#step-values h2', '#tour-next'].map((one) => {
        const { y, height } = document.querySelector(one)!.getBoundingClientRect();
        return [y, height];
      }),
    );
  for (const [width, height] of [
    [320, 640],
    [390, 844],
    [844, 390],
    [1440, 900],
  ] as const) {
    await page.setViewportSize({ width, height });
    await page.evaluate(() => upswing.reset());
    await expect(answer(page)).toHaveText('');
    const before = await places();
    expect(await held(page, 6)).toBeGreaterThan(3);
    await expect(answer(page)).toContainText('Upright');
    expect(await places(), `${width} × ${height}`).toEqual(before);
  }
});

test('only the step of learning makes room for its chart', async ({ stage: page }) => {
  await page.setViewportSize({ width: 1440, height: 900 });
  for (const step of [MOTOR, LEARN, VALUES]) {
    await visit(page, `#tour=${step}`);
    const height = await page.locator('#learn-figure').evaluate((figure) => figure.clientHeight);
    expect(height > 0, `step ${step}`).toBe(step === LEARN);
  }
});

test('every pose at once: the brightest is upright, and a click starts there', async ({
  stage: page,
}) => {
  await visit(page, `#tour=${MAP}`);
  await expect(page.locator('#map-value')).toHaveText(/^\d+ to \d+$/);
  // The legend of the colours matches the map.
  const ends = (await page.locator('#map-value').textContent())!.split(' to ');
  await expect(page.locator('#step-map .scale')).toHaveText(`expected reward${ends.join('')}`);
  await stopAt(page, MAP);
  /// The poses at rest with the largest and the smallest value on a grid.
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

  // By keyboard: from the middle, upright, six times 15° to either side.
  await page.locator('#map').focus();
  for (const key of ['ArrowLeft', 'ArrowDown']) {
    for (let k = 0; k < 6; ++k) await page.keyboard.press(key);
  }
  await expect(page.locator('#map-mark')).toHaveText('upper angle 90°, lower angle −90°');
  expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
  await page.keyboard.press('Enter');
  const started = await page.evaluate(() => upswing.world.state);
  expect(started.q1).toBeCloseTo(Math.PI / 2, 9);
  expect(started.q2).toBeCloseTo(-Math.PI / 2, 9);
  expect(await held(page, 20)).toBeGreaterThan(5);
});

test('the end has three doors, and an invitation', async ({ stage: page }) => {
  await visit(page, '#tour=99');
  await expect(heading(page)).toHaveText('What you saw');
  await expect(page.getByRole('button', { name: 'Next' })).toBeHidden();
  await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await page.getByRole('button', { name: 'Copy an invitation' }).click();
  await expect(page.locator('#message')).toContainText('in the clipboard');
  expect(await page.evaluate(() => navigator.clipboard.readText())).toMatch(
    /^A double pendulum learns.* http.*\/#tour$/,
  );
  await page.getByRole('link', { name: 'Read how it works' }).click();
  await expect(page.getByText('At each step the agent is rewarded for')).toBeInViewport();
  await expect(page.getByText('A dueling network learns the two separately')).toBeVisible();
  await visit(page, '#tour=99');
  await page.getByRole('link', { name: 'Everything at once' }).click();
  await expect(page.locator('#charts')).toBeVisible();
});

test('a text to copy by hand covers no button, and stays until it is closed', async ({
  stage: page,
}) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await visit(page, '#tour=99');
  await hurryTimers(page, 20);
  await page.evaluate(() => {
    const refuse = () => Promise.reject(new Error('refused'));
    Object.defineProperty(navigator.clipboard, 'writeText', { value: refuse, configurable: true });
  });
  await page.getByRole('button', { name: 'Copy an invitation' }).click();
  const message = page.locator('#message');
  await expect(message).toContainText('#tour');
  const [text, tour] = await Promise.all([
    message.boundingBox(),
    page.locator('#tour').boundingBox(),
  ]);
  expect(text!.y + text!.height).toBeLessThanOrEqual(tour!.y);
  await page.waitForTimeout(400); // 8 s of the page: longer than a note stays
  await expect(message).toBeVisible();
  await page.locator('#message-close').click();
  await expect(message).toBeHidden();
  await page.evaluate(() => delete (navigator.clipboard as Partial<Clipboard>).writeText);
});

test('with reduced motion, every step waits for a button', async ({ stage: page }) => {
  await page.emulateMedia({ reducedMotion: 'reduce' });
  const count = await page.locator('.step').count();
  await visit(page, '#tour=1');
  for (let step = 1; step <= count; ++step) {
    if (step > 1) await page.locator('#tour-next').click();
    const state = () => page.evaluate(() => upswing.world.state);
    const hanging = { q1: 0, q2: 0, w1: 0, w2: 0 };
    await expect.poll(state, `step ${step}`).toEqual(hanging); // once its agents have loaded
    await run(page, 1);
    expect(await state(), `step ${step}`).toEqual(hanging);
    const start = page.locator('#tour-start');
    await expect(start).toBeVisible({
      visible: [SHOVE, CHANGE, POSE, VALUES, MAP, count].includes(step),
    });
    if (!(await start.isVisible())) continue;
    await start.click();
    await expect(start).toBeHidden();
    await run(page, 1);
    expect(await page.evaluate(() => upswing.world.state.w1), `step ${step}`).not.toBe(0);
  }
});

const SIZES = [
  [360, 640],
  [820, 1180],
  [1366, 650],
  [2560, 1300],
] as const;

test('at any size, pendulum, words, control and buttons are on one screen', async ({
  stage: page,
}) => {
  await visit(page);
  const count = await page.locator('.step').count();
  for (let step = 1; step <= count; ++step) {
    if (step > 1) await page.locator('#tour-next').click();
    if (step === POSE) await expect(page.locator('#goals')).toBeVisible(); // its agent has loaded
    for (const [width, height] of SIZES) {
      await page.setViewportSize({ width, height });
      const bars = step === VALUES ? ['#q'] : [];
      const tall = height >= 1000 ? { [VALUES]: ['#neurons'] }[step] : [];
      const seen = await page.evaluate(
        async (others) => {
          scrollTo({ top: 0, behavior: 'instant' });
          const one = (selector: string) =>
            [...document.querySelectorAll(selector)].filter((found) => found.checkVisibility());
          const now = '.step:not([inert])';
          const groups = [
            ...[one('#scene'), one(`#tour-next, ${now} #tour-end`), one(`${now} h2`)],
            one(`${now} fieldset, [data-step="map"] #map, [data-step="pose"] #goals`),
            ...others.map(one),
          ];
          const shares = new Promise<number[]>((resolve) => {
            const observer = new IntersectionObserver((entries) => {
              observer.disconnect();
              resolve(entries.map(({ intersectionRatio }) => intersectionRatio));
            });
            for (const element of groups.flat()) observer.observe(element);
          });
          await globalThis.drawn(); // the observer reports with a frame; a still page draws none
          return {
            counts: groups.map(({ length }) => length),
            least: Math.min(...(await shares)),
            scrolls: document.documentElement.scrollWidth > innerWidth,
          };
        },
        [...bars, ...(tall ?? [])],
      );
      expect(seen, `step ${step}, ${width} × ${height}`).toEqual({
        counts: seen.counts.map(() => 1),
        least: 1,
        scrolls: false,
      });
    }
  }
});
