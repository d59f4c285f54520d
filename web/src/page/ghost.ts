import { CONTROL_PERIOD, HANGING, inverted } from '../pendulum';
import type { State } from '../pendulum';
import { ClosedForm } from '../simulator';
import { World } from '../world';

/// A try of the game: the visitor's key at each control step from hanging until both links were up.
/// The same keys give the same motion, so a link holds only them.

export type Key = -1 | 0 | 1; // sign of the torque

export const LONGEST = 60 / CONTROL_PERIOD; // control steps
const SIGNS = '-._'; // of the keys -1, 0 and 1 in a link
const LONGEST_CODE = 2000; // characters

/// Keys for a link: each change is a sign, then the number of steps with base 36.
export function encodeKeys(keys: readonly Key[]): string {
  let code = '';
  for (let from = 0, to = 0; from < keys.length; from = to) {
    while (to < keys.length && keys[to] === keys[from]) ++to;
    code += SIGNS[keys[from]! + 1]! + (to - from).toString(36);
  }
  return code;
}

/// The keys of a link; null if it has none.
function decodeKeys(code: string): Key[] | null {
  if (code.length > LONGEST_CODE || !/^([-._][0-9a-z]{1,3})+$/.test(code)) return null;
  const keys: Key[] = [];
  for (const [, sign, count] of code.matchAll(/([-._])([0-9a-z]+)/g)) {
    const steps = parseInt(count!, 36);
    if (keys.length + steps > LONGEST) return null;
    keys.push(...new Array<Key>(steps).fill((SIGNS.indexOf(sign!) - 1) as Key));
  }
  return keys;
}

/// The states of a try, one for each control step, from hanging to both links up; null if they do
/// not come up.
export function replay(code: string): State[] | null {
  const keys = decodeKeys(code);
  if (!keys) return null;
  const world = new World(new ClosedForm());
  world.reset(HANGING);
  const states: State[] = [world.state];
  for (const key of keys) {
    world.byHand = key * world.plant.torque_limit;
    world.advanceToControl();
    states.push(world.state);
    if (inverted(world.state)) return states;
  }
  return null;
}
