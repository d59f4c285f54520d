import { describe, expect, test } from 'vitest';
import { tensorNames, withMetadata, withNumber } from '../tests/file';
import { ACTORS, actorFiles, simulate } from '../tests/program';
import { decisionText } from './page/dashboard';
import { NOMINAL, observe } from './pendulum';
import type { State } from './pendulum';
import { Policy } from './policy';
import { BadInput } from './bad_input';

/// Actor policies, compared with results of the C++ program for the same files.

const actors = actorFiles();

test('every kind of output has a policy', () => {
  const outputs = actors.map((file) => new Policy(file).about('output'));
  expect(new Set(outputs).size).toBe(3);
  expect(actors.map((file) => new Policy(file).controller.text)).toEqual([
    'mean action of a Gaussian policy 8-12-10-2, layer normalisation, critic 9-10-1',
    'mean action of a Gaussian policy 8-8-2',
    'mean action of a Gaussian policy 8-10-8-2, critic 8-10-1',
    'likeliest action of a categorical policy 8-12-5, layer normalisation, critic 8-10-1',
  ]);
});

test.each([0, 1, 2, 3])('actor %i decides as the C++ program does', (which) => {
  const policy = new Policy(actors[which]!);
  expect(policy.controller.selfCheckError).toBeLessThan(1e-5);
  expect(policy.controller.strongest).toBe(5);
  const rows = simulate(ACTORS[which]!, '--seconds', '3', '--start', '2,1,0,0');
  for (const [, q1, q2, w1, w2, torque] of rows.slice(0, -1)) {
    const decision = policy.act(observe(NOMINAL, { q1, q2, w1, w2 } as State));
    expect(Math.abs(decision.torque - torque!)).toBeLessThan(1e-4);
    expect(Number.isNaN(decision.value)).toBe(which === 1);
    if (decision.kind === 'q' || decision.kind === 'computed') throw new Error(decision.kind);
    let shares: ArrayLike<number>;
    if (decision.kind === 'gaussian') {
      expect(decision.low).toBeLessThanOrEqual(decision.torque);
      expect(decision.high).toBeGreaterThanOrEqual(decision.torque);
      shares = decision.probabilities(10);
    } else {
      shares = decision.probabilities;
    }
    expect(Array.from(shares).reduce((sum, share) => sum + share, 0)).toBeCloseTo(1, 5);
  }
});

describe('is refused', () => {
  const shape = (change: object) =>
    JSON.stringify({
      ...{ inputs: 8, hidden: [12, 10], layer_norm: true, activation: 'relu' },
      ...change,
    });
  test.each<[string, string | undefined]>([
    ['network', 'x'],
    ['network', 'null'],
    ['network', '[]'],
    ['network', undefined],
    ['network', shape({ hidden: [] })],
    ['network', shape({ hidden: [12, 1e6] })],
    ['network', shape({ hidden: new Array(17).fill(12) })],
    ['network', shape({ hidden: '12' })],
    ['network', shape({ inputs: 11 })],
    ['network', shape({ layer_norm: 1 })],
    ['network', shape({ activation: 'gelu' })],
    ['network', shape({ activation: undefined })],
    ['network', shape({ activation: 'tanh' })],
    ['critic', 'null'],
    ['critic', shape({ inputs: 10, hidden: [10], layer_norm: false })],
    ['critic', shape({ inputs: 8, hidden: [10], layer_norm: false })],
    ['critic', shape({ inputs: 9, hidden: [1e6], layer_norm: false })],
    ['output', 'gaussian'],
    ['output', 'levels'],
    ['output', 'clipped-gaussian'],
    ['output', 'categorical'],
    ['output', 'constructor'],
  ])('with a %s of %s', (key, text) => {
    const file = actors[0]!;
    expect(new Policy(withMetadata(file, 'agent', 'x')).metadata.get('agent')).toBe('x');
    expect(() => new Policy(withMetadata(file, key, text))).toThrow(BadInput);
  });

  test('with numbers that are not finite or not its own results', () => {
    for (const file of actors) {
      const names = tensorNames(file);
      expect(names).toContain('action_limit');
      for (const name of names) {
        expect(() => new Policy(withNumber(file, name, NaN)), name).toThrow(
          'expected finite numbers',
        );
        expect(() => new Policy(withNumber(file, name, Infinity)), name).toThrow(
          'expected finite numbers',
        );
        if (!name.startsWith('sample')) continue;
        expect(() => new Policy(withNumber(file, name, 77)), name).toThrow('self-check');
      }
      expect(() => new Policy(withNumber(file, 'action_limit', 0))).toThrow('action_limit');
      expect(() => new Policy(withNumber(file, 'action_limit', -5))).toThrow('action_limit');
    }
    const [squashed, , , categorical] = actors;
    expect(() => new Policy(withNumber(squashed!, 'action_limit', 6))).toThrow('self-check');
    expect(() => new Policy(withNumber(categorical!, 'torques', 6))).toThrow('self-check');
  });
});

test('messages give a large number in full, as in the program', () => {
  const file = actors[0]!;
  const plant = JSON.parse(new Policy(file).about('plant')) as object;
  for (const mass1 of [9007199254740994, 9999999999999998, 1234567890123456]) {
    const changed = withMetadata(file, 'plant', JSON.stringify({ ...plant, mass1 }));
    expect(() => new Policy(changed)).toThrow(`got "${mass1}"`);
  }
});

test('numbers that overflow give no torque', () => {
  for (const file of actors) {
    const decision = new Policy(file).act(new Float32Array(8).fill(3e38));
    expect(Number.isFinite(decision.torque)).toBe(true);
  }
});

test('describes a decision', () => {
  const text = (which: number) => {
    const policy = new Policy(actors[which]!);
    const decision = policy.act(new Float32Array(policy.controller.inputs));
    return decisionText(decision, 0.1, { factor: 1, unit: 'N·m' });
  };
  expect(text(0)).toMatch(/^−?\d\.\d\d N·m, σ \d\.\d\d, V −?\d+\.\d$/);
  expect(text(1)).toMatch(/^−?\d\.\d\d N·m, σ \d\.\d\d$/);
  expect(text(3)).toMatch(/^likeliest \d+%, V −?\d+\.\d$/);
});
