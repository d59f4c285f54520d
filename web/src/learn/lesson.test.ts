import { expect, test } from 'vitest';
import { questionOf } from './lesson';

const example = { update: 7, torque: 5, epsilon: 0, remembered: 1, capacity: 2 };
const ask = (guess: number, reward: number, target: number, corrected: number) =>
  questionOf({ ...example, guess, reward, target, corrected }, 0.1);

test('the numbers of an update add up as they are shown, in tenths of a point', () => {
  const asked = ask(0.094, 0.434, 0.744, 0.349)!;
  expect(asked).toMatchObject({ guess: 9, reward: 43, next: 31, target: 74, corrected: 35 });
  expect(ask(0.5, 0.166, 0.333, 0.4)).toMatchObject({ reward: 17, next: 16, target: 33 });
});

test.each([
  ['away from its target', 0.49, 0.43, 0.63, 0.42],
  ['not at all', 52.1, 0.4, 55, 52.104],
  ['hardly', 0.5, 0.1, 2, 0.52],
  ['past its target', 0.5, 0.1, 0.6, 0.8],
  ['without a gap', 0.5, 0.1, 0.5, 0.6],
])('no question about an update that moves %s', (_, guess, reward, target, corrected) => {
  expect(ask(guess, reward, target, corrected)).toBeNull();
});
