import { beforeAll, describe, expect, test } from 'vitest';
import { runProgram } from '../tests/program';
import { DelayLine, DISTURBANCE_LIMITS } from './disturbance';
import * as pendulum from './pendulum';
import type { Plant, State } from './pendulum';

/// Everything that the page computes as the C++ program does, against vectors that the program writes.

type Numbers = number[];
interface Case {
  plant: Plant;
  state: Numbers;
  torque: number;
  observation: Numbers;
  energy: number;
  energy_target: number;
  normalized_energy: number;
  tip_height: number;
  inverted: boolean;
  reward_terms: Numbers;
}
interface Vectors {
  constants: Record<string, number | Numbers>;
  cases: Case[];
  capsules: { mass: number; radius: number; length: number; across: number; along: number }[];
  models: { plant: Plant; mjcf: string }[];
  observation_memory: {
    plant: Plant;
    torques: Numbers;
    observations: Numbers[];
    with_memory: { memory: number; observations: Numbers[] }[];
  };
  delays: { steps: number; chosen: Numbers; applied: Numbers }[];
}

let vectors: Vectors;
beforeAll(() => {
  vectors = JSON.parse(runProgram('export', '--test-vectors', '-')) as Vectors;
});

const stateOf = ([q1, q2, w1, w2]: Numbers): State => ({ q1: q1!, q2: q2!, w1: w1!, w2: w2! });

/// Equal but for the rounding of sines and cosines.
function expectClose(got: ArrayLike<number>, expected: Numbers, tolerance = 1e-12): void {
  expect(got.length).toBe(expected.length);
  expected.forEach((x, i) => {
    expect(Math.abs(got[i]! - x)).toBeLessThanOrEqual(tolerance * (1 + Math.abs(x)));
  });
}

test('constants', () => {
  const { constants } = vectors;
  expect(pendulum.CONTROL_PERIOD).toBe(constants.control_period);
  expect(pendulum.PHYSICS_STEPS).toBe(constants.physics_steps);
  expect(pendulum.CAPSULE_RADIUS).toBe(constants.capsule_radius);
});

test('energy, height, upright, reward', () => {
  expect(vectors.cases.length).toBeGreaterThan(50);
  expect(new Set(vectors.cases.map((c) => c.inverted)).size).toBe(2);
  for (const c of vectors.cases) {
    const state = stateOf(c.state);
    expectClose([pendulum.energy(c.plant, state)], [c.energy]);
    expectClose([pendulum.energyTarget(c.plant)], [c.energy_target]);
    expectClose([pendulum.normalizedEnergy(c.plant, state)], [c.normalized_energy]);
    expectClose([pendulum.tipHeight(c.plant, state)], [c.tip_height]);
    expect(pendulum.inverted(state)).toBe(c.inverted);
    expectClose(pendulum.rewardTerms(c.plant, state, c.torque), c.reward_terms);
  }
});

test('observation', () => {
  for (const c of vectors.cases) {
    expectClose(pendulum.observe(c.plant, stateOf(c.state)), c.observation, 2 ** -24); // float32
  }
});

test('what can be set is what the program takes', () => {
  const { CONTROL_PERIOD: period, PLANT_LIMITS } = pendulum;
  const takes = (name: string, value: number) => {
    try {
      runProgram('simulate', '--seconds', '0.02', '--set', `${name}=${value}`);
      return true;
    } catch {
      return false;
    }
  };
  for (const [name, [low, high]] of Object.entries(PLANT_LIMITS)) {
    const around = [low * 0.99 - 1e-3, low, high, high * 1.01];
    expect(
      around.map((value) => takes(name, value)),
      name,
    ).toEqual([false, true, true, false]);
  }
  expect(DISTURBANCE_LIMITS.delay[1] * period).toBe(1);
});

test('inertia of capsules', () => {
  for (const { mass, radius, length, across, along } of vectors.capsules) {
    const got = pendulum.capsuleInertia(mass, radius, length);
    expectClose([got.across, got.along], [across, along]);
  }
});

test('the model, letter by letter', () => {
  for (const { plant, mjcf } of vectors.models) expect(pendulum.mjcf(plant)).toBe(mjcf);
});

describe('what an observation remembers', () => {
  test.each([0, 1])('memory %i of the list', (which) => {
    const { torques, observations, with_memory } = vectors.observation_memory;
    const { memory, observations: expected } = with_memory[which]!;
    let before: Float32Array | null = null;
    expected.forEach((row, k) => {
      const now = new Float32Array(row.length);
      now.set(observations[k]!);
      before = before ? pendulum.remember(before, torques[k - 1]!, memory, now) : now;
      expectClose(before, row, 0);
    });
  });
});

test('a motor that is late', () => {
  expect(vectors.delays.some((d) => d.steps > 1)).toBe(true);
  for (const { steps, chosen, applied } of vectors.delays) {
    const motor = new DelayLine();
    expect(chosen.map((torque) => motor.apply(torque, steps))).toEqual(applied);
  }
});
