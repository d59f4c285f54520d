import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, test } from './page';

/// The game with the visitor as the motor, its ghosts, and films.

const MOTOR = 2; // step of the tour

async function stopAt(page: Page, hash: string): Promise<void> {
  await open(page, hash);
  await page.evaluate(() => void (upswing.clock.advance = () => true));
}

/// A player who holds the lit arrow and sees it `delay` s late. Returns the simulated time (s) until
/// both links are up, at most `patience` s of real time at this speed.
function play(page: Page, delay: number, patience = 120): Promise<number> {
  return page.evaluate(
    ({ delay, patience }) => {
      const { world, clock } = upswing;
      const period = 0.02;
      const seen: number[] = [];
      const late = Math.round((delay * clock.speed) / period);
      for (let k = 0; k < (patience * clock.speed) / period; ++k) {
        seen.push(world.state.w1 < 0 ? -1 : 1);
        world.byHand = 5 * (seen[k - late] ?? 0);
        world.advanceToControl();
        if (world.uprightFor !== null) return (k - late) * period;
      }
      return Infinity;
    },
    { delay, patience },
  );
}

const answer = (page: Page) => page.locator('#step-motor .answer');

test('a player who is 250 ms late and holds the lit arrow wins at half speed', async ({
  stage: page,
}) => {
  await stopAt(page, `#tour=${MOTOR}`);
  await page.getByLabel('half speed').check();
  expect(await page.evaluate(() => upswing.clock.speed)).toBe(0.5);
  await expect(page.locator('#motor-left')).toHaveAttribute('data-hint', '');
  await expect(page.locator('#motor-right')).not.toHaveAttribute('data-hint', '');
  const time = await play(page, 0.25);
  expect(time).toBeLessThan(10);
  await expect(answer(page)).toHaveText(/You did it! Up after \d\.\d s; the agent needs 2\.4 s\./);
  await expect(page.locator('#motor-best')).toHaveText(`${time.toFixed(1)} s`);
  // The record stays for the next visit; full speed has its own.
  await page.getByLabel('half speed').uncheck();
  await expect(page.locator('#motor-best')).toHaveText('–');
  await page.getByLabel('half speed').check();
  await expect(page.locator('#motor-best')).toHaveText(`${time.toFixed(1)} s`);
});

test('the agent needs 2.4 s', async ({ stage: page }) => {
  await open(page, '#agent=d3qn');
  const time = await page.evaluate(() => {
    const { world } = upswing;
    upswing.clock.advance = () => true;
    world.reset();
    world.agentOn = true;
    while (world.uprightFor === null) world.advanceToControl();
    return world.elapsed;
  });
  expect(time.toFixed(1)).toBe('2.4');
});

test('a result is a link with a ghost that others try to beat', async ({ stage: page }) => {
  await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await stopAt(page, `#tour=${MOTOR}`);
  const send = page.locator('#motor-send');
  await expect(send).toBeDisabled();
  const time = await play(page, 0.25);
  await send.click();
  await expect(page.locator('#message')).toContainText('in the clipboard');
  const sent = await page.evaluate(() => navigator.clipboard.readText());
  expect(sent).toContain(`up in ${time.toFixed(1)} s. Beat me: http`);
  const { hash } = new URL(/http\S+$/.exec(sent)![0]);
  expect(hash.length).toBeLessThan(200);

  await stopAt(page, hash);
  await expect(answer(page)).toHaveText(
    `Beat ${time.toFixed(1)} s: the faint pendulum shows that try.`,
  );
  await page.evaluate(() => {
    upswing.world.byHand = 5;
    for (let k = 0; k < 60; ++k) upswing.world.advanceToControl();
  });
  await expect
    .poll(() => page.evaluate(() => Array.from(upswing.scene.ghosts)))
    .toEqual([expect.any(Number), expect.any(Number)]);
  const labels = await page.evaluate(() => upswing.scene.labels.map(({ text }) => text));
  expect(labels).toContain('the sent try');
  await page.getByRole('button', { name: 'Start over' }).click();
  await page.evaluate(() => (upswing.world.byHand = 0));
  expect(await play(page, 0.1)).not.toBe(time);
  await expect(answer(page)).toHaveText(/^(You won: .* against|Up after .*The other try took)/);
});

test('a link without a try that comes up gives one line', async ({ stage: page }) => {
  for (const ghost of ['_zz', 'a', '_zzz_zzz', '__proto__', '<b>']) {
    await stopAt(page, `#tour=${MOTOR}&ghost=${ghost}`);
    await expect(page.locator('#message')).toContainText('does not bring both links up');
    await expect(answer(page)).toHaveText('');
    await expect(page.locator('#first-name')).toHaveText('Dueling Double DQN'); // it has loaded
    await expect(page.locator('#message')).toBeVisible();
    await page.locator('#message-close').click();
  }
});

test('a try with the help of a hand does not count', async ({ stage: page }) => {
  await stopAt(page, `#tour=${MOTOR}`);
  await page.evaluate(() => {
    const { world } = upswing;
    world.byHand = 5;
    world.advanceToControl();
    world.drag = { link: 2, along: 0.5, target: { x: 0, z: 1 } };
    for (let k = 0; k < 500; ++k) world.advanceToControl();
    world.drag = null;
    world.byHand = 0;
  });
  await expect(answer(page)).toContainText('A hand helped');
  await expect(page.locator('#motor-best')).toHaveText('–');
});

test('the end of the tour and each view offer a film, MP4 first, with title and address', async ({
  stage: page,
}) => {
  for (const hash of ['tour=11', 'learn', 'write', 'everything']) {
    await open(page, `#${hash}`);
    await expect(page.locator('button.film:visible').first(), hash).toBeEnabled();
  }
  await open(page, '#tour=1');
  await expect(page.locator('button.film:visible')).toHaveCount(0);
  await open(page, '#tour=11');
  const type = await page.evaluate(() => {
    const types = ['avc1.640028', 'avc1.42E01F'].map((codec) => `video/mp4;codecs=${codec}`);
    const mp4 = [...types, 'video/mp4'].some((type) => MediaRecorder.isTypeSupported(type));
    return mp4 ? 'mp4' : 'webm';
  });
  const download = page.waitForEvent('download');
  const texts = page.evaluate(async () => {
    const drawn = new Set<string>();
    const { fillText } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.fillText = function (...given) {
      if (!this.canvas.isConnected) drawn.add(given[0]); // the film's canvas
      fillText.apply(this, given);
    };
    document.querySelector<HTMLElement>('#step-end .film')!.click();
    await new Promise((resolve) => setTimeout(resolve, 500));
    CanvasRenderingContext2D.prototype.fillText = fillText;
    const now = performance.now.bind(performance);
    performance.now = () => now() + 5000; // the film ends
    return [...drawn];
  });
  expect(await texts).toEqual(['What you saw', new URL(page.url()).host]);
  expect((await download).suggestedFilename()).toBe(`upswing.${type}`);
  await expect(page.locator('#step-end .film')).toHaveText('Film 5 s');
  await page.evaluate(() => delete (performance as Partial<Performance>).now);
});
