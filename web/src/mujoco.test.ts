import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import loadMujoco from '@mujoco/mujoco';
import type { MainModule } from '@mujoco/mujoco';
import { beforeAll, expect, test } from 'vitest';
import { HANGING, mjcf, NOMINAL, PARAMETERS } from './pendulum';
import type { Plant, State } from './pendulum';
import { Mujoco } from './mujoco';
import type { Push } from './simulator';
import { inSi, Units } from './size';
import { pointOn } from './world';
import { OTHER } from '../tests/plant';
import { simulate } from '../tests/program';

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
  for (let k = 0; k < 10 * 50 * 4; ++k) {
    const torque = 6 * Math.sin(k / 100); // beyond the limit of 4 too
    data.ctrl[0] = torque;
    mujoco.mj_step(model, data);
    expect(simulator.step(torque, null, 0.005)).toBe(true);
  }
  const [q, w] = [data.qpos, data.qvel];
  expectSame(simulator.state, { q1: q[0], q2: q[1], w1: w[0], w2: w[1] }, 1e-9);
  data.delete();
  model.delete();
});

/// The program's MuJoCo under these torques, one for each control step: the states before them.
function native(plant: Plant, { q1, q2, w1, w2 }: State, torques: readonly number[]): State[] {
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  const file = join(folder, 'torques.csv');
  writeFileSync(file, ['torque', ...torques].join('\n') + '\n');
  const changes = PARAMETERS.flatMap((name) => ['--set', `${name}=${plant[name]}`]);
  const flags = ['--torque', file, `--start=${q1},${q2},${w1},${w2}`, '--physics', 'mujoco'];
  const rows = simulate(...flags, ...changes);
  rmSync(folder, { recursive: true });
  return rows.map(([, q1, q2, w1, w2]) => ({ q1, q2, w1, w2 }) as State);
}

/// The same in the page's MuJoCo.
function inPage(plant: Plant, start: State, torques: readonly number[]): State[] {
  const simulator = new Mujoco(mujoco);
  simulator.plant = plant;
  simulator.state = start;
  return torques.map((torque) => {
    const before = simulator.state;
    for (let i = 0; i < 4; ++i) expect(simulator.step(torque, null, 0.005)).toBe(true);
    return before;
  });
}

const apart = (a: State, b: State) =>
  Math.max(...numbers(a).map((x, i) => Math.abs(x - numbers(b)[i]!)));

// The page has another version of MuJoCo than the program (npm has no newer one).
test('another size equals a new model in SI units', () => {
  const plant = { ...OTHER, size: 0.2 };
  const model = mujoco.MjModel.from_xml_string(mjcf(inSi(plant)))!;
  const { time, torque, velocity } = new Units(plant.size);
  model.opt.timestep = 0.005 * time;
  const data = new mujoco.MjData(model);
  data.qpos.set([START.q1, START.q2]);
  data.qvel.set([velocity * START.w1, velocity * START.w2]);
  const simulator = new Mujoco(mujoco);
  simulator.state = START;
  simulator.plant = plant;
  expectSame(simulator.state, START, 1e-14);
  for (let k = 0; k < 400; ++k) {
    const chosen = 6 * Math.sin(k / 100);
    data.ctrl[0] = torque * chosen;
    mujoco.mj_step(model, data);
    expect(simulator.step(chosen, null, 0.005)).toBe(true);
  }
  const [q, w] = [data.qpos, data.qvel];
  expectSame(simulator.state, { q1: q[0], q2: q[1], w1: time * w[0], w2: time * w[1] }, 1e-9);
  data.delete();
  model.delete();
});

test.each<[string, Plant, State]>([
  ['the nominal plant from rest', NOMINAL, HANGING],
  ['the nominal plant in a fast spin', NOMINAL, { q1: 2, q2: -1, w1: 12, w2: -20 }],
  ['the nominal plant from upright', NOMINAL, { q1: Math.PI, q2: 0.01, w1: 0, w2: 0 }],
  ['another plant', OTHER, START],
  ['no damping', { ...NOMINAL, damping1: 0, damping2: 0 }, { q1: 3, q2: 1, w1: 0, w2: 0 }],
  ['strong damping', { ...OTHER, damping1: 2, damping2: 1.5 }, START],
])("%s moves as in the program's MuJoCo", (_, plant, start) => {
  // Beyond the limit, too; 3 s.
  const torques = Array.from({ length: 150 }, (_, k) => 7 * Math.sin(k / 7) * Math.cos(k / 31));
  const page = inPage(plant, start, torques);
  const program = native(plant, start, torques);
  expect(program.length).toBeGreaterThanOrEqual(torques.length);
  // The motion is chaotic. A second start, 1e-8 away, shows by which factor it has magnified the
  // rounding of earlier steps. A velocity of 30 rad/s is rounded to 4e-15, in each of 600 steps.
  const SHIFT = 1e-8;
  const ROUNDING = 1e-13;
  const shifted = inPage(plant, { ...start, q2: start.q2 + SHIFT }, torques);
  let magnified = 1;
  page.forEach((state, k) => {
    magnified = Math.max(magnified, apart(state, shifted[k]!) / SHIFT);
    expect(apart(state, program[k]!)).toBeLessThan(ROUNDING * magnified);
  });
  expect(ROUNDING * magnified).toBeLessThan(1e-9); // so that the comparison says something
  expect(apart(page.at(-1)!, page[0]!)).toBeGreaterThan(0.1);
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
    simulator.step(0, acting, 0.005);
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
  for (let k = 0; sound && k < 200; ++k) sound = simulator.step(0, null, 0.005);
  expect(sound).toBe(false);
  expectSame(simulator.state, { q1: 0, q2: 0, w1: 0, w2: 0 }, 1e-12);
});
