import loadMujoco from '@mujoco/mujoco';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, test } from 'vitest';
import { withMetadata } from '../tests/file';
import { readPolicy, simulate } from '../tests/program';
import { OTHER } from '../tests/plant';
import { core } from './core';
import { Learner } from './learn/learner';
import { Mujoco } from './mujoco';
import { ARMATURE, CAPSULE_RADIUS, capsuleInertia, HANGING, NOMINAL } from './pendulum';
import type { Plant, State } from './pendulum';
import { Policy } from './policy';
import { ClosedForm } from './simulator';
import type { Push } from './simulator';
import { inSi, Units } from './size';
import { World } from './world';
import type { Moment } from './world';

const mujoco = await loadMujoco();
const SIZES = [0.05, 0.1, 5, 10] as const;
const START: State = { q1: 2.5, q2: 0.4, w1: 0.3, w2: -0.5 };
const NAMES = ['q1', 'q2', 'w1', 'w2'] as const;

const apart = (a: State, b: State) => Math.max(...NAMES.map((name) => Math.abs(a[name] - b[name])));

test('units are those of length and mass × size³ under the same gravity', () => {
  const units = new Units(4);
  expect([units.time, units.velocity, units.of('mass1'), units.force]).toEqual([2, 0.5, 64, 64]);
  expect([units.torque, units.of('damping2'), units.inertia]).toEqual([256, 512, 1024]);
  expect(inSi(NOMINAL)).toEqual(NOMINAL);
  const { size, ...real } = inSi({ ...OTHER, size: 0.25 });
  for (const name of Object.keys(real) as (keyof typeof real)[]) {
    expect(real[name] / OTHER[name], name).toBeCloseTo(new Units(0.25).of(name), 12);
  }
  expect(size).toBe(0.25);
});

/// The motion in an engine under changing torques and a push, in units of size 1.
function motion(simulator: ClosedForm | Mujoco, plant: Plant): State[] {
  simulator.plant = plant;
  simulator.state = START;
  const push: Push = { link: 2, along: 0.3, force: { x: 4, z: -2 } };
  return Array.from({ length: 300 }, (_, k) => {
    const torque = 6 * Math.sin(k / 30); // beyond the limit, too
    expect(simulator.step(torque, k % 60 < 20 ? push : null, 0.005)).toBe(true);
    return simulator.state;
  });
}

test.each(SIZES)('at size %d both engines move as at size 1, in its units', (size) => {
  const plant = { ...OTHER, size };
  for (const make of [() => new ClosedForm(), () => new Mujoco(mujoco)]) {
    const [usual, sized] = [motion(make(), OTHER), motion(make(), plant)];
    usual.forEach((state, k) => expect(apart(state, sized[k]!)).toBeLessThan(1e-9));
    expect(apart(usual.at(-1)!, START)).toBeGreaterThan(1);
  }
});

/// The plant as settings of the program.
function settingsOf(plant: Plant): Record<string, number> {
  const { size, ...real } = inSi(plant);
  const inertia = (mass: number, length: number) =>
    capsuleInertia(mass, size * CAPSULE_RADIUS, length).across;
  return {
    ...real,
    inertia1: inertia(real.mass1, real.length1),
    inertia2: inertia(real.mass2, real.length2),
    armature: new Units(size).inertia * ARMATURE,
  };
}

function moments(world: World, seconds: number): Moment[] {
  const all: Moment[] = [];
  world.onMoment = (moment) => all.push(moment);
  const end = world.time + seconds - 1e-6;
  while (world.time < end) world.advance();
  return all;
}

test.each([0.25, 4])('at size %d it falls as in `upswing simulate`, in SI units', (size) => {
  const plant = { ...OTHER, size };
  const world = new World(new Mujoco(mujoco));
  world.plant = plant;
  world.reset(START);
  const { time, velocity } = world.units;
  const page = moments(world, 3);
  const set = Object.entries(settingsOf(plant)).flatMap(([name, x]) => ['--set', `${name}=${x}`]);
  const start = [START.q1, START.q2, velocity * START.w1, velocity * START.w2].join();
  const program = simulate('--seconds', `${3 * time}`, `--start=${start}`, ...set);
  // The program's rows are 0.02 s apart; at size 0.25 the page's are 0.01 s apart, at size 4, 0.04 s.
  // There the program's steps are shorter, too.
  let compared = 0;
  for (const { t, state } of page) {
    const row = program.find((one) => Math.abs(one[0]! - time * t) < 1e-6);
    if (!row) continue;
    ++compared;
    const [, q1, q2, w1, w2] = row as [number, number, number, number, number];
    expect(apart(state, { q1, q2, w1: w1 * time, w2: w2 * time })).toBeLessThan(1e-6);
  }
  expect(compared).toBeGreaterThan(70);
});

/// The policy of a shipped agent, or the controller with this name.
const policyOf = (id: string, learned: boolean) => new Policy(learned ? readPolicy(id) : id);

test.each([
  ['d3qn', true],
  ['sac', true],
  ['fast', true],
  ['any-pose', true],
  ['d3qn-adaptive', true],
  ['energy', false],
  ['tvlqr', false],
  ['mpc', false],
] as const)('%s swings up and holds every size without a new training', (id, learned) => {
  const ran = [1, ...SIZES].map((size) => {
    const world = new World(new Mujoco(mujoco));
    world.plant = { ...NOMINAL, size };
    world.policy = policyOf(id, learned);
    world.agentOn = true;
    const all = moments(world, 10);
    return { all, heldFor: world.uprightFor };
  });
  for (const { all, heldFor } of ran) {
    expect(heldFor).toBeGreaterThan(5);
    // The same motion, until rounding has grown.
    const difference = all.slice(0, 40).map(({ state }, k) => apart(state, ran[0]!.all[k]!.state));
    expect(Math.max(...difference)).toBeLessThan(1e-6);
  }
});

test('a size that changes during the motion keeps the pendulum upright', () => {
  const world = new World(new Mujoco(mujoco));
  world.policy = new Policy(readPolicy('sac'));
  world.agentOn = true;
  moments(world, 8);
  const held = world.uprightFor!;
  expect(held).toBeGreaterThan(1);
  for (const size of [...SIZES, 1]) {
    world.plant = { ...world.plant, size };
    moments(world, 1);
  }
  expect(world.uprightFor).toBeCloseTo(held + 5, 6);
});

/// Runs `use` with a file of these bytes.
function withFile(bytes: ArrayBuffer, use: (file: string) => void): void {
  const folder = mkdtempSync(join(tmpdir(), 'upswing-'));
  try {
    const file = join(folder, 'policy.safetensors');
    writeFileSync(file, new Uint8Array(bytes));
    use(file);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/// Runs `use` with a policy that a few steps of training give, and with the name of its file.
function withTrained(
  settings: Record<string, string>,
  use: (policy: Policy, file: string) => void,
): void {
  const learner = new Learner(core(), 'fast', 1, settings);
  const bytes = learner.policy();
  learner.close();
  withFile(bytes, (file) => use(new Policy(bytes), file));
}

test.each(['0.005', '0.01', '0.04', '0.1', '0.001'])(
  'a policy that decides every %s s acts as in `upswing simulate`',
  (period) => {
    withTrained({ control_period: period, episode_seconds: '4' }, (policy, file) => {
      expect(policy.period).toBe(Number(period));
      const world = new World(new ClosedForm());
      world.policy = policy;
      world.agentOn = true;
      world.reset({ ...HANGING, q1: 1 });
      const page = moments(world, 1);
      expect(page.length).toBe(Math.round(1 / Number(period)));
      const flags = ['--seconds', '1', '--start=1,0,0,0', '--physics', 'closed-form'];
      const program = simulate(file, ...flags);
      expect(program.length).toBeGreaterThanOrEqual(page.length);
      page.forEach(({ t, state, torque }, k) => {
        const [at, q1, q2, w1, w2, applied] = program[k] as number[] as [
          ...[number, number, number],
          ...[number, number, number],
        ];
        expect(t).toBeCloseTo(at, 9);
        expect(apart(state, { q1, q2, w1, w2 })).toBeLessThan(1e-9);
        expect(torque).toBe(applied);
      });
    });
  },
);

test.each(['d3qn', 'd3qn-adaptive', 'd3qn-randomized'])(
  '%s at 0.005 s, with a late motor and encoders, acts as in `upswing simulate`',
  (id) => {
    const bytes = withMetadata(readPolicy(id), 'control_period', '0.005');
    withFile(bytes, (file) => {
      const world = new World(new ClosedForm());
      world.plant = { ...NOMINAL, mass2: 1.1 };
      world.policy = new Policy(bytes);
      world.agentOn = true;
      Object.assign(world.disturbance, {
        ...{ delay: 2, sensor_latency: 0.005, encoder_counts: 4096 },
        ...{ velocity_window: 0.01, velocity_filter: 0.004 },
      });
      world.reset({ ...HANGING, q1: 1 });
      const page = moments(world, 2);
      const flags = ['--seconds', '2', '--start=1,0,0,0', '--physics', 'closed-form'];
      flags.push('--set', 'mass2=1.1', '--delay', '0.01', '--sensor-latency', '0.005');
      flags.push('--encoder-counts', '4096', '--velocity-window', '0.01');
      const program = simulate(file, ...flags, '--velocity-filter', '0.004');
      expect(page.length).toBe(400);
      page.forEach(({ state }, k) => {
        const [, q1, q2, w1, w2] = program[k] as [number, number, number, number, number];
        expect(apart(state, { q1, q2, w1, w2 })).toBeLessThan(1e-6);
      });
    });
  },
);

test('two policies with different periods move side by side', () => {
  withTrained({ control_period: '0.007', episode_seconds: '4.2' }, (other) => {
    const world = new World(new ClosedForm());
    world.policy = new Policy(readPolicy('d3qn'));
    world.twin = new World(new ClosedForm());
    world.twin.policy = other;
    world.agentOn = true;
    world.reset();
    moments(world, 7);
    expect(Math.abs(world.twin.elapsed - world.elapsed)).toBeLessThan(0.007);
    const alone = new World(new ClosedForm());
    alone.policy = other;
    alone.agentOn = true;
    alone.reset();
    while (alone.elapsed < world.twin.elapsed - 1e-6) alone.advance();
    expect(alone.state).toEqual(world.twin.state);
  });
});

test('a policy for another size acts on that size as in `upswing simulate`', () => {
  const size = 0.25;
  const plant = { ...NOMINAL, size };
  const settings = Object.fromEntries(
    Object.entries(settingsOf(plant)).map(([name, value]) => [name, `${value}`]),
  );
  withTrained({ ...settings, control_period: '0.01', episode_seconds: '2' }, (policy, file) => {
    const world = new World(new ClosedForm());
    world.plant = plant;
    world.policy = policy;
    world.agentOn = true;
    const { time, torque: unit } = world.units;
    expect(policy.trainedSize).toBeCloseTo(size, 12);
    expect(policy.plant).toEqual(NOMINAL);
    expect(policy.period).toBeCloseTo(0.01 / time, 9);
    world.reset({ ...HANGING, q1: 1 });
    const page = moments(world, 1 / time);
    const flags = ['--seconds', '1', '--start=1,0,0,0', '--physics', 'closed-form'];
    const program = simulate(file, ...flags);
    // Later on, another torque may be the best: the file's plant has its inertias as numbers, which
    // its energy takes instead of those of thin rods.
    page.slice(0, 30).forEach(({ state, torque }, k) => {
      const [, q1, q2, w1, w2, applied] = program[k] as number[] as [
        ...[number, number, number],
        ...[number, number, number],
      ];
      expect(apart(state, { q1, q2, w1: w1 * time, w2: w2 * time })).toBeLessThan(1e-9);
      expect(torque * unit).toBeCloseTo(applied, 12);
    });
  });
});
