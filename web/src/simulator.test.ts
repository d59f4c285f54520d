import loadMujoco from '@mujoco/mujoco';
import { expect, test } from 'vitest';
import { Mujoco } from './mujoco';
import { HANGING, NOMINAL } from './pendulum';
import type { State } from './pendulum';
import { ClosedForm } from './simulator';
import type { Push } from './simulator';
import { World } from './world';
import { OTHER } from '../tests/plant';

const mujoco = await loadMujoco();

function difference(a: State, b: State): number {
  const names = ['q1', 'q2', 'w1', 'w2'] as const;
  return Math.max(...names.map((name) => Math.abs(a[name] - b[name])));
}

test.each([
  ['without a push', null],
  ['under a push on link 1', { link: 1, along: 0.2, force: { x: 9, z: -5 } }],
  ['under a push on link 2', { link: 2, along: 0.6, force: { x: -7, z: 4 } }],
] as const)('the closed form moves like MuJoCo %s', (_, push: Push | null) => {
  const [ours, theirs] = [new ClosedForm(), new Mujoco(mujoco)];
  for (const simulator of [ours, theirs]) {
    simulator.plant = OTHER;
    simulator.state = { q1: 0.4, q2: -0.3, w1: 1.2, w2: -2 };
  }
  let largest = 0; // from one step
  for (let k = 0; k < 400; ++k) {
    const torque = 6 * Math.sin(k / 30); // beyond the limit of 4 too
    expect(ours.step(torque, push, 0.005)).toBe(true);
    expect(theirs.step(torque, push, 0.005)).toBe(true);
    largest = Math.max(largest, difference(ours.state, theirs.state));
    ours.state = theirs.state;
  }
  // Rounding: both compute the same formulas in different orders, at up to tens of rad/s.
  expect(largest).toBeLessThan(1e-12);
  expect(difference(ours.state, { q1: 0.4, q2: -0.3, w1: 1.2, w2: -2 })).toBeGreaterThan(0.1);
});

test('a state that spins too fast is reported, and the pendulum hangs again', () => {
  const simulator = new ClosedForm();
  simulator.state = { q1: 0, q2: 0, w1: 1e9, w2: -1e9 };
  expect(simulator.step(0, null, 0.005)).toBe(false);
  expect(simulator.state).toEqual(HANGING);
});

test('a world continues in MuJoCo from its state', () => {
  const world = new World(new ClosedForm());
  world.plant = { ...NOMINAL, mass2: 1.4, length1: 0.6 };
  world.reset({ q1: 2, q2: 0.5, w1: 0, w2: 1 });
  const never = new World(new ClosedForm());
  never.plant = world.plant;
  never.reset(world.state);
  for (let k = 0; k < 100; ++k) world.advance();
  const before = world.state;
  world.continueIn(new Mujoco(mujoco));
  expect(difference(world.state, before)).toBe(0);
  for (let k = 0; k < 100; ++k) world.advance();
  for (let k = 0; k < 200; ++k) never.advance();
  // The whole motion. Rounding differences grow, but a jump or another plant would differ more.
  expect(difference(world.state, never.state)).toBeLessThan(1e-9);
});
