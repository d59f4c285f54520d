import loadMujoco from '@mujoco/mujoco';
import { readFileSync } from 'node:fs';
import { expect, test } from 'vitest';
import { readPolicy } from '../tests/program';
import { Policy } from './policy';
import { Mujoco } from './mujoco';
import { World } from './world';

/// The agents of the page.

interface List {
  agents: { id: string }[];
}

const list = JSON.parse(
  readFileSync(new URL('../public/agents/agents.json', import.meta.url), 'utf8'),
) as List;
const mujoco = await loadMujoco();

/// Degrees between an absolute angle, 0 hanging, and upright.
function lean(angle: number): number {
  return (180 / Math.PI) * Math.acos(-Math.cos(angle));
}

// The rule for choosing their seeds (docs/howto/page.md), but for 30 s.
test.each(list.agents.map(({ id }) => id))('%s is up within 10 s and stands straight', (id) => {
  const world = new World(new Mujoco(mujoco));
  world.policy = new Policy(readPolicy(id));
  world.agentOn = true;
  const leans: number[] = [];
  world.onMoment = ({ t, state: { q1, q2 } }) => {
    if (t >= 10) leans.push(lean(q1), lean(q1 + q2));
  };
  for (let k = 0; k < 30 * 200; ++k) world.advance();
  expect(world.uprightFor).toBeGreaterThan(20);
  expect(leans.length).toBe(2000);
  expect(Math.max(...leans)).toBeLessThan(10);
});
