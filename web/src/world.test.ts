import loadMujoco from '@mujoco/mujoco';
import type { MainModule } from '@mujoco/mujoco';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { beforeAll, beforeEach, expect, test } from 'vitest';
import { policyPath, readPolicy, simulate } from '../tests/program';
import { core } from './core';
import { Learner } from './learn/learner';
import { goalNumbers, GOALS, HANGING, NOMINAL, restIn } from './pendulum';
import { Policy } from './policy';
import { Mujoco } from './mujoco';
import { pointOn, World } from './world';
import type { Moment } from './world';

let mujoco: MainModule;
let world: World;
beforeAll(async () => {
  mujoco = await loadMujoco();
});
beforeEach(() => {
  world = new World(new Mujoco(mujoco));
});

const tvlqr = new Policy('tvlqr'); // plans for seconds

function agentOn(id: string): void {
  world.policy = new Policy(readPolicy(id));
  world.agentOn = true;
}

function run(seconds: number): Moment[] {
  const moments: Moment[] = [];
  world.onMoment = (moment) => moments.push(moment);
  for (let k = 0; k < seconds * 200; ++k) world.advance();
  return moments;
}

/// Compares states and torques with the C++ program and its own MuJoCo.
function expectTrajectory(
  moments: Moment[],
  rows: number[][],
  tolerance: number,
  ofTorque = 0, // N·m
): void {
  expect(moments.length).toBeGreaterThan(100);
  const largest = (differences: number[]) =>
    differences.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  const ofState = moments.flatMap(({ state: { q1, q2, w1, w2 } }, k) =>
    [q1, q2, w1, w2].map((x, i) => x - rows[k]![i + 1]!),
  );
  expect(largest(ofState)).toBeLessThan(tolerance);
  expect(largest(moments.map(({ torque }, k) => torque - rows[k]![5]!))).toBeLessThanOrEqual(
    ofTorque,
  );
}

test.each(['d3qn', 'd3qn-adaptive', 'd3qn-randomized'])(
  '%s acts as in `upswing simulate`',
  (id) => {
    agentOn(id);
    expectTrajectory(run(5), simulate(policyPath(id), '--seconds', '5'), 1e-6);
  },
);

// Its torques are continuous, and rounding differs.
test.each(Object.values(GOALS))('any-pose goes to $name as in `upswing simulate`', (goal) => {
  agentOn('any-pose');
  world.goal = goal;
  const flags = ['--goal', goal.name, '--seconds', '5'];
  expectTrajectory(run(5), simulate(policyPath('any-pose'), ...flags), 1e-3, 1e-2);
});

test('a goal between an identified plant and a memory, as in `upswing simulate`', () => {
  const settings = { any_pose: 'true', identify: 'true', memory: '3' };
  const learner = new Learner(core(), 'fast', 1, settings);
  learner.run(20);
  const file = learner.policy();
  learner.close();
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  const path = join(folder, 'policy.safetensors');
  writeFileSync(path, new Uint8Array(file));
  world.policy = new Policy(file);
  world.goal = GOALS['up-down'];
  world.agentOn = true;
  const rows = simulate(path, '--goal', 'up-down', '--seconds', '5');
  rmSync(folder, { recursive: true });
  expectTrajectory(run(5), rows, 1e-6);
  expect(world.seen.length).toBe(8 + 13 + 2 + 3 * 3);
  expect([...world.seen.subarray(21, 23)]).toEqual([1, -1]);
});

test('a new goal counts from the next control step on, also for the twin', () => {
  agentOn('any-pose');
  world.twin = new World(new Mujoco(mujoco));
  world.twin.policy = world.policy;
  run(0.02);
  for (const goal of [GOALS['up-down'], GOALS['down-up'], GOALS['up-up'], GOALS['up-down']]) {
    world.goal = goal;
    expect(world.uprightFor).toBeNull();
    const numbers = Float32Array.from(goalNumbers(goal));
    expect(world.seen.subarray(8)).not.toEqual(numbers);
    run(0.02);
    expect(world.seen.subarray(8)).toEqual(numbers);
    run(15);
    expect(world.uprightFor).toBeGreaterThan(5);
    expect(world.twin.uprightFor).toBe(world.uprightFor);
  }
  world.policy = new Policy(readPolicy('fast'));
  expect(world.uprightFor).toBeNull();
  world.reset(restIn(null));
  expect(world.uprightFor).toBe(0);
});

// Their torques are continuous, and rounding differs.
test.each([
  ['lqr', 3.13],
  ['energy', 0],
  ['pfl', 0],
  ['tvlqr', 0],
  ['mpc', 0],
])('the controller %s acts as in `upswing simulate`', (name, q1) => {
  world.policy = name === 'tvlqr' ? tvlqr : new Policy(name);
  world.agentOn = true;
  world.reset({ ...HANGING, q1 });
  const moments = run(10);
  expectTrajectory(
    moments,
    simulate(name, '--start', `${q1},0,0,0`, '--seconds', '10'),
    1e-4,
    1e-3,
  );
  expect(moments.some(({ torque }) => Math.abs(torque) > 0.5)).toBe(true);
  expect(world.uprightFor).toBeGreaterThan(3);
  for (let k = 0; k < 20 * 200; ++k) world.advance();
  expect(world.uprightFor).toBeGreaterThan(20);
});

test("looking, or asking about other states, keeps a controller's plan", () => {
  world.policy = tvlqr;
  world.agentOn = true;
  const torques = (disturb: () => void) => {
    world.reset();
    run(1);
    disturb();
    return run(2).map(({ torque }) => torque);
  };
  const alone = torques(() => {});
  const asked = torques(() => {
    world.look();
    world.decisionAt({ q1: 3, q2: 0.1, w1: 0, w2: 0 });
  });
  expect(asked).toEqual(alone);
  expect(new Set(alone).size).toBeGreaterThan(10);
});

test('another plant, too', () => {
  agentOn('d3qn');
  world.plant = { ...NOMINAL, mass2: 1.1, damping1: 0.15, torque_limit: 4 };
  const other = ['mass2=1.1', 'damping1=0.15', 'torque_limit=4'].flatMap((s) => ['--set', s]);
  expectTrajectory(run(5), simulate(policyPath('d3qn'), '--seconds', '5', ...other), 1e-6);
});

test('an agent identifies an unknown plant with a delayed motor', () => {
  agentOn('d3qn-adaptive');
  world.plant = { ...NOMINAL, mass2: 0.75, torque_limit: 4 };
  world.disturbance.delay = 2;
  world.reset();
  const flags = ['--set', 'mass2=0.75', '--set', 'torque_limit=4', '--delay', '0.04'];
  expectTrajectory(run(5), simulate(policyPath('d3qn-adaptive'), '--seconds', '5', ...flags), 1e-6);
});

test.each([
  ['d3qn', 5],
  ['d3qn-adaptive', 5],
])('%s measures with encoders as in `upswing simulate`', (id, seconds) => {
  agentOn(id);
  Object.assign(world.disturbance, {
    sensor_latency: 0.005,
    encoder_counts: 4096,
    velocity_window: 0.01,
    velocity_filter: 0.004,
  });
  world.reset();
  const flags = ['--sensor-latency', '0.005', '--encoder-counts', '4096'];
  flags.push('--velocity-window', '0.01', '--velocity-filter', '0.004');
  const rows = simulate(policyPath(id), '--seconds', `${seconds}`, ...flags);
  expectTrajectory(run(seconds), rows, 1e-6);
});

test('looking at a decision does not change the sensors', () => {
  agentOn('d3qn');
  Object.assign(world.disturbance, { encoder_counts: 1000, velocity_window: 0.03 });
  const torques = (look: () => void) => {
    world.reset();
    run(0.5);
    look();
    return run(1).map(({ torque }) => torque);
  };
  expect(torques(() => world.look())).toEqual(torques(() => {}));
});

test("the memory holds the chosen torque, even beyond the motor's limit", () => {
  agentOn('d3qn-randomized');
  world.plant = { ...NOMINAL, torque_limit: 4 };
  const rows = simulate(policyPath('d3qn-randomized'), '--seconds', '5', '--set', 'torque_limit=4');
  expectTrajectory(run(5), rows, 1e-6);
});

test('it falls as in `upswing simulate`', () => {
  world.reset({ q1: 3, q2: 0.2, w1: 0, w2: 0 });
  expectTrajectory(run(5), simulate('--start', '3,0.2,0,0', '--seconds', '5'), 1e-9);
});

test('a pull throws the balanced pendulum down, and the agent brings it back', () => {
  agentOn('d3qn');
  run(10);
  const before = world.uprightFor!;
  expect(before).toBeGreaterThan(0);
  run(1);
  expect(world.uprightFor).toBeCloseTo(before + 1, 9);
  world.drag = { link: 2, along: 0.5, target: { x: 1, z: 0 } };
  run(1);
  expect(world.uprightFor).toBeNull();
  world.drag = null;
  run(15);
  expect(world.uprightFor).not.toBeNull();
});

test("a hand's pull is limited, and its damper calms the motion", () => {
  world.drag = { link: 2, along: 0.5, target: { x: 5, z: 5 } };
  world.advance();
  const { force } = world.push!;
  expect(Math.hypot(force.x, force.z)).toBeCloseTo(15, 9);
  // Held at a place within reach, it comes to rest there.
  world.drag.target = { x: 0.6, z: -0.5 };
  run(20);
  const { position, velocity } = pointOn(world.plant, world.state, 2, 0.5);
  expect(Math.hypot(position.x - 0.6, position.z + 0.5)).toBeLessThan(0.2);
  expect(Math.hypot(velocity.x, velocity.z)).toBeLessThan(0.01);
});

test('a delayed motor holds the torque chosen before', () => {
  agentOn('d3qn');
  const start = { ...HANGING, q1: 0.5 };
  world.reset(start);
  const prompt = run(0.02)[0]!.torque;
  expect(prompt).not.toBe(0);
  world.disturbance.delay = 3;
  world.reset(start);
  expect(run(0.08).map((m) => m.torque)).toEqual([0, 0, 0, prompt]);
});

test('without the agent the motor is off, but the agent still thinks', () => {
  agentOn('d3qn');
  world.agentOn = false;
  world.reset({ ...HANGING, q1: 1 });
  expect(run(2).every((m) => m.torque === 0)).toBe(true);
  expect(world.decision).toMatchObject({ kind: 'q', q: { length: 9 } });
});

test('the sensors blur angles and velocities by as much as they should', () => {
  const policy = new Policy(readPolicy('fast'));
  const act = policy.act.bind(policy);
  const seen: number[][] = [];
  policy.act = (observation) => {
    const [, sin1, w1, , sin2, w2] = observation; // hanging at rest: all 0 except for noise
    seen.push([Math.asin(sin1!), w1! * 10, Math.asin(sin2!), w2! * 20]);
    return act(observation);
  };
  world.disturbance.sensor_noise = 0.1;
  world.policy = policy;
  run(60);
  for (const i of [0, 1, 2, 3]) {
    const noise = seen.map((row) => row[i]!);
    const mean = noise.reduce((sum, x) => sum + x, 0) / noise.length;
    const variance = noise.reduce((sum, x) => sum + x * x, 0) / noise.length;
    // Within five standard errors of 3,000 draws.
    expect(Math.abs(mean)).toBeLessThan((5 * 0.1) / Math.sqrt(noise.length));
    expect(Math.abs(variance / 0.01 - 1)).toBeLessThan(5 * Math.sqrt(2 / noise.length));
  }
});
