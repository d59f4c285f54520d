import type { Session } from './session';

/// A race of two settings, each trained with the same seeds.

export const RACE_SEEDS = 3;

/// Sorted steps to solve of a side's runs; infinite for a run that did not solve the task. Null
/// before all have ended.
export function stepsToSolve(sessions: readonly Session[]): number[] | null {
  if (sessions.some(({ state }) => state !== 'finished' && state !== 'failed')) return null;
  return sessions.map(({ last }) => (last?.solved ? last.steps : Infinity)).sort((a, b) => a - b);
}

/// The side that needed fewer steps in the median, and whether each of its runs did; null for a
/// draw.
export function winnerOf(
  one: readonly number[],
  two: readonly number[],
): { side: 0 | 1; always: boolean } | null {
  const median = (steps: readonly number[]) => steps[Math.floor(steps.length / 2)]!;
  if (median(one) === median(two)) return null;
  const side = median(one) < median(two) ? 0 : 1;
  const [fewer, more] = side === 0 ? [one, two] : [two, one];
  return { side, always: fewer.at(-1)! < more[0]! };
}

/// The result in words, for two names and their sorted steps to solve.
export function resultOf(
  names: readonly [string, string],
  all: readonly [number[], number[]],
): string {
  const winner = winnerOf(...all);
  const [one, two] = names.map((name, side) => `${name}: ${rangeOf(all[side]!)}`);
  const runs = `Steps to solve, smallest to largest of ${all[0].length} seeds. ${one}. ${two}.`;
  if (!winner) return `A draw. ${runs}`;
  const first = names[winner.side]!;
  return winner.always
    ? `${first} wins with every seed. ${runs}`
    : `${first} wins in the median, but not with every seed: chance matters, too. ${runs}`;
}

function rangeOf(sorted: readonly number[]): string {
  const [low, high] = [sorted[0]!, sorted.at(-1)!].map((steps) =>
    Number.isFinite(steps) ? steps.toLocaleString('en') : 'not solved',
  );
  return low === high ? low! : `${low} to ${high}`;
}
