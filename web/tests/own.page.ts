import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import type { QDecision } from '../src/decision';
import { changed as changedFile } from './file';
import { open, slide, test } from './page';
import { policyPath, readPolicy } from './program';

/// A visitor's own policy: kept over a reload, removed on request, and shown only as text.

/// The policy `fast` with some of its metadata changed.
const changed = (metadata: Record<string, string>) =>
  Buffer.from(
    changedFile(readPolicy('fast'), ({ header }) => Object.assign(header.__metadata__!, metadata)),
  );

const NOMINAL = {
  ...{ mass1: 1, mass2: 1, length1: 0.5, length2: 0.5 },
  ...{ damping1: 0.2, damping2: 0.2, gravity: 9.81, torque_limit: 5 },
};
const ofPlant = (plant: Record<string, number>) =>
  changed({ plant: JSON.stringify({ ...NOMINAL, ...plant }) });

const bring = (page: Page, buffer: Buffer, name = 'mine.safetensors') =>
  page.locator('#file').setInputFiles({ name, mimeType: '', buffer });

test('a reload keeps it, until it is removed; other kept data is ignored', async ({
  stage: page,
}) => {
  await open(page);
  await expect(page.locator('#own')).toBeHidden();
  const name = 'learned here, mine';
  await bring(page, Buffer.from(readPolicy('fast')), name);
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#message-text')).toContainText('is the agent now');
  await expect(page.locator('#own')).toContainText(`${name} stays in this browser`);
  // The page's policies never replace a visitor's file, whatever its name.
  expect(await page.evaluate(() => upswing.agents.ownIsLearned)).toBe(false);
  await expect(page).toHaveURL(/agent=own/);
  await page.reload();
  await expect(page.locator('#agent-on')).toBeEnabled();
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#agent option:checked')).toHaveText(`${name} (yours)`);
  await expect(page.locator('#agent-text')).toContainText('8-48-32');
  await expect(page.locator('#message')).toBeHidden();
  // Without settings the page begins with the default agent, and still offers the visitor's own.
  await open(page);
  await expect(page.locator('#agent')).toHaveValue('d3qn');
  await page.locator('#agent').selectOption('own');
  await expect(page.locator('#agent-text')).toContainText('8-48-32');

  await page.getByRole('button', { name: 'Remove it' }).click();
  await expect(page.locator('#agent')).toHaveValue('d3qn');
  await expect(page.locator('#own')).toBeHidden();
  /// The number of kept files, before a file that is too large for a policy is kept.
  const before = await page.evaluate(
    () =>
      new Promise<number>((resolve, reject) => {
        const request = indexedDB.open('upswing');
        request.onsuccess = () => {
          const transaction = request.result.transaction('files', 'readwrite');
          const files = transaction.objectStore('files');
          const count = files.count();
          files.put({ name: 'large', bytes: new ArrayBuffer((16 << 20) + 1) }, 'own');
          transaction.oncomplete = () => {
            request.result.close();
            resolve(count.result);
          };
          transaction.onerror = () => reject(transaction.error!);
        };
      }),
  );
  expect(before).toBe(0);
  await page.goto('about:blank');
  await open(page, '#agent=own');
  await expect(page.locator('#message')).toContainText('sender’s own policy');
  await expect(page.locator('#agent option[value=own]')).toHaveCount(0);
  expect(await page.evaluate(() => upswing.agents.ownName)).toBeNull();
});

test('a link for others has no agent of your own', async ({ stage: page }) => {
  await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await open(page, '#mass2=1.2');
  await page.locator('#file').setInputFiles(policyPath('fast'));
  await expect(page).toHaveURL(/agent=own/);
  await slide(page, 'mass2', 1.2);
  await page.getByRole('button', { name: 'Copy link' }).click();
  await expect(page.locator('#message')).toContainText('without your policy');
  const link = new URL(await page.evaluate(() => navigator.clipboard.readText()));
  expect(link.hash).toBe('#mass2=1.2');
  await slide(page, 'mass2', 1);
  await page.getByRole('button', { name: 'Copy link' }).click();
  await expect
    .poll(() => page.evaluate(() => navigator.clipboard.readText()))
    .toMatch(/#everything$/);
});

test('without storage, and with a database that never answers, the page runs the policy', async ({
  page,
}) => {
  const refuse = () => {
    throw new DOMException('private', 'SecurityError');
  };
  await page.addInitScript(`{
    Storage.prototype.getItem = Storage.prototype.setItem = ${refuse};
    IDBFactory.prototype.open = () => ({}); // never answers
    const later = setTimeout;
    setTimeout = (call, ms) => later(call, ms / 20); // the page waits 3 s
  }`);
  await open(page);
  await page.locator('#file').setInputFiles(policyPath('fast'));
  await expect(page.locator('#agent')).toHaveValue('own');
  await page.evaluate(`IDBFactory.prototype.open = ${refuse}`);
  await page.getByRole('button', { name: 'Remove it' }).click();
  await expect(page.locator('#agent')).toHaveValue('d3qn');
});

test('a plant with a parameter of 0 is refused, and the charts go on', async ({ stage: page }) => {
  await open(page);
  for (const name of ['gravity', 'mass1', 'mass2', 'length1', 'length2', 'torque_limit']) {
    await bring(page, ofPlant({ [name]: 0 }));
    await expect(page.locator('#message')).toContainText(`${name}: expected a number in [0.`);
    await expect(page.locator('#agent')).toHaveValue('d3qn');
    await expect(page.locator('#q-value')).toHaveText(/worst \d/);
  }
});

test('Q-values that are not finite do not spoil the chart for later ones', async ({
  stage: page,
}) => {
  await open(page, '#agent=d3qn');
  await page.locator('#pause').click();
  const painted = () =>
    page.evaluate(async () => {
      await globalThis.drawn();
      const canvas = document.getElementById('q') as HTMLCanvasElement;
      const { data } = canvas
        .getContext('2d')!
        .getImageData(0, 0, canvas.width, canvas.height - 30);
      return data.filter((alpha, i) => i % 4 === 3 && alpha > 0).length;
    });
  const before = await painted();
  await page.evaluate(() => {
    const { world } = upswing;
    const good = world.decision as QDecision;
    world.decision = { ...good, q: good.q.map(() => NaN) };
  });
  const during = await painted();
  expect(during).toBeLessThan(before / 2);
  await page.evaluate(() => upswing.world.look());
  expect(await painted()).toBeGreaterThan(0.8 * before); // the scale shrinks slowly
});

test('sliders extend to a plant or link beyond their range', async ({ stage: page }) => {
  await open(page);
  const plant = { mass1: 5, length2: 2, gravity: 60, mass2: 0.01, torque_limit: 400 };
  await bring(page, ofPlant(plant));
  await expect(page.locator('#agent')).toHaveValue('own');
  await expect(page.locator('#message-text')).toContainText('is the agent now');
  const shown = async () => {
    for (const [name, value] of Object.entries(plant)) {
      const slider = page.locator(`#${name}`);
      await expect(slider).toHaveValue(String(value));
      await expect(page.locator(`output[for=${name}]`)).toContainText(`${value} `);
      const mark = page.locator(`.slider:has(#${name}) .trained`);
      const share = await mark.evaluate((one) =>
        Number(one.style.getPropertyValue('--share-from')),
      );
      const [low, high] = await slider.evaluate((one: HTMLInputElement) => [one.min, one.max]);
      expect(share).toBeCloseTo((value - Number(low)) / (Number(high) - Number(low)), 9);
    }
  };
  await shown();
  expect(await page.evaluate(() => upswing.world.plant)).toMatchObject(plant);
  await expect(page).toHaveURL(/mass1=5/);
  await page.reload();
  await expect(page.locator('#agent-on')).toBeEnabled();
  await shown();
  expect(await page.evaluate(() => upswing.world.plant)).toMatchObject(plant);
  // At the extended end, the plant is still valid.
  await slide(page, 'mass2', 0);
  expect(await page.evaluate(() => upswing.world.plant.mass2)).toBe(0.01);
  await expect(page.locator('output[for=mass2]')).toHaveText('0.01 kg');
  // Another agent's sliders have their usual range.
  await page.locator('#agent').selectOption('d3qn');
  await page.getByRole('button', { name: 'Reset sliders' }).click();
  await expect(page.locator('#mass1')).toHaveAttribute('max', '3');
});

test('strings of a policy file are shown as text of bounded length', async ({ stage: page }) => {
  await open(page);
  const evil = `<img src=x onerror="globalThis.ran=1">${'W'.repeat(5000)}`;
  await bring(page, changed({ format_version: evil }), `${evil.slice(0, 200)}.safetensors`);
  const message = page.locator('#message-text');
  await expect(message).toContainText('<img src=x');
  expect((await message.textContent())!.length).toBeLessThan(300);
  // A file has a limit for the length of the agent's name.
  const agent = evil.slice(0, 64);
  await bring(page, changed({ agent }), `${evil.slice(0, 200)}.safetensors`);
  await expect(page.locator('#agent')).toHaveValue('own');
  const title = (await page.locator('#agent option:checked').textContent())!;
  expect(title).toContain('<img src=x');
  expect(title.length).toBeLessThan(80);
  expect(await page.locator('img:not(h1 > img)').count()).toBe(0);
});

test('strings of the list of agents are shown as text of bounded length', async ({ page }) => {
  const evil = `<img src=x onerror="globalThis.ran=1">\u202e\n${'W'.repeat(100)}`;
  const entry = { id: 'd3qn', file: 'd3qn.safetensors', agent: evil };
  const agents = [
    { ...entry, command: './upswing train --start-policy x; touch y; $(id)', curve: { step: 'x' } },
    { ...entry, id: 'quoted', command: "./upswing train --start-policy 'x; touch y; $(id)'" },
    null,
    { id: 7 },
    { ...entry, id: 'own' },
  ];
  await page.route(/agents\.json$/, (route) => route.fulfill({ json: { agents } }));
  await open(page);
  await expect(page.locator('#agent option')).toHaveCount(2 + 5); // and the controllers
  await expect(page.locator('#agent-command')).toHaveAttribute('hidden');
  const title = (await page.locator('#agent option:checked').textContent())!;
  expect(title.length).toBeLessThan(130);
  expect(title).not.toMatch(/[\n\u202e]/);
  await page.locator('#agent').selectOption('quoted');
  await expect(page.locator('#agent-command')).toHaveText(
    "./upswing train --start-policy 'x; touch y; $(id)'",
  );
  expect(await page.locator('img:not(h1 > img)').count()).toBe(0);
});

test('a link with huge texts gets a short message', async ({ stage: page }) => {
  await open(page, `#${'k'.repeat(3000)}=1&agent=${'a'.repeat(3000)}&mass1=${'9'.repeat(3000)}`);
  const message = page.locator('#message-text');
  await expect(message).toContainText('Not all of the link could be used');
  expect((await message.textContent())!.length).toBeLessThan(400);
});
