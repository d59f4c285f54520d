import { expect, test } from 'vitest';
import { isCommand, printable, quoted, sentence, withMinus } from './text';

test('a message ends with one mark', () => {
  expect(sentence('it cannot be read')).toBe('it cannot be read.');
  expect(sentence('is there a loop without an end?')).toBe('is there a loop without an end?');
});

test('plain text stays as it is', () => {
  expect(printable('Dueling Double DQN, größer (π)')).toBe('Dueling Double DQN, größer (π)');
  expect(quoted('mass1')).toBe('"mass1"');
});

test.each([
  ['a\nb', 'a�b'],
  ['a\x1b[31mb', 'a�[31mb'],
  ['a\u202eb', 'a�b'],
  ['a\u2028b', 'a�b'],
  ['a\ud800b', 'a�b'],
])('%j is shown as %s', (text, shown) => {
  expect(printable(text)).toBe(shown);
});

test('long text is cut, between characters', () => {
  expect(printable('x'.repeat(61))).toBe(`${'x'.repeat(59)}…`);
  expect(printable('😀'.repeat(60))).toBe('😀'.repeat(60));
  expect(printable('😀'.repeat(1000), 5)).toBe('😀😀😀😀…');
  expect(printable('x'.repeat(1e6)).length).toBe(60);
});

test.each([
  './upswing train --agent d3qn --seed 1',
  "./upswing train --agent 'two words' --start-policy 'x; touch y; $(id)'",
  "./upswing train --out 'it'\\''s'",
])('%s may be pasted', (text) => {
  expect(isCommand(text)).toBe(true);
});

test.each([
  './upswing train --start-policy x; touch y',
  './upswing train --start-policy $(id)',
  './upswing train --start-policy `id`',
  './upswing train --start-policy a\ntouch y',
  "./upswing train --start-policy 'a\ntouch y'",
  "./upswing train --start-policy 'open",
  './upswing train --start-policy a&b',
  './upswing train > file',
  'rm -rf x',
  `./upswing train ${'x'.repeat(3000)}`,
])('%j is not shown for pasting', (text) => {
  expect(isCommand(text)).toBe(false);
});

test.each([
  ['-1.50 N·m', '−1.50 N·m'],
  ['-0.00', '0.00'],
  ['-0 rad/s', '0 rad/s'],
  ['-180°', '−180°'],
  ['0.25', '0.25'],
])('%j has a true minus sign, or none: %j', (text, shown) => {
  expect(withMinus(text)).toBe(shown);
});
