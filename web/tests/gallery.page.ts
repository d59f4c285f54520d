import { readdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { open, test } from './page';

/// The gallery, and that every link to the page in it and in the documentation is understood.

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const DOCS = new URL('../../docs/', import.meta.url).pathname;
const ADDRESS = /http:\/\/localhost:4173\/(#[^)`\s]+)/g;

/// The links into the page in all pages of the documentation.
function linksOfDocs(): string[] {
  const names = readdirSync(DOCS, { recursive: true, encoding: 'utf8' });
  const texts = names
    .filter((name) => name.endsWith('.md'))
    .map((name) => readFileSync(join(DOCS, name), 'utf8'));
  return texts.flatMap((text) => Array.from(text.matchAll(ADDRESS), ([, hash]) => hash!));
}

async function openGallery(page: Page, text?: string): Promise<void> {
  if (text !== undefined)
    await page.route('**/gallery.txt', (route) => route.fulfill({ body: text }));
  await page.goto('./gallery.html');
  await expect(page.locator('html')).toHaveAttribute('data-shown', '');
}

const links = (page: Page) =>
  page
    .locator('#groups a')
    .evaluateAll((found) => found.map((link) => new URL((link as HTMLAnchorElement).href).hash));

test('every link of the gallery and of the documentation is understood', async ({
  page,
  context,
}) => {
  await openGallery(page);
  await expect(page.locator('#problem')).toBeHidden();
  const ofGallery = await links(page);
  expect(ofGallery.length).toBeGreaterThan(8);
  const ofDocs = linksOfDocs().filter((hash) => !hash.includes('agent=fast-seed1')); // the reader's own
  expect(ofDocs.length).toBeGreaterThan(8);
  const stage = await context.newPage();
  for (const hash of new Set([...ofGallery, ...ofDocs])) {
    await open(stage, hash);
    await expect(stage.locator('#message'), hash).toBeHidden();
    const { learn, write, ghost } = Object.fromEntries(new URLSearchParams(hash.slice(1)));
    if (learn) {
      await expect(stage.locator('#learn-updates'), hash).not.toHaveText('0');
      await expect(stage.locator('#reward-problem'), hash).toHaveText('');
      await stage.evaluate(() => upswing.learn.stop());
    }
    if (write) await expect(stage.locator('#write-text'), hash).toHaveValue(/return/);
    if (ghost) await expect(stage.locator('#tour')).toContainText(/Beat \d\.\d s/);
  }
});

test('a teacher’s entries lead into the page only, and a missing link is named', async ({
  page,
}) => {
  const text = [
    '# a comment',
    '= Class 10b',
    'Ada',
    'https://elsewhere.example/#write=cmV0dXJuIDU7',
    'Falls <b>soon</b>.',
    '',
    '== Rewards',
    'Grace',
    'javascript:alert(1)',
  ];
  await openGallery(page, text.join('\r\n'));
  await expect(page).toHaveTitle('Upswing: Class 10b');
  expect(await links(page)).toEqual(['#write=cmV0dXJuIDU7']);
  const address = await page.locator('#groups a').evaluate((link: HTMLAnchorElement) => link.href);
  expect(new URL(address).host).toBe(new URL(page.url()).host);
  await expect(page.locator('#groups')).toContainText('Falls <b>soon</b>.');
  await expect(page.locator('#problem')).toHaveText(
    'gallery.txt, row 8: "Grace" has no link into the page below it.',
  );
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds no problem in the ${colorScheme} gallery`, async ({ page }) => {
    await page.emulateMedia({ colorScheme });
    await openGallery(page);
    const problems = await page.evaluate(`${axe}; axe.run().then(({ violations }) =>
      violations.map(({ id, nodes }) => id + ' of ' + nodes[0].html))`);
    expect(problems).toEqual([]);
  });
}
