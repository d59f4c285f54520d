import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { createHash } from 'node:crypto';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { Core } from '../src/core';
import { Learner } from '../src/learn/learner';
import type { Session } from '../src/learn/session';
import type { News, Order } from '../src/learn/worker';
import { coreModule } from './core';
import { advance, balanced, open, test } from './page';
import { policyPath, runProgram } from './program';

/// Among seeds 1 to 20, seed 9 needs nearly the fewest steps.
const SEED = 9;
const COMPARED = 480; // steps of all environments; the page keeps the policy after each 48 of them

const status = (page: Page) => page.locator('#learn-status');
const hash = (file: Uint8Array) => createHash('sha256').update(file).digest('hex');

/// Opens the view of learning in its initial state.
async function openLearn(page: Page): Promise<void> {
  await open(page, '#learn');
  await page.evaluate(() => {
    upswing.learn.forget();
    document.querySelector<HTMLDetailsElement>('#learn-options')!.open = true;
    for (const input of document.querySelectorAll<HTMLInputElement>('#learn-panel input')) {
      if (input.type === 'range') continue;
      input.value = input.defaultValue;
      if (input.checked !== input.defaultChecked) input.click();
    }
  });
  await page.locator('#learn-agent').selectOption('fast');
  await expect(page.locator('#learn-start')).toHaveText('Learn');
}

/// The file saved by a click.
async function saved(page: Page): Promise<Uint8Array> {
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save policy.safetensors' }).click();
  expect((await download).suggestedFilename()).toBe('policy.safetensors');
  return readFileSync(await (await download).path());
}

/// From now on only advance() moves the pendulum.
function stopTime(page: Page): Promise<void> {
  return page.evaluate(() => void (upswing.clock.advance = () => true));
}

/// The title below the picture of a film.
function filmTitle(page: Page): Promise<string[]> {
  return page.evaluate(async () => {
    const drawn = new Set<string>();
    const { fillText } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.fillText = function (...given) {
      if (!this.canvas.isConnected) drawn.add(given[0]); // the film's canvas is outside of the page
      fillText.apply(this, given);
    };
    const film = document.getElementById('learn-film')!;
    const label = film.textContent;
    film.click();
    while (drawn.size === 0) await globalThis.drawn();
    CanvasRenderingContext2D.prototype.fillText = fillText;
    const now = performance.now.bind(performance);
    performance.now = () => now() + 5000; // the film ends
    while (film.textContent !== label) await globalThis.drawn();
    delete (performance as Partial<Performance>).now;
    return [...drawn];
  });
}

/// Makes the next page report the real training of a seed as solved from tellSolved() on. Its trainings
/// start slowly, to leave the processor to others.
async function solveWhenTold(page: Page, solved: number): Promise<void> {
  await page.addInitScript((solved) => {
    globalThis.Worker = class extends Worker {
      private seed = 0;
      override postMessage(order: Order): void {
        if (order.kind === 'start') {
          this.seed = order.seed;
          order.slow = true;
        }
        super.postMessage(order);
      }
      override set onmessage(hear: (event: MessageEvent<News>) => void) {
        super.onmessage = (event: MessageEvent<News>) => {
          const { data } = event;
          if (data.kind === 'report' && this.seed === solved && document.body.dataset.solved) {
            Object.assign(data.report, { solved: true, finished: true });
          }
          hear(event);
        };
      }
    };
  }, solved);
}

const tellSolved = (page: Page) => page.evaluate(() => void (document.body.dataset.solved = 'yes'));

/// Whether the agent on the stage is up 15 s after hanging.
async function swingsUp(page: Page): Promise<boolean> {
  await stopTime(page);
  await page.evaluate(() => upswing.world.reset());
  await advance(page, 15);
  return (await balanced(page)) > 5;
}

test('an agent that learns in the tour stays, and equals that of Node and the program', async ({
  page,
}) => {
  await openLearn(page);
  await page.getByLabel('Seed', { exact: true }).fill(String(SEED));
  await page.getByLabel('slow start').uncheck();
  await page.getByRole('link', { name: 'Tour' }).click();
  await page.getByRole('button', { name: 'Step 3:' }).click();
  const step = page.locator('#step-learn');
  /// All texts that a screen reader announces.
  await page.evaluate(() => {
    const heard: string[] = [];
    Object.assign(globalThis, { heard });
    const observer = new MutationObserver((changes) => {
      for (const { target } of changes) {
        const element = target instanceof Element ? target : target.parentElement!;
        const live = element.closest('[aria-live]')?.getAttribute('aria-live');
        if (live === 'polite' && element.textContent) heard.push(element.textContent);
      }
    });
    observer.observe(document.body, { childList: true, characterData: true, subtree: true });
  });
  await step.getByRole('button', { name: 'Learn' }).click();
  await expect(page.locator('#tour-count')).toHaveText(/^Trial [\d,]+, .* of swinging$/);
  expect(page.workers().length).toBe(1);
  const learned = () => page.evaluate(() => upswing.world.policy!.metadata.get('agent'));
  await expect.poll(learned).toBe('fast');
  // Training goes on during other steps, and its result is there on return.
  await page.locator('#tour-back').click();
  await expect.poll(learned).toBe('d3qn');
  await page.locator('#tour-next').click();
  await expect.poll(learned).toBe('fast');
  await expect(step.locator('.answer')).toContainText('Solved after');
  await expect.poll(() => page.workers().length).toBe(0);
  await expect(page.locator('#agent')).toHaveValue('own');
  const heard = await page.evaluate(() => (globalThis as never as { heard: string[] }).heard);
  // Each milestone once, and the last one again when the visitor returns.
  const milestones = heard.filter((text) => /Learning|first|most|Solved/.test(text));
  expect(new Set(milestones).size).toBeGreaterThanOrEqual(milestones.length - 1);
  expect(heard.length).toBeLessThanOrEqual(12);
  await page.locator('#tour-back').click();
  await expect.poll(learned).toBe('d3qn');
  await page.locator('#tour-next').click();
  await expect.poll(learned).toBe('fast');
  await page.getByRole('button', { name: 'Step 11:' }).click();
  await page.getByRole('link', { name: 'Everything, with your own agent' }).click();
  await expect(page.locator('#charts')).toBeVisible();
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'true');
  expect(await page.evaluate(() => upswing.agents.ownIsLearned)).toBe(true);

  expect(await swingsUp(page)).toBe(true);

  await page.getByRole('link', { name: 'Learn', exact: true }).click();
  await expect(status(page)).toContainText('Solved after ');
  await expect(page.locator('#learn-success')).toHaveText('100%');
  await expect(page).toHaveURL(new RegExp(`#learn=fast&seed=${SEED}$`));
  const tries = page.locator('#learn-strip li');
  await expect(tries).toHaveCount(6);
  await expect(tries.first()).toHaveText(/^trial 0\s0\.0 s up$/);
  await expect(tries.last()).toHaveText(/^at the end\s[1-9]\.\d s up$/);

  // The beginning of a training with the same seed in Node, past its first test.
  const learner = new Learner(await Core.start(await coreModule()), 'fast', SEED);
  expect(learner.report()).toMatchObject({ steps: 0, updates: 0, solved: false, episodes: [] });
  expect(learner.best()).toBeNull();
  learner.run(COMPARED);
  const { steps, episodes, evaluations } = learner.report();
  const here = await page.evaluate((steps) => {
    const { session } = upswing.learn as never as { session: Session };
    const { checkpoints, episodes, evaluations } = session;
    const { file } = checkpoints.find(({ step }) => step === steps)!;
    return { episodes, evaluations, file: Array.from(new Uint8Array(file as ArrayBuffer)) };
  }, steps);
  expect(hash(Uint8Array.from(here.file))).toBe(hash(new Uint8Array(learner.policy())));
  expect(here.episodes.slice(0, episodes.length).map(({ reward }) => 200 * reward)).toEqual(
    episodes.map((episode) => expect.closeTo(episode.return, 6)),
  );
  expect(here.evaluations.slice(0, evaluations.length)).toEqual(evaluations);
  const successes = here.evaluations.map(({ success }) => success);
  expect(successes[0]).toBe(0);
  expect(successes.slice(-2).map((success) => success > 0.9)).toEqual([true, true]);
  const file = await saved(page);
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  try {
    const path = join(folder, 'policy.safetensors');
    writeFileSync(path, file);
    const result = JSON.parse(runProgram('eval', path, '--episodes', '5', '--json')) as object;
    expect(result).toMatchObject({ success_rate: 1 });
  } finally {
    rmSync(folder, { recursive: true });
  }

  // Along the curve from flailing to balance, with the untrained policy next to it.
  const scrub = page.locator('#learn-scrub');
  await page.getByLabel('show the untrained agent too').check();
  await expect(page.locator('#twin-name')).toHaveText('untrained');
  await scrub.fill('0');
  await expect(page.locator('#learn-where')).toHaveText('on the stage: after 0 steps');
  expect(await swingsUp(page)).toBe(false);
  // Numbers and file belong to the agent on the stage.
  await expect(page.locator('#learn-trials')).toHaveText('0');
  expect(Buffer.from(await saved(page)).toString('latin1')).toContain('"step":"0"');
  await expect(status(page)).toHaveText('An earlier version: it passes no test.');
  await scrub.press('End');
  await expect(page.locator('#learn-where')).toHaveText('on the stage: as it is now');
  expect(await swingsUp(page)).toBe(true);

  // It is still there at the next visit.
  await page.goto('about:blank');
  await page.goto('./#agent=own&on=1');
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#agent option:checked')).toHaveText(
    `learned here, fast, seed ${SEED} (yours)`,
  );
  expect(await swingsUp(page)).toBe(true);
  expect(await page.evaluate(() => upswing.agents.ownIsLearned)).toBe(true);
});

test("the default agent's checkpoints, from untrained to final, are fetched on demand", async ({
  page,
}) => {
  const fetched: string[] = [];
  page.on('request', (request) => fetched.push(new URL(request.url()).pathname));
  const checkpoints = () => fetched.filter((path) => /-at-\d+\.safetensors$/.test(path));
  await openLearn(page);
  await page.waitForLoadState('networkidle');
  expect(checkpoints()).toEqual([]);
  await page.getByRole('button', { name: 'How the default agent learned' }).click();
  const where = page.locator('#learn-where');
  await expect(where).toHaveText('on the stage: after 240,000 steps');
  await expect(page.locator('#learn-success')).toHaveText('100%');
  expect(checkpoints()).toEqual([]);

  /// The share of swing-ups, from hanging and other poses, that end upright.
  const successes = () =>
    page.evaluate(() => {
      const { world } = upswing;
      const starts = [0, 1.2];
      const upright = starts.filter((q1) => {
        world.reset({ q1, q2: -q1, w1: 0, w2: 0 });
        for (let k = 0; k < 200 * 15; ++k) world.advance();
        return (world.uprightFor ?? 0) > 5;
      });
      return upright.length;
    });
  const scrub = page.locator('#learn-scrub');
  // Its tests continued after its best policy, with episodes longer than a trial.
  await expect(scrub).toHaveAttribute('max', '250016');
  await expect(page.getByRole('button', { name: 'Share this training' })).toBeDisabled();
  expect(await filmTitle(page)).toEqual([
    'Dueling Double DQN',
    'after 240,000 steps, success 100%',
    new URL(page.url()).host,
  ]);
  await stopTime(page);
  expect(await successes()).toBe(2);
  await scrub.press('Home');
  await expect(where).toHaveText('on the stage: after 0 steps');
  await expect(page.locator('#learn-success')).toHaveText('–');
  expect(await successes()).toBe(0);
  expect(checkpoints().length).toBe(1);
  await scrub.fill('61000');
  await expect(where).toHaveText('on the stage: after 50,016 steps');
  await expect(page.locator('#learn-success')).toHaveText('0%');
  expect(await successes()).toBe(0);
  await scrub.press('End');
  await expect(where).toHaveText('on the stage: after 240,000 steps');
  expect(await successes()).toBe(2);
  expect(checkpoints().length).toBe(2);
  // Arrow keys move by one policy.
  for (const [key, step] of [
    ['ArrowLeft', '210,016'],
    ['ArrowLeft', '180,000'],
    ['ArrowRight', '210,016'],
    ['ArrowRight', '240,000'],
  ] as const) {
    await scrub.press(key);
    await expect(where).toHaveText(`on the stage: after ${step} steps`);
  }

  await page.getByLabel('show the untrained agent too').check();
  await expect(page.locator('#twin-name')).toHaveText('untrained');
  const step = await page.evaluate(() => upswing.world.twin!.policy!.metadata.get('step'));
  expect(step).toBe('0');

  // A missing policy is reported, and the policy before stays.
  await page.route(/-at-20000\.safetensors$/, (route) =>
    route.fulfill({ status: 200, body: 'no' }),
  );
  await scrub.fill('22000');
  const message = page.locator('#message');
  await expect(message).toContainText('The agent after 20,000 steps cannot be shown');
  expect(await page.evaluate(() => upswing.world.policy!.metadata.get('step'))).toBe('240000');
});

test('a link trains an agent by its recipe, and the stage shows the training pendulums', async ({
  stage: page,
}) => {
  await open(page, '#learn=sac-fast&seed=5&balance_weight=0');
  await expect(page.locator('#learn-start')).toHaveText('Pause training');
  await expect(page.locator('#learn-agent')).toHaveValue('sac-fast');
  await expect(page.locator('#learn-seed')).toHaveValue('5');
  await expect(page.locator('#learn-knobs [name=balance_weight]')).toHaveValue('0');
  const ghosts = () => page.evaluate(() => upswing.scene.ghosts.length);
  await expect.poll(ghosts).toBe(2 * 32);
  await expect(page).toHaveURL(/#learn=sac-fast&seed=5&balance_weight=0$/);
  await page.locator('#learn-start').click();
  await expect.poll(ghosts).toBe(0);

  await open(page, '#learn=fast&seed=-3&steps=1');
  await expect(page.locator('#message-text')).toContainText('seed: expected a whole number from 0');
  await expect(page.locator('#message-text')).toContainText('unknown setting "steps"');
  await page.locator('#learn-start').click();
});

test('a policy learned elsewhere takes the stage on return, and of four seeds one does, once', async ({
  page,
}) => {
  await solveWhenTold(page, 2);
  await open(page, '#learn=fast&seed=2');
  await expect(page.locator('#learn-steps')).not.toHaveText('0');
  await page.getByRole('link', { name: 'Everything', exact: true }).click();
  await expect(page.locator('#agent')).toHaveValue('d3qn');
  await tellSolved(page);
  await expect.poll(() => page.workers().length).toBe(0);
  await expect(page.locator('#agent option[value=own]')).toHaveCount(1);
  await expect(page.locator('#agent')).toHaveValue('d3qn');
  await expect(page.locator('#learn-where')).toHaveText('on the stage: another agent');
  await page.getByRole('link', { name: 'Learn', exact: true }).click();
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#learn-where')).toHaveText('on the stage: as it is now');
  const [agent, progress] = await filmTitle(page);
  expect(agent).toBe('a small Dueling Double DQN, seed 2');
  expect(progress).toMatch(/^after [\d,]+ steps(, success \d+%)?$/);

  // Four seeds at once can each be watched.
  await page.evaluate(async () => {
    await upswing.agents.forgetOwn();
    // Keeping a policy never ends from now on, so other trainings report meanwhile.
    IDBFactory.prototype.open = () => ({}) as IDBOpenDBRequest;
    delete document.body.dataset.solved;
  });
  await openLearn(page);
  await page.evaluate(() => {
    const keep = upswing.keepLearned.bind(upswing);
    upswing.keepLearned = async (learned, shown) => {
      document.body.dataset.kept = `${document.body.dataset.kept ?? ''}${learned.file.name};`;
      return keep(learned, shown);
    };
  });
  await page.getByLabel('show the untrained agent too').check();
  await page.getByLabel('four seeds at once').check();
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  const seeds = page.getByRole('radio', { name: /seed/ });
  await expect(seeds).toHaveCount(4);
  for (const seed of [4, 2]) {
    await page.getByRole('radio', { name: `seed ${seed}` }).check();
    await expect(page.locator('#learn-updates')).not.toHaveText('0');
    const seedOf = (which: 'policy' | 'twin') =>
      page.evaluate((which) => {
        const world = which === 'twin' ? upswing.world.twin : upswing.world;
        return world?.policy?.metadata.get('seed');
      }, which);
    expect(await seedOf('policy')).toBe(String(seed));
    await expect.poll(() => seedOf('twin')).toBe(String(seed));
  }
  await tellSolved(page);
  await expect(status(page)).toContainText('Solved after ');
  await expect(page.locator('#agent')).toHaveValue('own');
  expect(await page.evaluate(() => document.body.dataset.kept)).toBe('learned here, fast, seed 2;');
});

test('the view has one pause, for the training', async ({ stage: page }) => {
  await openLearn(page);
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  await expect(page.getByRole('button', { name: /pause/i })).toHaveCount(1);
  await page.locator('#learn-title').click(); // no button has the focus
  await page.keyboard.press('Space');
  await expect(page.locator('#badge')).not.toHaveText(/paused/);
  await page.getByRole('button', { name: 'Pause training' }).click();
  await expect(status(page)).toHaveText('Paused.');
});

test('on a phone pendulum, button and curve share the first screen', async ({ stage: page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await openLearn(page);
  await page.locator('#learn-start').click();
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  expect(await page.evaluate(() => scrollY)).toBe(0);
  for (const id of ['scene-box', 'learn-start', 'learn-curve', 'learn-scrub']) {
    await expect(page.locator(`#${id}`)).toBeInViewport({ ratio: 1 });
  }
});

test('pause, go on, another seed, start over', async ({ stage: page }) => {
  await openLearn(page);
  await page.getByLabel('Seed', { exact: true }).fill('7');
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  await page.locator('#learn-start').click();
  await expect(status(page)).toHaveText('Paused.');
  await expect(page.locator('#learn-start')).toHaveText('Resume training');
  const steps = async () =>
    Number((await page.locator('#learn-steps').innerText()).replace(',', ''));
  // The last report before the pause arrives, and then none.
  let before = -1;
  const rests = async () => before === (before = await steps());
  await expect.poll(rests, { intervals: [1000] }).toBe(true);
  // It stays paused in the tour.
  await page.evaluate(() => (location.hash = '#tour=3'));
  await page.getByRole('button', { name: 'Resume', exact: true }).click();
  await expect.poll(steps).toBeGreaterThan(before);
  await page.evaluate(() => (location.hash = '#learn'));
  // Watched from the click on, because the number of steps may grow at once.
  await page.evaluate(
    (before) =>
      new Promise<void>((fewer) => {
        const steps = document.getElementById('learn-steps')!;
        const look = () => {
          if (Number(steps.innerText.replaceAll(',', '')) < before) fewer();
          else setTimeout(look, 10);
        };
        document.getElementById('learn-again')!.click();
        look();
      }),
    before,
  );
  await page.locator('#learn-start').click();
});

test('four seeds from the largest seed on are valid in links', async ({ stage: page }) => {
  await openLearn(page);
  await page.getByLabel('four seeds at once').check();
  await page.getByLabel('Seed', { exact: true }).fill('1000000000');
  await page.evaluate(() => {
    document.getElementById('learn-start')!.click();
    upswing.learn.stop();
  });
  await page.getByRole('radio', { name: /seed/ }).nth(3).check();
  await expect(page).toHaveURL(/#learn=fast&seed=1000000000$/);
});

test("a finger holds the slider under the chart, and the numbers match the worker's", async ({
  stage: page,
}) => {
  await openLearn(page);
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  const scrub = page.locator('#learn-scrub');
  await expect(scrub).toBeEnabled();
  const { width, height } = (await scrub.boundingBox())!;
  // The first reports move the page: press until the slider is held, at the newest policy.
  await expect(async () => {
    await page.mouse.up();
    await scrub.hover({ position: { x: width - 2, y: height / 2 } });
    await page.mouse.down();
    expect(await scrub.evaluate((slider) => slider.matches(':active'))).toBe(true);
  }).toPass();
  const steps = async () =>
    Number((await page.locator('#learn-steps').innerText()).replaceAll(',', ''));
  const [held, before] = [await scrub.inputValue(), await steps()];
  await expect.poll(steps).toBeGreaterThan(before);
  expect(await scrub.inputValue()).toBe(held);
  await page.mouse.up();

  // Many reports at once, from a busy page, do not speed up trainings.
  const rates = await page.evaluate(async () => {
    const rate = () => Number(document.getElementById('learn-rate')!.textContent);
    const usual = rate();
    const end = performance.now() + 1500;
    while (performance.now() < end);
    let highest = 0;
    for (let k = 0; k < 5; ++k) {
      await new Promise(requestAnimationFrame);
      highest = Math.max(highest, rate());
    }
    return { usual, highest };
  });
  expect(rates.usual).toBeGreaterThan(0);
  expect(rates.highest).toBeLessThan(20 * rates.usual);

  // Hidden in the tour, it waits.
  await page.getByRole('link', { name: 'Tour' }).click();
  await expect(page.locator('html')).toHaveAttribute('data-view', 'tour');
  await page.getByRole('link', { name: 'Learn', exact: true }).click();
  await expect(status(page)).toHaveText(/^(Learning …|Solved after)/); // it went on
  await page.evaluate(() => upswing.learn.stop());
});

test('a slow start shows one update after another: guess, target, correction', async ({
  stage: page,
}) => {
  await openLearn(page);
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  const guess = page.locator('#lesson-guess');
  await expect(guess).toBeVisible();
  await expect(guess).toContainText('Will its guess go up or down?');
  await expect(page.locator('#lesson-memory-text')).toHaveText(/^[\d,]+ steps$/);
  const slow = await page.evaluate(() =>
    Number(document.getElementById('learn-trials')!.textContent),
  );
  expect(slow).toBeLessThan(100);
  const numbers = (text: string | null) =>
    [...text!.replaceAll(',', '').matchAll(/[−\d]+\.\d/g)].map(([number]) =>
      Number(number.replace('−', '-')),
    );
  const ask = async () => {
    const asked = await guess.textContent();
    await page.getByRole('button', { name: 'Up', exact: true }).click();
    const answer = (await page.locator('#lesson-answer').textContent())!;
    return { asked, answer };
  };
  const { asked, answer } = await ask();
  // The question shows the reward and the expectation after it. Their sum is the target.
  const [before, reward, next] = numbers(asked!.slice(asked!.indexOf('guessed'))) as [
    number,
    number,
    number,
  ];
  const target = Number((reward + next).toFixed(1));
  const rises = target > before;
  expect(answer).toContain(
    `= ${target.toFixed(1).replace('-', '−')} is ${rises ? 'more' : 'less'}`,
  );
  expect(answer.startsWith('Right')).toBe(rises);
  const corrected = numbers(answer).at(-1)!;
  expect(Math.abs(target - corrected)).toBeLessThan(Math.abs(target - before));
  // There is another question once a later update has made one, and also after the training's end.
  const another = page.getByRole('button', { name: 'Another update' });
  await expect(async () => {
    if (!(await another.isVisible())) await ask();
    await another.click();
    expect(await guess.textContent()).not.toBe(asked);
  }).toPass();
  const second = (await ask()).asked!;
  await page.evaluate(() => upswing.learn.stop());
  await another.click();
  await expect(guess).not.toHaveText(second);
  // A new training asks about its own updates, and its ring has its own values.
  await page.getByRole('button', { name: 'Start over' }).click();
  await expect(page.locator('#lesson')).toBeHidden();
  await expect(page.locator('#lesson')).toBeVisible();
  await page.getByLabel('slow start').uncheck();
  await page.locator('#learn-start').click();
});

test('a race waits for a bet, trains both sides and can be shared', async ({ stage: page }) => {
  await open(page, '#learn=fast&seed=7&balance_weight=4&rival=dqn');
  const [one, two] = [page.locator('#race-one'), page.locator('#race-two')];
  await expect(one).toHaveText('Dueling Double DQN (balance weight 4)');
  await expect(two).toHaveText('DQN');
  expect(page.workers().length).toBe(0);
  await two.click();
  await expect(two).toHaveAttribute('aria-pressed', 'true');
  await expect(page.locator('#race-result')).toHaveText('0 of 6 trainings have ended.');
  await expect.poll(() => page.workers().length).toBe(6);
  await expect(one).toBeDisabled(); // a second bet would start again
  await expect(page.getByRole('radio', { name: 'DQN, seed 9' })).toBeVisible();
  await expect(page).toHaveURL(/#learn=fast&seed=7&balance_weight=4&rival=dqn$/);
  await expect(page.locator('#race-name-0')).toHaveText('Dueling Double DQN (balance weight 4)');
  await expect(page.locator('#race-name-1')).toHaveText('DQN');
  await expect(page.getByRole('button', { name: 'Start over' })).toBeHidden(); // only a bet starts
  // Two pendulums on the stage, and the explanation after the race.
  await expect(page.locator('#twin-name')).toHaveText(/^DQN, after [\d,]+ steps$/);
  await expect(page.locator('#race-how')).toBeHidden();
  await page.evaluate(() => upswing.learn.stop());
  await expect(page.locator('#race-result')).toHaveText('The race was ended.');
  await expect(page.locator('#learn-start')).toBeHidden();
  await expect(one).toBeEnabled();
  await page.locator('#learn-rival').selectOption('');
  await expect(page.locator('#race')).toBeHidden();
  await expect(page.locator('#learn-again')).toBeVisible();
});

test('an agent chosen before the first report stays', async ({ stage: page }) => {
  await openLearn(page);
  await page.evaluate(async () => {
    // Both are loaded, so choosing one takes no time.
    for (const id of ['fast', 'd3qn']) await upswing.choose(id);
    document.getElementById('learn-start')!.click();
    await upswing.choose('fast');
  });
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  expect(await page.evaluate(() => upswing.world.policy!.metadata.get('step'))).toBe('210016');
});

test("settings and messages about wrong values equal the program's", async ({ stage: page }) => {
  await openLearn(page);
  await page.getByText('Training settings', { exact: true }).click();
  const rate = page.getByLabel('learning rate');
  await expect(rate).toHaveValue('0.002');
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  // A wrong value is reported at its field, and the current training goes on.
  for (const [name, wrong] of [
    ['learning rate', '-1'],
    ['n step', '2.5'],
    ['gamma', ''],
  ] as const) {
    const field = page.getByLabel(name);
    await field.fill(wrong);
    await page.getByRole('button', { name: 'Start over' }).click();
    await expect(field).toBeFocused();
    await expect(page.locator('#learn-start')).toHaveText('Pause training');
    await page.getByRole('button', { name: 'Reset settings' }).click();
  }
  await expect(rate).toHaveValue('0.002');
  await page.getByLabel('layer norm').uncheck();
  await page.getByRole('button', { name: 'Start over' }).click();
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  const network = await page.evaluate(() => upswing.world.policy!.metadata.get('network'));
  expect(network).toContain('"layer_norm":false');
  await page.getByLabel('Agent to train').selectOption('sac-fast');
  await expect(page.getByLabel('twin', { exact: true })).not.toBeChecked();
  await page.getByRole('button', { name: 'Start over' }).click();
  await expect(page.locator('#q-name')).toHaveText(/Policy/);
  await page.locator('#learn-start').click();
});

test("the visitor's own file is not replaced, and another agent keeps the stage", async ({
  stage: page,
}) => {
  await openLearn(page);
  await page.locator('#file').setInputFiles(policyPath('dqn'));
  await expect(page.locator('#agent')).toHaveValue('own');
  await page.getByRole('button', { name: 'Learn', exact: true }).click();
  await expect(page.locator('#learn-updates')).not.toHaveText('0');
  await page.evaluate(() => upswing.choose('d3qn'));
  const steps = page.locator('#learn-steps');
  const before = await steps.innerText();
  await expect(steps).not.toHaveText(before);
  expect(await page.evaluate(() => upswing.world.policy!.metadata.get('agent'))).toBe('d3qn');
  expect(await page.evaluate(() => upswing.agents.ownName)).toBe('dqn.safetensors');
  await page.locator('#learn-start').click();
});

test.describe('missing parts', () => {
  test.use({ complains: true });
  test('a worker that does not start is reported', async ({ stage: page }) => {
    await page.route(/worker-.*\.js$/, (route) => route.abort());
    await openLearn(page);
    await page.getByRole('button', { name: 'Learn', exact: true }).click();
    await expect(status(page)).toContainText('its worker could not start');
  });
});
