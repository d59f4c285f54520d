import { expect, test } from 'vitest';
import { policyPath, runProgram } from '../tests/program';
import { DelayLine, DISTURBANCE_LIMITS } from './disturbance';
import * as pendulum from './pendulum';
import type { State } from './pendulum';

/// Formulas of the core, compared with the C++ program.

const COLUMNS = 15; // of a rollout, without the torque of each joint
const PLANT = { ...pendulum.NOMINAL, mass1: 1.2, length2: 0.4, gravity: 5, torque_limit: 3 };

/// Rows of a policy's rollout on PLANT: t, state, torque, energy, height, inverted, reward, its terms.
function rows(policy = 'pfl', ...goal: string[]): number[][] {
  const changes = ['mass1=1.2', 'length2=0.4', 'gravity=5', 'torque_limit=3'];
  const flags = changes.flatMap((change) => ['--set', change]);
  const text = runProgram('simulate', policy, '--seconds', '5', ...goal, ...flags);
  return text
    .trim()
    .split('\n')
    .slice(1)
    .map((row) => row.split(',').slice(0, COLUMNS).map(Number));
}

/// Equal within the rounding of sines and cosines.
function expectClose(got: ArrayLike<number>, expected: number[], tolerance = 1e-9): void {
  expect(got.length).toBe(expected.length);
  expected.forEach((x, i) => {
    expect(Math.abs(got[i]! - x)).toBeLessThanOrEqual(tolerance * (1 + Math.abs(x)));
  });
}

/// The terms of a row are those of the step from it to the next row.
function expectRewards(all: number[][], goal?: pendulum.Goal): void {
  all.slice(1).forEach(([, q1, q2, w1, w2], k) => {
    const [, , , , , torque, , , , , ...terms] = all[k]!;
    const state = { q1, q2, w1, w2 } as State;
    expectClose(pendulum.rewardTerms(PLANT, state, torque!, goal), terms);
  });
}

test('energy, height, upright, reward, observation', () => {
  const { sin, cos } = Math;
  const target = pendulum.energy(PLANT, pendulum.restIn(null));
  expectClose([pendulum.energy(PLANT, pendulum.HANGING)], [-target]);
  const seen = new Set<boolean>();
  for (const [, q1, q2, w1, w2, , energy, height, inverted] of rows()) {
    const state = { q1, q2, w1, w2 } as State;
    expectClose([pendulum.energy(PLANT, state)], [energy!]);
    expectClose([pendulum.tipHeight(PLANT, state)], [height!]);
    expect(pendulum.inverted(state)).toBe(inverted === 1);
    seen.add(inverted === 1);
    const relative = (energy! + target) / (2 * target);
    expectClose([pendulum.normalizedEnergy(PLANT, state)], [relative]);
    expectClose(
      pendulum.observe(PLANT, state),
      [cos(q1!), sin(q1!), w1! / 10, cos(q2!), sin(q2!), w2! / 20, relative, height! / 0.9],
      2 ** -23, // float32
    );
  }
  expect(seen.size).toBe(2);
  expectRewards(rows());
});

test.each(Object.values(pendulum.GOALS))('judgement and reward of the goal $name', (goal) => {
  const all = rows(policyPath('any-pose'), '--goal', goal.name);
  for (const [, q1, q2, w1, w2, , , , inverted] of all) {
    expect(pendulum.inverted({ q1, q2, w1, w2 } as State, goal)).toBe(inverted === 1);
  }
  expectRewards(all, goal);
  expect(pendulum.inverted(pendulum.restIn(goal), goal)).toBe(true);
});

test("the program takes the page's parameters in their ranges", () => {
  const { CONTROL_PERIOD: period, PLANT_LIMITS } = pendulum;
  const takes = (name: string, value: number) => {
    try {
      // With much armature, the physics is stable for any damping.
      const changes = ['--set', 'armature=10', '--set', `${name}=${value}`];
      runProgram('simulate', '--seconds', '0.02', ...changes);
      return true;
    } catch {
      return false;
    }
  };
  for (const name of pendulum.PARAMETERS) {
    const [low, high] = PLANT_LIMITS[name];
    expect(takes(name, low) && takes(name, high), name).toBe(true);
  }
  expect(DISTURBANCE_LIMITS.delay[1] * period).toBe(1);
});

test('a plant that the physics cannot follow has a problem', () => {
  expect(pendulum.plantProblem(pendulum.NOMINAL)).toBe('');
  expect(pendulum.plantProblem({ ...pendulum.NOMINAL, damping2: 100 })).toMatch(
    /^plant: expected friction that stops the joints at a rate of at most 557\/s, .* got 3111\.25\/s/,
  );
});

test('inertia of a ball', () => {
  const { across, along } = pendulum.capsuleInertia(3, 0.2, 0);
  expectClose([across, along], [0.4 * 3 * 0.04, 0.4 * 3 * 0.04]);
});

test('the model has the numbers of the plant', () => {
  expect(pendulum.mjcf(PLANT)).toContain('gravity="0 0 -5"');
});

test('memory of an observation', () => {
  const [first, second, third] = [0, 1, 2].map((k) => {
    const observation = new Float32Array(8 + 6); // of two control steps
    observation.set(pendulum.observe(PLANT, { q1: k, q2: 0, w1: 2 * k, w2: 5 * k * k }));
    return observation;
  });
  const once = pendulum.remember(first!, 3, 2, second!);
  const twice = pendulum.remember(once, -1, 2, third!);
  expect(twice.subarray(0, 8)).toEqual(third!.subarray(0, 8));
  // The newest step is first: changes of the velocities, and the torque.
  expect(twice.subarray(11)).toEqual(once.subarray(8, 11));
  expect(twice[8]! / once[8]!).toBeCloseTo(1, 5);
  expect(twice[9]! / once[9]!).toBeCloseTo(3, 5);
  expect(twice[10]! / once[10]!).toBeCloseTo(-1 / 3, 5);
});

test('a delayed motor', () => {
  const chosen = [1, -2, 3, 0, 5, 1, -1];
  for (const steps of [0, 1, 3]) {
    const motor = new DelayLine();
    const applied = [...new Array<number>(steps).fill(0), ...chosen].slice(0, chosen.length);
    expect(chosen.map((torque) => motor.apply(torque, steps))).toEqual(applied);
  }
});
