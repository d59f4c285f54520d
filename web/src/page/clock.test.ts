import { expect, test } from 'vitest';
import { HANGING } from '../pendulum';
import { Units } from '../size';
import type { World } from '../world';
import { Clock } from './clock';

/// A world whose only number counts its steps. It steps 200 times in a second of its own time.
function counter(size = 1) {
  const world = {
    units: new Units(size),
    timestep: 0.005,
    steps: 0,
    stateAgo(seconds: number) {
      return { ...HANGING, q1: this.steps - seconds / this.timestep };
    },
    advance() {
      ++this.steps;
      return true;
    },
  };
  return { world, clock: new Clock(world as unknown as World) };
}

test('one second is 200 steps, at any rate of frames', () => {
  for (const frames of [24, 60, 144]) {
    const { world, clock } = counter();
    for (let k = 0; k < frames; ++k) clock.advance(1 / frames);
    expect(Math.abs(world.steps - 200)).toBeLessThanOrEqual(1);
  }
});

test('a small pendulum is fast, and a large one slow', () => {
  for (const [size, expected] of [
    [0.04, 1000],
    [9, 67],
  ] as const) {
    const { world, clock } = counter(size);
    for (let k = 0; k < 60; ++k) clock.advance(1 / 60);
    expect(Math.abs(world.steps - expected)).toBeLessThanOrEqual(1);
  }
});

test('slow motion is shown between two steps', () => {
  const { world, clock } = counter();
  clock.speed = 0.1;
  const shown = Array.from({ length: 60 }, () => {
    clock.advance(1 / 60);
    return clock.state.q1;
  });
  expect(world.steps).toBeGreaterThanOrEqual(19);
  expect(new Set(shown.map((q) => q.toFixed(6))).size).toBeGreaterThan(50);
  shown.slice(1).forEach((q, k) => expect(q).toBeGreaterThanOrEqual(shown[k]!));
});

test('a tab that comes back does not jump', () => {
  const { world, clock } = counter();
  clock.advance(3600);
  expect(world.steps).toBe(20);
});
