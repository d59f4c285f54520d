import { createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import { runInNewContext } from 'node:vm';
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
  expect(first).toMatch(/10 of 10\s+\d\.\d s\s+\d{3,}/);
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
    ['an endless loop', 'for (;;);', /^no torque after 3 s: is there a loop without an end\?$/],
    ['a name of the page', 'return document.title;', /^Row 1: ReferenceError: document/],
    [
      'an import',
      'const a = 1;\nreturn import("x");',
      /^Row 2: a controller cannot use .* import\.$/,
    ],
    ['a hidden import', 'return \\u0069mport("x");', /^Row 1: SyntaxError/],
    ["the visitor's language", 'return (1.5).toLocaleString();', /^Row 1: TypeError/],
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
  await run(page, `import("${there}").then(() => { throw Error("reached") }, () => {});`);
  await expect(problem(page)).toHaveText('Row 1: a controller cannot use the word import.');
  server.close();
  expect(requests).toBe(0);
});

test.describe('lines that leave their function run nothing:', () => {
  // What would be hoisted over the sandbox's own names, and what would hide the end of the function.
  for (const text of [
    'return 0; }\nfunction addEventListener() {}\nfunction later() { return Math.random();',
    'return 0; }\nfunction Object() {}\nfunction later() { return new Date().getTime();',
    'return 0; }\nvar Set = 1;\n{',
    'return 0; } // one\nclass globalThis {}\nfunction torque() { return 1;',
    'return 0; /* } */ }\n<!-- {\nnew Worker("data:,");{',
    'return 0; }\n--> {\nimportScripts("data:,"); {',
    'return `}` ? 0 : 1; }\nsetInterval(() => {});{',
    'return 0; }, function () {',
    'return 0; }\nconst SOURCE_LENGTH = 0; {',
    'return 0; }\nthrow "it ran"; function torque(q1, q2, w1, w2, t) {\nreturn 0;',
  ]) {
    test(JSON.stringify(text), async ({ stage: page }) => {
      await open(page, '#write');
      await run(page, text);
      await expect(problem(page)).toHaveText(
        /^(a bracket in row \d closes the controller's function|Row \d: SyntaxError.*)\.$/,
      );
      expect(await page.evaluate(() => upswing.world.byHand)).toBe(0);
    });
  }
});

test('lines that stay in their function run, whatever they look like', async ({ stage: page }) => {
  await open(page, '#write');
  await run(
    page,
    'const end = "}", half = "\ud800"; // }\nconst re = /}/; `}${`}`}`; <!-- }\nreturn 3; /* } */ // π',
  );
  await expect.poll(() => page.evaluate(() => upswing.world.byHand)).toBe(3);
  await expect(problem(page)).toHaveText('');
});

/// Parts of the language that tell the time, draw at random or start threads.
const REFUSED_LANGUAGE = [
  ...['Atomics', 'Date', 'FinalizationRegistry', 'Intl', 'SharedArrayBuffer', 'WeakRef'],
  ...['WebAssembly', 'eval', 'now', 'random', 'localeCompare', 'toLocaleString', 'get timeStamp'],
];

test('nothing of the browser can be reached, by no prototype and no property', async ({
  stage: page,
}) => {
  await open(page, '#write');
  const language = new Set(runInNewContext('Object.getOwnPropertyNames(globalThis)') as string[]);
  const names = await page.evaluate(() => {
    const names: string[] = [];
    for (let scope: unknown = window; scope !== null; scope = Object.getPrototypeOf(scope)) {
      if (scope !== Object.prototype) names.push(...Object.getOwnPropertyNames(scope));
    }
    return names;
  });
  const shared = ['constructor', 'find']; // the language has its own
  const refused = [
    ...names.filter((name) => !language.has(name) && !shared.includes(name)),
    ...REFUSED_LANGUAGE,
  ];
  expect(refused).toContain('performance');
  // Visits every object that the language leads to, and throws the functions with a refused name.
  const text = `const refused = new Set(${JSON.stringify(refused)}), seen = new Set(), reached = new Set();
const waiting = [
  globalThis, arguments, (async () => {})(), async () => {}, function* () {}, async function* () {},
  (function* () {})(), (async function* () {})(), [].values(), new Map().keys(), new Set().keys(),
  "a".matchAll(/a/g), /a/.exec("a"), "", 1, true, 1n, Symbol(), new Float64Array(1), class {},
  new Error("a"), Object.getOwnPropertyDescriptor(class { get a() { return 1; } }.prototype, "a"),
].map(Object);
while (waiting.length > 0) {
  const one = waiting.pop();
  if (seen.has(one)) continue;
  seen.add(one);
  if (typeof one === "function") reached.add(one.name);
  const own = [...Object.getOwnPropertyNames(one), ...Object.getOwnPropertySymbols(one)];
  const found = own.flatMap((name) => Object.values(Object.getOwnPropertyDescriptor(one, name)));
  for (const next of [Object.getPrototypeOf(one), ...found]) if (Object(next) === next) waiting.push(next);
}
const wrong = [...reached].filter((name) => refused.has(name));
throw wrong.join() || (reached.has("Promise") ? "only the language" : "too little");`;
  await page.evaluate((text) => {
    // Longer than a visitor may write.
    document.querySelector<HTMLTextAreaElement>('#write-text')!.value = text;
  }, text);
  await page.locator('#write-run').click();
  await expect(problem(page)).toHaveText(/^Row \d+: only the language\.$/);
});

test("an error's stack is the same in each run", async ({ stage: page }) => {
  await open(page, '#write');
  // A hash, because a stack is long.
  const text =
    'let hash = 0;\nconst { stack, fileName } = new Error("a");\n' +
    'for (const c of stack + fileName) hash = (31 * hash + c.codePointAt(0)) | 0;\nthrow "hash " + hash;';
  const hashes = [];
  for (let i = 0; i < 2; ++i) {
    await run(page, text);
    await expect(problem(page)).toHaveText(/^Row 4: hash -?\d+\.$/);
    hashes.push(await problem(page).innerText());
  }
  expect(hashes[0]).toBe(hashes[1]);
});

test('altered prototypes change nothing outside', async ({ stage: page }) => {
  await open(page, '#write');
  await run(
    page,
    'Object.prototype.isTrusted = 1; Array.prototype.map = null;\n' +
      'Number.isNaN = () => false; Object.defineProperty(Object.prototype, "then", { get() { throw 1; } });\n' +
      'return { valueOf: () => 5 };',
  );
  await expect(problem(page)).toHaveText(/it returned object instead of a number/);
  expect(await page.evaluate(() => 'then' in {} || 'isTrusted' in {})).toBe(false);
  // Hooks that would see the port or an event, which tells the time.
  await run(
    page,
    `if (t > 0.1) return globalThis.seen === undefined ? 3 : NaN;
const hook = { value() { globalThis.seen = this; }, configurable: true };
const types = [Array, Object, Function, Float64Array, Object.getPrototypeOf(Float64Array)];
const names = ["bind", "call", "apply", "subarray", "push", "then", Symbol.iterator];
const define = Object.defineProperty;
for (let i = 0; i < types.length; ++i) {
  for (let k = 0; k < names.length; ++k) define(types[i].prototype, names[k], hook);
}
return 3;`,
  );
  await expect.poll(() => page.evaluate(() => upswing.world.byHand)).toBe(3);
  await expect.poll(() => elapsed(page)).toBeGreaterThan(0.2);
  await expect(problem(page)).toHaveText('');
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
