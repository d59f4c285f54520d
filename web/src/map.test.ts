import loadMujoco from '@mujoco/mujoco';
import { beforeAll, expect, test } from 'vitest';
import { readPolicy } from '../tests/program';
import { AXES, isEven, rangeOfValues, shareOf, valueAt, ValueMap, valueOf } from './map';
import { NOMINAL } from './pendulum';
import { Policy } from './policy';
import { Mujoco } from './mujoco';
import { World } from './world';

let world: World;
beforeAll(async () => {
  world = new World(new Mujoco(await loadMujoco()));
});

const STATE = { q1: 2.8, q2: 0.3, w1: -0.7, w2: 1.1 };

test('shares of an axis map to values, and angles repeat after a turn', () => {
  for (const axis of Object.values(AXES)) {
    for (const share of [0, 0.25, 0.5, 0.99]) {
      const state = { ...STATE, [axis.name]: valueAt(axis, share) };
      expect(shareOf(axis, state)).toBeCloseTo(share, 12);
      state[axis.name] += 2 * Math.PI;
      expect(shareOf(axis, state) > 1).toBe(!axis.turns && share + Math.PI / axis.reach > 1);
      if (axis.turns) expect(shareOf(axis, state)).toBeCloseTo(share, 12);
    }
  }
});

/// The decision of an agent in that state.
function direct(map: ValueMap, column: number, row: number): number {
  const there = {
    ...STATE,
    [map.x.name]: valueAt(map.x, (column + 0.5) / map.columns),
    [map.y.name]: valueAt(map.y, (row + 0.5) / map.columns),
  };
  world.reset(there);
  const { decision } = world;
  world.reset(STATE);
  return map.quantity === 'torque' ? decision!.torque : valueOf(decision!);
}

test.each(['d3qn', 'sac', 'd3qn-adaptive', 'd3qn-randomized'])(
  '%s: each cell is a decision in its state',
  (agent) => {
    world.policy = new Policy(readPolicy(agent));
    world.plant = { ...NOMINAL, mass2: 1.1 };
    world.reset(STATE);
    const map = new ValueMap(6);
    for (const [x, y, quantity] of [
      ['q1', 'q2', 'value'],
      ['w1', 'q1', 'value'],
      ['w2', 'w1', 'torque'],
    ] as const) {
      Object.assign(map, { x: AXES[x], y: AXES[y], quantity });
      map.clear();
      expect(map.work(world, 1e9)).toEqual(STATE);
      for (const [column, row] of [
        [0, 0],
        [5, 0],
        [2, 3],
        [5, 5],
      ] as const) {
        expect(map.cells![row * 6 + column]).toBe(Math.fround(direct(map, column, row)));
      }
    }
  },
);

test('a map is computed in slices, all for the state at its beginning', () => {
  world.policy = new Policy(readPolicy('fast'));
  world.reset(STATE);
  const whole = new ValueMap(8);
  whole.work(world, 1e9);
  const sliced = new ValueMap(8);
  let slices = 1;
  while (!sliced.work(world, 0)) {
    ++slices;
    world.advance();
    expect(sliced.cells).toBeNull();
  }
  expect(slices).toBe(64);
  expect(sliced.cells).toEqual(whole.cells);
});

test('the first map can have larger blocks, and the next one all cells', () => {
  world.policy = new Policy(readPolicy('fast'));
  world.reset(STATE);
  const [coarse, fine, both] = [new ValueMap(2), new ValueMap(8), new ValueMap(8, 8, 4)];
  for (const map of [coarse, fine, both]) map.work(world, 1e9);
  const inBlocks = fine.cells!.map((_, i) => {
    const [row, column] = [Math.floor(i / 8), i % 8];
    return coarse.cells![2 * Math.floor(row / 4) + Math.floor(column / 4)]!;
  });
  expect([both.isCoarse, both.cells]).toEqual([true, inBlocks]);
  both.work(world, 1e9);
  expect([both.isCoarse, both.cells]).toEqual([false, fine.cells]);
});

test('without a policy there is no map', () => {
  world.policy = null;
  const map = new ValueMap(4);
  expect(map.work(world, 1e9)).toBeNull();
  expect(map.cells).toBeNull();
});

test('a change of the plant starts the map again', () => {
  world.policy = new Policy(readPolicy('d3qn'));
  world.plant = NOMINAL;
  world.reset(STATE);
  const map = new ValueMap(6);
  expect(map.work(world, 0)).toBeNull(); // one cell
  world.plant = { ...NOMINAL, mass2: 1.3 };
  expect(map.work(world, 1e9)).toEqual(STATE);
  for (const [column, row] of [
    [0, 0],
    [1, 0],
    [5, 5],
  ] as const) {
    expect(map.cells![6 * row + column]).toBeCloseTo(direct(map, column, row), 4);
  }
});

test('a map belongs to the state at its beginning', () => {
  world.plant = NOMINAL;
  world.reset(STATE);
  const map = new ValueMap(6);
  map.work(world, 0);
  world.reset({ ...STATE, w1: 5 });
  expect(map.work(world, 1e9)).toEqual(STATE);
  expect(map.work(world, 1e9)!.w1).toBe(5);
});

test('a nearly even map has nearly even colours', () => {
  const share = (cells: Float32Array, scale: number) => {
    const [low, high] = rangeOfValues(cells, scale);
    return [(Math.min(...cells) - low) / (high - low), (Math.max(...cells) - low) / (high - low)];
  };
  // An untrained network gets the middle of the colours: values 0.02 of a reward apart, at a reward
  // scale of 0.1.
  const untrained = Float32Array.of(0.051, 0.053);
  expect(isEven(untrained, 0.1)).toBe(true);
  for (const one of share(untrained, 0.1)) expect(Math.abs(one - 0.5)).toBeLessThan(0.01);
  // 979 to 992.6 is 1.4% apart.
  const [from, to] = share(Float32Array.of(979, 992.6), 1) as [number, number];
  expect(to - from).toBeLessThan(0.3);
  // Values that differ use all colours.
  const different = Float32Array.of(-10, 700);
  expect(isEven(different, 1)).toBe(false);
  expect(share(different, 1)).toEqual([0, 1]);
});
