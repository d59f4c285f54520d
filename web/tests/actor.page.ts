import { writeFileSync } from 'node:fs';
import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, run, startFrom, test } from './page';
import { actorFiles, simulate } from './program';

/// Actor policies as a visitor's files: a Gaussian with a critic of its actions, one without a
/// critic, a clipped one, a categorical one.

const bring = (page: Page, file: ArrayBuffer) =>
  page
    .locator('#file')
    .setInputFiles({ name: 'actor.safetensors', mimeType: '', buffer: Buffer.from(file) });

const CHARTS = [
  /^−?\d\.\d\d N·m, σ \d\.\d\d, V −?\d+\.\d$/,
  /^−?\d\.\d\d N·m, σ \d\.\d\d$/,
  /^−?\d\.\d\d N·m, σ \d\.\d\d, V −?\d+\.\d$/,
  /^likeliest \d+%, V −?\d+\.\d$/,
];

const SIZES = [
  [320, 568],
  [390, 844],
  [844, 390],
  [768, 1024],
  [1024, 768],
  [1440, 900],
] as const;

/// At any size the chart with its numbers and the pendulum are visible together.
async function expectFits(page: Page): Promise<void> {
  for (const [width, height] of SIZES) {
    await page.setViewportSize({ width, height });
    const seen = await page.evaluate(async () => {
      await globalThis.drawn(); // drawings adapt to the size a frame later
      document.getElementById('stage')!.scrollIntoView({ behavior: 'instant' });
      const caption = document.querySelector('#q-figure figcaption')!;
      const figure = document.getElementById('q-figure')!.getBoundingClientRect();
      return {
        scrolls: document.documentElement.scrollWidth > innerWidth,
        cut: caption.scrollWidth > caption.clientWidth,
        inside: figure.left >= 0 && figure.right <= innerWidth,
        lines: Math.round(caption.clientHeight / parseFloat(getComputedStyle(caption).lineHeight)),
      };
    });
    expect(seen, `${width} × ${height}`).toEqual({
      scrolls: false,
      cut: false,
      inside: true,
      lines: 1,
    });
  }
}

test('an actor has its own chart at any size, and Q-values return with a Q-network', async ({
  stage: page,
}) => {
  await open(page);
  await expect(page.locator('#q-name')).toHaveText('Q-values');
  for (const [i, file] of actorFiles().entries()) {
    await bring(page, file);
    await expect(page.locator('#message-text')).toContainText('is the agent now');
    await expect(page.locator('#q-value')).toHaveText(CHARTS[i]!);
    await expect(page.locator('#q-name')).toHaveText('Policy');
    await expect(page.locator('#q')).toHaveAccessibleName(/^Policy: /);
    await expect(page.locator('#agent-text')).toContainText(' policy 8-');
    await expect(page.locator('label[for=torque_limit]')).toContainText('agent: ±5');
    if (i === 0) await expectFits(page); // the others' numbers are as long or shorter
    await page.locator('#agent').selectOption('d3qn');
    await expect(page.locator('#q-name')).toHaveText('Q-values');
    expect(await page.locator('#message').isHidden()).toBe(true); // that was another agent
    await expect(page.locator('#q-value')).toHaveText(/^best \d+ points, worst [\d.]+ less$/);
  }
});

test('the curve is centred on its mean, and moves with the observation', async ({
  stage: page,
}) => {
  await open(page);
  await page.locator('#pause').click();
  /// Place of the mean's line (0 left, 1 right), and the painted share of the chart.
  const chart = () =>
    page.evaluate(async () => {
      await globalThis.drawn();
      const canvas = document.getElementById('q') as HTMLCanvasElement;
      const { width, height } = canvas;
      const { data } = canvas.getContext('2d')!.getImageData(0, 0, width, height);
      // The top rows contain only the curve's own peak.
      const alpha = (x: number, y: number) => data[4 * (y * width + x) + 3]!;
      let painted = 0;
      for (let at = 3; at < data.length; at += 4) painted += data[at]! > 0 ? 1 : 0;
      const ratio = canvas.width / canvas.clientWidth;
      const { torque } = upswing.world.decision!;
      const at = 10 + ((torque + 5) / 10) * (canvas.clientWidth - 20);
      const column = Math.floor(at * ratio);
      let line = 0;
      const rows = Math.round((canvas.clientHeight - 24) * ratio);
      for (let y = Math.round(6 * ratio); y < rows; ++y) line += alpha(column, y) > 200 ? 1 : 0;
      return { painted: painted / (width * height), line: line / rows, mean: torque };
    });
  const means = new Set<number>();
  for (const file of actorFiles().slice(0, 3)) {
    await bring(page, file);
    await expect(page.locator('#agent')).toHaveValue('own');
    for (const q1 of [0, 1, -2]) {
      await startFrom(page, q1);
      const { painted, line, mean } = await chart();
      expect(painted).toBeGreaterThan(0.03);
      expect(line).toBeGreaterThan(0.85);
      means.add(Math.round(100 * mean));
    }
    await page.locator('#agent').selectOption('d3qn');
    await expect(page.locator('#agent')).toHaveValue('d3qn');
  }
  expect(means.size).toBeGreaterThan(6);
});

test('its torque equals that of `upswing simulate`', async ({ stage: page }, info) => {
  await open(page);
  for (const [i, file] of actorFiles().entries()) {
    const path = info.outputPath(`actor${i}.safetensors`);
    writeFileSync(path, Buffer.from(file));
    await bring(page, file);
    await expect(page.locator('#agent')).toHaveValue('own');
    await page.evaluate(() => (upswing.world.agentOn = true));
    await startFrom(page, 1);
    const rows = await run(page, 2);
    const expected = simulate(path, '--start', '1,0,0,0', '--seconds', '2');
    expect(rows.length).toBe(100);
    rows.forEach((row, k) => {
      for (const column of [1, 2, 3, 4, 5]) {
        expect(Math.abs(row[column]! - expected[k]![column]!)).toBeLessThan(1e-3);
      }
    });
    expect(new Set(rows.map((row) => row[5])).size).toBeGreaterThan(i === 3 ? 1 : 40);
    // So that the arrival of the next one is visible.
    await page.locator('#agent').selectOption('d3qn');
    await expect(page.locator('#agent')).toHaveValue('d3qn');
  }
});

test('the explanation is below, and the chart keeps moving', async ({ stage: page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await open(page);
  await bring(page, actorFiles()[0]!);
  await expect(page.locator('#q-name')).toHaveText('Policy');
  await page.getByText('How the agent decides').click();
  const summary = page.getByText('Actors: SAC and PPO');
  await summary.click();
  await expect(page.getByText('the central 68% of them')).toBeInViewport();
  await page.locator('#stage').scrollIntoViewIfNeeded();
  await page.locator('#agent-on').click();
  const text = () => page.locator('#q-value').textContent();
  const before = await text();
  await expect.poll(text).not.toBe(before);
});
