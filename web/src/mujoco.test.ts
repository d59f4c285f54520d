import loadMujoco from '@mujoco/mujoco';
import type { MainModule } from '@mujoco/mujoco';
import { beforeAll, expect, test } from 'vitest';
import { mjcf, NOMINAL, PHYSICS_STEPS } from './pendulum';
import type { State } from './pendulum';
import { Mujoco } from './mujoco';
import type { Push } from './simulator';
import { pointOn } from './world';
import { OTHER } from '../tests/plant';

let mujoco: MainModule;
beforeAll(async () => {
  mujoco = await loadMujoco();
});

const START: State = { q1: 0.4, q2: -0.3, w1: 1.2, w2: -2 };

const numbers = ({ q1, q2, w1, w2 }: State) => [q1, q2, w1, w2];

function expectSame(got: State, expected: State, tolerance: number): void {
  numbers(expected).forEach((x, i) => {
    expect(Math.abs(numbers(got)[i]! - x)).toBeLessThan(tolerance);
  });
}

test("changing the model's plant equals a new model", () => {
  const model = mujoco.MjModel.from_xml_string(mjcf(OTHER))!;
  const data = new mujoco.MjData(model);
  data.qpos.set([START.q1, START.q2]);
  data.qvel.set([START.w1, START.w2]);
  const simulator = new Mujoco(mujoco);
  simulator.state = START;
  simulator.plant = OTHER;
  expectSame(simulator.state, START, 1e-15);
  for (let k = 0; k < 10 * 50 * PHYSICS_STEPS; ++k) {
    const torque = 6 * Math.sin(k / 100); // beyond the limit of 4 too
    data.ctrl[0] = torque;
    mujoco.mj_step(model, data);
    expect(simulator.step(torque, null)).toBe(true);
  }
  const [q, w] = [data.qpos, data.qvel];
  expectSame(simulator.state, { q1: q[0], q2: q[1], w1: w[0], w2: w[1] }, 1e-9);
  data.delete();
  model.delete();
});

test.each([
  { link: 1, along: 0.2 },
  { link: 2, along: 0.35 },
  { link: 2, along: 0.5 },
] as const)('a push on link $link equals mj_applyFT', ({ link, along }) => {
  const push: Push = { link, along, force: { x: 30, z: -20 } };
  const model = mujoco.MjModel.from_xml_string(mjcf(NOMINAL))!;
  const data = new mujoco.MjData(model);
  data.qpos.set([START.q1, START.q2]);
  data.qvel.set([START.w1, START.w2]);
  mujoco.mj_forward(model, data);
  const { x, z } = pointOn(NOMINAL, START, link, along).position;
  mujoco.mj_applyFT(model, data, [30, 0, -20], [0, 0, 0], [x, 0, z], link, data.qfrc_applied);
  mujoco.mj_step(model, data);
  const expected = { q1: data.qpos[0], q2: data.qpos[1], w1: data.qvel[0], w2: data.qvel[1] };
  data.delete();
  model.delete();

  const after = (acting: Push | null) => {
    const simulator = new Mujoco(mujoco);
    simulator.state = START;
    simulator.step(0, acting);
    return simulator.state;
  };
  // Our push keeps its direction within a step; mj_applyFT's keeps the one of the step's beginning.
  const distance = (a: State, b: State) =>
    Math.hypot(...numbers(a).map((x, i) => x - numbers(b)[i]!));
  const effect = distance(after(null), expected);
  expect(effect).toBeGreaterThan(0.1);
  expect(distance(after(push), expected)).toBeLessThan(0.05 * effect);
});

test('a state that blows up is reported, and the pendulum hangs again', () => {
  const simulator = new Mujoco(mujoco);
  simulator.state = { q1: 0, q2: 0, w1: 1e9, w2: -1e9 };
  let sound = true;
  for (let k = 0; sound && k < 200; ++k) sound = simulator.step(0, null);
  expect(sound).toBe(false);
  expectSame(simulator.state, { q1: 0, q2: 0, w1: 0, w2: 0 }, 1e-12);
});
