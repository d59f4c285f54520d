import { readFileSync } from 'node:fs';
import { expect, test } from 'vitest';
import { resultOf, winnerOf } from './race';
import { nameOf } from './rivals';

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

test('the claim about our study holds in its table', () => {
  const read = (path: string) => readFileSync(new URL(path, import.meta.url), 'utf8');
  expect(read('../../index.html').replace(/\s+/g, ' ')).toContain(
    'In our study with 20 seeds each, dueling halved the steps and Double made no clear difference.',
  );
  const table = read('../../../docs/results/agents.md').split('<!-- table: dueling -->')[1]!;
  const steps = (variant: string) => {
    const cells = table.split(`\n| ${variant} | `)[1]!.split(' | ');
    return { iqm: Number(cells[1]!.replace(',', '')), interval: cells[2]! };
  };
  expect(steps('no dueling').iqm / steps('`fast`').iqm).toBeCloseTo(2, 1);
  expect(steps('no Double DQN').interval).toMatch(/^-.* to \+/); // it contains 0
});
