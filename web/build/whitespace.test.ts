import { expect, test } from 'vitest';
import { withoutIndentation } from './whitespace.ts';

test('indentation goes, words stay apart', () => {
  expect(withoutIndentation('<p>\n    one\n\n    <b>two</b>\n</p>')).toBe(
    '<p>\none\n<b>two</b>\n</p>',
  );
});
