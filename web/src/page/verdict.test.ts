import { expect, test } from 'vitest';
import { laterOf, textOf, verdictOf } from './verdict';

test('an agent that is upright has not lost yet', () => {
  expect(verdictOf(0, 6, 8)).toEqual({ one: false, many: true });
  expect(verdictOf(1.5, 6, 8)).toBeNull();
  expect(verdictOf(5.1, 6, 12)).toEqual({ one: true, many: true });
  expect(verdictOf(0, 0, 19)).toBeNull();
  expect(verdictOf(0, 0, 20)).toEqual({ one: false, many: false });
  expect(verdictOf(3, 0, 20)).toBeNull(); // until it falls or stays
});

test('a verdict says who was right, and names later changes', () => {
  const many = { one: false, many: true };
  expect(textOf(many, true)).toMatch(/^You were right: only the agent that learned on many/);
  expect(textOf(many, false)).toMatch(/^You lost/);
  expect(textOf({ one: true, many: false }, false)).toMatch(/^You were right/);
  expect(laterOf(many, 0, 9)).toBe('');
  expect(laterOf(many, 3, 9)).toBe(' Later the other one got up, too.');
});
