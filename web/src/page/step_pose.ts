import { GOALS } from '../pendulum';
import { ANY_POSE_AGENT, enter, heldFor } from './step';
import type { Stage, Step } from './step';
import { HELD } from './verdict';

/// A step of the tour: an agent for every pose.
export function pose(stage: Stage): Step {
  const reached = new Set<string>();
  return {
    id: 'pose',
    agents: [ANY_POSE_AGENT],
    moves: true,
    async begin() {
      reached.clear();
      await enter(stage, { agent: ANY_POSE_AGENT, goal: 'up-down', on: true });
    },
    answer(world) {
      if (!world.agentOn) return '';
      if (heldFor(world) < HELD) return 'It is on its way …';
      reached.add(world.goal.name);
      const all = Object.keys(GOALS).length;
      if (reached.size === all) return 'All four. Each of the twelve ways is a feat of its own.';
      return `${reached.size} of ${all} poses. Choose another one.`;
    },
  };
}
