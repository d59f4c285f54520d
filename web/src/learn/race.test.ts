import { expect, test } from 'vitest';
import { nameOf, resultOf, winnerOf } from './race';

test('a contender has the name of its method, or its changed settings', () => {
  expect(nameOf('fast', {})).toBe('Dueling Double DQN');
  expect(nameOf('fast', { dueling: 'false', double: 'false' })).toBe('DQN');
  expect(nameOf('sac-fast', {})).toBe('SAC');
  expect(nameOf('fast', { balance_weight: '0' })).toBe('Dueling Double DQN (balance weight 0)');
});

test('the median decides, and one run that is not faster is told', () => {
  expect(winnerOf([1, 2, 3], [4, 5, 6])).toEqual({ side: 0, always: true });
  expect(winnerOf([4, 5, Infinity], [1, 2, 4])).toEqual({ side: 1, always: false });
  expect(winnerOf([1, 2, 9], [1, 2, 3])).toBeNull();
  expect(winnerOf([1, Infinity, Infinity], [1, Infinity, Infinity])).toBeNull();
});

test('the result in words', () => {
  expect(
    resultOf(
      ['A', 'B'],
      [
        [1000, 2000, 3000],
        [4000, 5000, Infinity],
      ],
    ),
  ).toBe(
    'A wins with every seed. Steps to solve, smallest to largest of 3 seeds. A: 1,000 to 3,000. ' +
      'B: 4,000 to not solved.',
  );
  expect(
    resultOf(
      ['A', 'B'],
      [
        [1, 4, 9],
        [1, 2, 3],
      ],
    ),
  ).toMatch(/^B wins in the median, but not/);
});
