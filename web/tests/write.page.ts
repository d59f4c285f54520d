import { createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import { expect } from '@playwright/test';
import type { Page } from '@playwright/test';
import { encodeText } from '../src/write/link';
import { hurryTimers, open, test } from './page';

/// A visitor's controller: on the stage, scored, shared, and kept in its sandbox.

/// Replaces the lines and runs them.
async function run(page: Page, text: string): Promise<void> {
  await page.locator('#write-text').fill(text);
  await page.locator('#write-run').click();
}

const problem = (page: Page) => page.locator('#write-problem');
const elapsed = (page: Page) => page.evaluate(() => upswing.world.elapsed);

test('the first lines swing up, and the keyboard can write, run and leave', async ({
  stage: page,
}) => {
  await open(page, '#write');
  const text = page.locator('#write-text');
  await text.focus();
  await page.keyboard.press('Control+Home');
  await page.keyboard.type('// g r .\n');
  await page.keyboard.press('Control+Enter');
  await expect.poll(() => page.evaluate(() => Math.abs(upswing.world.byHand))).toBe(5);
  await expect.poll(() => page.evaluate(() => Math.abs(upswing.world.state.q1))).toBeGreaterThan(1);
  expect(await page.evaluate(() => upswing.world.agentOn)).toBe(false);
  await page.keyboard.press('Tab');
  await expect(page.locator('#write-run')).toBeFocused();
  await page.locator('#write-stop').click();
  expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
  await expect(page.locator('#write-stop')).toBeDisabled();
});

test('the same lines get the same score, next to agents', async ({ stage: page }) => {
  await open(page, '#write');
  const own = page.locator('#write-own');
  await page.getByText('Hint', { exact: true }).click();
  await page.locator('#write-hint').click();
  await page.locator('#write-score').click();
  await expect(own).toContainText('Yours');
  const first = await own.innerText();
  expect(first).toMatch(/[1-9] of 10\s+\d\.\d s\s+\d{3,}/);
  await expect(page.locator('#write-lqr')).toContainText('0 of 10');
  await expect(page.locator('#write-energy')).toContainText(/\d of 10/);
  await expect(page.locator('#write-score')).toBeEnabled();
  await page.locator('#write-text').press('Control+End');
  await page.locator('#write-score').click();
  await expect(own).toHaveText(first.replaceAll('\t', ''));
});

test.describe('one line and its row for', () => {
  for (const [name, text, expected] of [
    ['a syntax error', 'const a = 1;\nreturn a +* 2;', /^Row 2: SyntaxError/],
    ['an open bracket', 'if (q1 > 0) {\nreturn 1;', /^Row 2: SyntaxError.*bracket/],
    ['an error', 'let a;\n\nreturn a.b;', /^Row 3: TypeError/],
    ['anything thrown', '\nthrow "no";', /^Row 2: no/],
    ['NaN', 'const a = 0 / 0;\nreturn a;', /^Row 2: it returned NaN at t = 0\.00 s\.$/],
    ['a text', 'return "5";', /^Row 1: it returned string instead of a number/],
    ['nothing', 'q1 + 1;', /^it returned undefined instead of a number/],
    ['a huge text', 'let s = "x";\nwhile (true) s += s;', /^Row 2: RangeError/],
    ['chance', 'return Math.random();', /the same score/],
    ['an endless loop', 'for (;;);', /^no torque after 3 s: is there a loop/],
    ['a name of the page', 'return document.title;', /^Row 1: ReferenceError: document/],
  ] as const) {
    test(name, async ({ stage: page }) => {
      await open(page, '#write');
      if (name === 'an endless loop') await hurryTimers(page, 6);
      await run(page, text);
      await expect(problem(page)).toHaveText(expected);
      await expect(page.locator('#write-stop')).toBeDisabled();
      expect(await page.locator('iframe').count()).toBe(0);
      // The page is alive.
      await page.locator('#reset').click();
      const before = await elapsed(page);
      await expect.poll(() => elapsed(page)).toBeGreaterThan(before);
    });
  }
});

/// Each ends the function, so that its code runs before any torque is asked for, and reports what it
/// reached as an error.
const report = (code: string) => `return 0; }\n${code}\nfunction later() { return 0;`;

test('reaches no network, no storage, no page, and runs no other code', async ({ stage: page }) => {
  await open(page, '#write');
  let requests = 0;
  const server = createServer((_, response) => {
    ++requests;
    response.writeHead(200, {
      'content-type': 'text/javascript',
      'access-control-allow-origin': '*',
    });
    response.end('export default 1;');
  });
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  const there = `http://127.0.0.1:${(server.address() as AddressInfo).port}/a.js`;
  const tries = [
    `fetch("${there}")`,
    'new WebSocket("wss://example.org/")',
    'new XMLHttpRequest()',
    `importScripts("${there}")`,
    'indexedDB.open("upswing")',
    'caches.open("a")',
    'new Worker("a.js")',
    'self.postMessage("a")',
    'postMessage("a")',
    'performance.now()',
    'new Date()',
    'new Function("return 1")()',
    '(() => {}).constructor("return 1")()',
    'globalThis.eval("1")',
    'setTimeout("1")',
  ].map((code) => `[${JSON.stringify(code)}, () => ${code}]`);
  await run(
    page,
    `const reached = [];
for (const [code, call] of [${tries.join()}]) {
  try { call(); reached.push(code); }
  catch (error) { if (!/^(Reference|Type|Eval)Error/.test(error)) reached.push(code + error); }
}
throw reached.join() || "reached nothing";`,
  );
  await expect(problem(page)).toHaveText(/^Row 6: reached nothing/);
  // An import fails later, as a promise.
  const here = new URL('/watch.js', page.url()).href;
  for (const from of [there, 'data:text/javascript,1', here]) {
    const then = 'throw Error("reached")';
    await run(page, report(`import("${from}").then(() => { ${then} }, () => {});`));
    await expect.poll(() => elapsed(page)).toBeGreaterThan(0.1);
    await expect(problem(page)).toHaveText('');
  }
  server.close();
  expect(requests).toBe(0);
});

test('floods and altered prototypes end it, and nothing else', async ({ stage: page }) => {
  await open(page, '#write');
  const strange = 'it sent something other than a torque.';
  // The port to the page, from its own message.
  const withPort = (code: string) =>
    report(
      `globalThis.constructor; Function.prototype.bind = function () { ${code} return () => {}; };`,
    );
  await run(
    page,
    withPort(
      'const port = arguments[0]; for (let i = 0; i < 1e4; ++i) port.postMessage("x".repeat(1e5));',
    ),
  );
  await expect(problem(page)).toHaveText(strange);
  await run(page, withPort('arguments[0].postMessage(new Float64Array([NaN]));'));
  await expect(problem(page)).toHaveText(strange);
  await run(page, withPort('arguments[0].postMessage([1, "<b>x</b>"]);'));
  await expect(problem(page)).toHaveText(strange);
  await run(
    page,
    'Object.prototype.isTrusted = 1; Array.prototype.map = null;\n' +
      'Number.isNaN = () => false; Object.defineProperty(Object.prototype, "then", { get() { throw 1; } });\n' +
      'return { valueOf: () => 5 };',
  );
  await expect(problem(page)).toHaveText(/it returned object instead of a number/);
  expect(await page.evaluate(() => 'then' in {} || 'isTrusted' in {})).toBe(false);
});

test('a sent controller is shown, and runs only after a click', async ({ stage: page }) => {
  const text = 'return 3;\n// <img src=x onerror=alert(1)> π';
  await open(page, `#${encodeText(text)}`);
  await expect(page.locator('#write-sent')).toBeVisible();
  await expect(page.locator('#write-text')).toHaveValue(text);
  expect(await page.locator('iframe').count()).toBe(0);
  expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
  await page.locator('#write-run').click();
  await expect.poll(() => page.evaluate(() => upswing.world.byHand)).toBe(3);
  // The visitor's own lines are kept.
  await open(page, '#write');
  await expect(page.locator('#write-sent')).toBeHidden();
  await expect(page.locator('#write-text')).toHaveValue(/Push the way/);
});

test('a link gives the lines to others, and a bad one gives one line', async ({ stage: page }) => {
  await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await open(page, '#write');
  await page.locator('#write-text').fill('return 1;');
  await page.locator('#write-share').click();
  await expect(page.locator('#message')).toContainText('The link is in the clipboard');
  const link = new URL(await page.evaluate(() => navigator.clipboard.readText()));
  expect(link.hash).toBe(`#${encodeText('return 1;')}`);
  await open(page, '#write=%%%');
  await expect(page.locator('#message')).toContainText('write: the controller is damaged');
});

test('leaving the view ends it', async ({ stage: page }) => {
  await open(page, '#write');
  await run(page, 'return 2;');
  await expect.poll(() => page.evaluate(() => upswing.world.byHand)).toBe(2);
  await open(page, '#everything');
  expect(await page.locator('iframe').count()).toBe(0);
  expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
});
