import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { expect, test } from 'vitest';
import { decodeText, encodeText, LONGEST_TEXT } from './link';

test('a link restores the lines', () => {
  for (const text of ['return 1;', 'if (q1 > π) {\n\treturn -5;\n}\n', '😀'.repeat(900)]) {
    expect(decodeText(`#${encodeText(text)}`)).toEqual({ text, problems: [] });
    expect(encodeText(text)).toMatch(/^write=[\w-]+$/);
  }
  expect(decodeText('#write')).toEqual({ text: null, problems: [] });
});

test.each([
  ['write=%00', 'write: the controller is damaged'],
  ['write=a', 'write: the controller is damaged'],
  ['write=__8', 'write: the controller is damaged'], // not UTF-8
  [
    encodeText('x'.repeat(LONGEST_TEXT + 1)),
    `write: expected a controller of at most ${LONGEST_TEXT} characters`,
  ],
  [
    `write=${'A'.repeat(1e6)}`,
    `write: expected a controller of at most ${LONGEST_TEXT} characters`,
  ],
  [encodeText('a\u202eb'), 'write: the controller has characters that cannot be seen'],
  [encodeText('a\0b'), 'write: the controller has characters that cannot be seen'],
])('%.40s is refused with a line', (hash, problem) => {
  expect(decodeText(`#${hash}`)).toEqual({ text: null, problems: [problem] });
});

test("the sandbox's policy allows its own script and nothing else, and the page's allows it", () => {
  const read = (name: string) => readFileSync(new URL(name, import.meta.url), 'utf8');
  const sandbox = read('sandbox.html');
  const [, script] = /<script>(.*?)<\/script>/s.exec(sandbox)!;
  const hash = createHash('sha256').update(script!).digest('base64');
  expect(sandbox).toContain(
    `content="default-src 'none'; script-src 'sha256-${hash}'; worker-src data:"`,
  );
  expect(read('../../index.html')).toContain(
    `script-src 'self' 'wasm-unsafe-eval' 'sha256-${hash}';`,
  );
});
