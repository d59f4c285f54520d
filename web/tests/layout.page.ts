import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, test } from './page';

/// Layout at many sizes of the window: nothing covers anything else.

const WIDTHS = [360, 700, 768, 1024, 1440, 1920];
const HEIGHTS = [600, 1100];
const SIZES = WIDTHS.flatMap((width) => HEIGHTS.map((height) => ({ width, height })));

/// 1280 × 1024 at 400%, phones upright and on their side, small windows.
const SMALL = [
  { width: 320, height: 256 },
  { width: 360, height: 300 },
  { width: 375, height: 553 },
  { width: 667, height: 320 },
  { width: 844, height: 390 },
  { width: 900, height: 280 },
  { width: 1300, height: 240 },
];

const openDetails = (page: Page) =>
  page.evaluate(() => {
    for (const details of document.querySelectorAll('details')) details.open = true;
  });

/// Opens the page at a size with all explanations open.
async function openAt(page: Page, size: { width: number; height: number }): Promise<void> {
  await page.setViewportSize(size);
  await open(page, '#agent=any-pose'); // which has a row of buttons more
  await openDetails(page);
}

/// Runs in the page: links, controls and texts that something else covers.
function covered(): string[] {
  const wanted = 'a, button, input, select, summary, label, p, li, figcaption, math[display]';
  const hidden = '[hidden], .visually-hidden, #live, #loading, noscript';
  const wrong: string[] = [];
  for (const one of document.querySelectorAll(wanted)) {
    if (one.closest(hidden) || !one.checkVisibility()) continue;
    for (const block of ['nearest', 'start', 'end'] as const) {
      one.scrollIntoView({ block, behavior: 'instant' });
      const { x, y, width: w, height: h } = one.getClientRects()[0]!; // the first line
      const top = document.elementFromPoint(x + w / 2, y + h / 2);
      if (top && (one.contains(top) || top.contains(one))) continue;
      wrong.push(`${one.outerHTML.slice(0, 80)} (${block}): ${top?.outerHTML.slice(0, 80)}`);
    }
  }
  return wrong;
}

/// Runs in the page: what the pendulum covers while the page scrolls.
function overlaps(): string[] {
  const others = [...document.querySelectorAll('#charts figure, aside, details, footer')];
  const stage = document.getElementById('stage')!;
  const found = new Set<string>();
  for (let y = 0; y < document.documentElement.scrollHeight; y += 90) {
    scrollTo({ top: y, behavior: 'instant' });
    const a = stage.getBoundingClientRect();
    for (const other of others) {
      const b = other.getBoundingClientRect();
      const apart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top;
      if (!apart && b.bottom > a.top) found.add(other.textContent.trim().slice(0, 40));
    }
  }
  return [...found];
}

test('at any size nothing covers anything else, and the pendulum keeps its size', async ({
  stage: page,
}) => {
  await openAt(page, SIZES[0]!);
  await expect(page.locator('#reward')).not.toBeEmpty();
  await page.locator('#pause').click(); // the longest badge
  for (const size of [...SMALL, ...SIZES]) {
    await page.setViewportSize(size);
    const what = JSON.stringify(size);
    if (!SMALL.includes(size)) expect(await page.evaluate(covered), what).toEqual([]);
    expect(await page.evaluate(overlaps), what).toEqual([]);
    const { scene, badge, stage, pose, scrolls } = await page.evaluate(() => {
      const box = (id: string) => document.getElementById(id)!.getBoundingClientRect().toJSON();
      return {
        ...{ scene: box('scene'), badge: box('badge'), stage: box('stage'), pose: box('pose') },
        scrolls: document.documentElement.scrollWidth > innerWidth,
      };
    });
    expect(Math.min(scene.width, scene.height), what).toBeGreaterThanOrEqual(170);
    expect(badge.bottom, what).toBeLessThanOrEqual(scene.top);
    // Nothing on the stage sticks out of it.
    expect(pose.bottom, what).toBeLessThanOrEqual(stage.bottom);
    expect(scrolls, what).toBe(false);
  }
});

test('on phones and tablets pendulum and Q-values are on one screen', async ({ stage: page }) => {
  await open(page);
  for (const [width, height] of [
    [360, 640],
    [375, 553],
    [390, 664],
    [412, 915],
    [768, 1024],
    [820, 1180],
    [1024, 768],
    [844, 390],
    [1180, 820],
    [1280, 720],
  ] as const) {
    await page.setViewportSize({ width, height });
    await page.evaluate(() => {
      scrollTo({ top: 0, behavior: 'instant' });
      document.getElementById('stage')!.scrollIntoView({ behavior: 'instant' });
    });
    const boxes = [page.locator('#scene'), page.locator('#q')];
    for (const box of boxes) await expect(box, `${width} × ${height}`).toBeInViewport({ ratio: 1 });
  }
});

test('an example leads back to the pendulum, even the second time', async ({ stage: page }) => {
  await page.setViewportSize({ width: 390, height: 700 });
  await page.emulateMedia({ reducedMotion: 'reduce' });
  await open(page);
  const example = page.locator('#try a').first();
  for (let k = 0; k < 2; ++k) {
    await page.locator('#pause').click();
    await example.evaluate((link) => link.scrollIntoView({ behavior: 'instant' }));
    await expect(page.locator('#scene')).not.toBeInViewport();
    if (k === 1) {
      // The same example again, whatever the address is now.
      await example.evaluate((link) => history.replaceState(null, '', link.getAttribute('href')));
    }
    await example.press('Enter');
    await expect(page.locator('#scene')).toBeInViewport({ ratio: 1 });
    await expect(page.locator('#stage')).toBeFocused();
    await expect(page.locator('#agent-on')).toHaveAttribute('aria-pressed', 'true');
    await expect(page.locator('#badge')).toHaveText(/swinging up|balanced/); // no longer paused
  }
});

test('a message stays in sight while the page scrolls', async ({ stage: page }) => {
  await page.setViewportSize({ width: 360, height: 640 });
  await open(page);
  await page.locator('#file').scrollIntoViewIfNeeded();
  await page.evaluate(() => scrollTo(0, document.documentElement.scrollHeight));
  const buffer = Buffer.from('no policy');
  const name = `${'long '.repeat(100)}\u202ename\n.safetensors`;
  await page.locator('#file').setInputFiles({ name, mimeType: '', buffer });
  await expect(page.locator('#message')).toBeInViewport({ ratio: 1 });
  const text = (await page.locator('#message-text').textContent())!;
  expect(text.length).toBeLessThan(200);
  expect(text).not.toMatch(/[\n\u202e]/);
  await page.locator('#message-close').click();
  await expect(page.locator('#message')).toBeHidden();
});

test('a formula that is too wide takes the focus and scrolls by keyboard', async ({
  stage: page,
}) => {
  await openAt(page, { width: 340, height: 640 });
  const wide = page.locator('details:has-text("learns the two separately") > math');
  await wide.evaluate((math) => (math.style.fontSize = '300%')); // too wide in any font
  await expect(wide).toHaveAttribute('tabindex', '0');
  await wide.focus();
  await expect(wide).toBeFocused();
  await page.keyboard.press('ArrowRight');
  await expect.poll(() => wide.evaluate((math) => math.scrollLeft)).toBeGreaterThan(0);
  expect(await page.evaluate(() => upswing.world.push)).toBeNull(); // does not shove
  await wide.evaluate((math) => math.removeAttribute('style'));
  await page.setViewportSize({ width: 740, height: 900 });
  await expect(wide).not.toHaveAttribute('tabindex');
});

test.describe('with forced colours', () => {
  for (const colorScheme of ['light', 'dark'] as const) {
    test(`${colorScheme}: button and pendulum are visible`, async ({ stage: page }) => {
      await page.emulateMedia({ forcedColors: 'active', colorScheme });
      await open(page, '#on=1');
      await page.locator('#pause').click();
      // No backplate between the button's text and its background.
      const button = await page.locator('#agent-on').evaluate((one) => {
        const { color, backgroundColor, forcedColorAdjust } = getComputedStyle(one) as never as {
          [name: string]: string;
        };
        return { color, backgroundColor, forcedColorAdjust };
      });
      expect(button.forcedColorAdjust).toBe('none');
      expect(button.color).not.toBe(button.backgroundColor);
      const filled = await page.locator('.filled, #learn-start').evaluateAll((all) =>
        all.map((one) => {
          const { color, backgroundColor, forcedColorAdjust } = getComputedStyle(one) as never as {
            [name: string]: string;
          };
          return forcedColorAdjust === 'none' && color !== backgroundColor;
        }),
      );
      expect(filled.length).toBeGreaterThan(2);
      expect(filled).not.toContain(false);
      // Opaque drawings: the light's cone hides neither links nor background.
      const drawn = await page.evaluate(() => {
        const { scene, world } = upswing;
        world.reset({ q1: Math.PI, q2: 0, w1: 0, w2: 0 });
        scene.draw(world, world.state, []);
        const { element, context: brush } = scene.canvas;
        const ratio = element.width / scene.canvas.width;
        const at = (x: number, z: number) => {
          const [px, py] = scene.at({ x, z });
          return brush.getImageData(px * ratio, py * ratio, 1, 1).data.join();
        };
        return { upper: at(0, 0.25), lower: at(0, 0.75), cone: at(0.2, 0.7), outside: at(0.5, 0) };
      });
      expect(drawn.cone).toBe(drawn.outside);
      expect(new Set([drawn.upper, drawn.lower, drawn.outside]).size).toBe(3);
    });
  }
});

test('"Run the agent" looks pressed while it is on', async ({ stage: page }) => {
  await open(page);
  const look = () =>
    page.locator('#agent-on').evaluate((button) => {
      const { backgroundColor, boxShadow } = getComputedStyle(button);
      const light = backgroundColor
        .match(/[\d.]+/g)!
        .slice(0, 3)
        .map(Number);
      return { light: Math.max(...light), inset: boxShadow.includes('inset') };
    });
  const off = await look();
  await page.locator('#agent-on').click();
  const on = await look();
  expect([off.inset, on.inset]).toEqual([false, true]);
  expect(on.light).toBeLessThan(off.light); // in the shade, not blank
});
