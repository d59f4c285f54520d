import { beforeAll, describe, expect, test } from 'vitest';
import { tensorNames, withMetadata, withNumber } from '../tests/file';
import { runProgram } from '../tests/program';
import { decisionText } from './page/dashboard';
import { Policy } from './policy';
import { BadInput } from './bad_input';

/// Actor policies, against what the C++ program makes of the same files and observations.

interface Case {
  observation: number[];
  torque: number;
  low: number;
  high: number;
  probabilities: number[];
  value: number | null;
}
interface Vectors {
  actors: { file: string; cases: Case[] }[];
}

let actors: { file: ArrayBuffer; cases: Case[] }[];
beforeAll(() => {
  const vectors = JSON.parse(runProgram('export', '--test-vectors', '-')) as Vectors;
  actors = vectors.actors.map(({ file, cases }) => ({
    file: new Uint8Array(Buffer.from(file, 'hex')).buffer,
    cases,
  }));
});

const near = (got: number, expected: number, tolerance: number) =>
  expect(Math.abs(got - expected)).toBeLessThanOrEqual(tolerance * (1 + Math.abs(expected)));

test('of every kind of output', () => {
  const outputs = actors.map(({ file }) => new Policy(file).about('output'));
  expect(new Set(outputs).size).toBe(3);
  expect(actors.map(({ file }) => new Policy(file).controller.text)).toEqual([
    'mean action of a Gaussian policy 8-12-10-2, layer normalisation, critic 9-10-1',
    'mean action of a Gaussian policy 8-8-2',
    'mean action of a Gaussian policy 8-10-8-2, critic 8-10-1',
    'likeliest action of a categorical policy 8-12-5, layer normalisation, critic 8-10-1',
  ]);
});

test.each([0, 1, 2, 3])('actor %i decides as the C++ program does', (which) => {
  const { file, cases } = actors[which]!;
  const policy = new Policy(file);
  expect(policy.controller.selfCheckError).toBeLessThan(1e-5);
  expect(policy.controller.strongest).toBe(5);
  expect(new Set(cases.map(({ torque }) => torque)).size).toBeGreaterThan(1);
  for (const { observation, torque, low, high, probabilities, value } of cases) {
    const decision = policy.act(Float32Array.from(observation));
    near(decision.torque, torque, 1e-5);
    if (value === null) expect(decision.value).toBeNaN();
    else near(decision.value, value, 1e-5);
    if (decision.kind === 'categorical') {
      probabilities.forEach((p, i) => near(decision.probabilities[i]!, p, 1e-5));
      continue;
    }
    if (decision.kind !== 'gaussian') throw new Error(`got a decision of kind ${decision.kind}`);
    near(decision.low, low, 1e-5);
    near(decision.high, high, 1e-5);
    const [below, ...shares] = decision.probabilities(probabilities.length);
    const above = shares.pop()!;
    shares[0]! += below!;
    shares[shares.length - 1]! += above;
    probabilities.forEach((p, i) => near(shares[i]!, p, 1e-5));
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
    const { file } = actors[0]!;
    expect(new Policy(withMetadata(file, 'agent', 'x')).metadata.get('agent')).toBe('x');
    expect(() => new Policy(withMetadata(file, key, text))).toThrow(BadInput);
  });

  test('with numbers that are none, or that it does not compute', () => {
    for (const { file } of actors) {
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
    expect(() => new Policy(withNumber(squashed!.file, 'action_limit', 6))).toThrow('self-check');
    expect(() => new Policy(withNumber(categorical!.file, 'torques', 6))).toThrow('self-check');
  });
});

test('a large number is told in full, as the program does', () => {
  const { file } = actors[0]!;
  const plant = JSON.parse(new Policy(file).about('plant')) as object;
  for (const mass1 of [9007199254740994, 9999999999999998, 1234567890123456]) {
    const changed = withMetadata(file, 'plant', JSON.stringify({ ...plant, mass1 }));
    expect(() => new Policy(changed)).toThrow(`got "${mass1}"`);
  }
});

test('numbers that overflow on the way move nothing', () => {
  for (const { file } of actors) {
    const decision = new Policy(file).act(new Float32Array(8).fill(3e38));
    expect(Number.isFinite(decision.torque)).toBe(true);
  }
});

test('what it says of a decision', () => {
  const text = (which: number) => {
    const { file, cases } = actors[which]!;
    const policy = new Policy(file);
    return decisionText(policy.act(Float32Array.from(cases[0]!.observation)), 0.1);
  };
  expect(text(0)).toMatch(/^−?\d\.\d\d N·m, σ \d\.\d\d, V −?\d+\.\d$/);
  expect(text(1)).toMatch(/^−?\d\.\d\d N·m, σ \d\.\d\d$/);
  expect(text(3)).toMatch(/^likeliest \d+%, V −?\d+\.\d$/);
});
