import { expect, test } from 'vitest';
import { CONTROL_PERIOD, HANGING, inverted } from '../pendulum';
import { ClosedForm } from '../simulator';
import { World } from '../world';
import { encodeKeys, LONGEST, replay } from './ghost';
import type { Key } from './ghost';

test('the keys of a try give the same motion from a link', () => {
  const world = new World(new ClosedForm());
  world.reset(HANGING);
  const keys: Key[] = [];
  while (!inverted(world.state)) {
    const key: Key = keys.length === 20 ? 0 : world.state.w1 < 0 ? -1 : 1;
    world.byHand = 5 * key;
    world.advanceToControl();
    keys.push(key);
  }
  const code = encodeKeys(keys);
  expect(code).toMatch(/^_k\.1[-_]/);
  const states = replay(code)!;
  expect(states).toHaveLength(keys.length + 1);
  expect(states.at(-1)).toEqual(world.state);
  expect(keys.length * CONTROL_PERIOD).toBeLessThan(6);
});

test.each([
  ...['', '_', 'x1', '_1.', '_zz', '__proto__', `_${LONGEST.toString(36)}_1`, '_1'.repeat(1e6)],
])('%.20s is refused', (code) => {
  expect(replay(code)).toBeNull();
});
