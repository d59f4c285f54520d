import type { Policy } from '../policy';
import { CONTROL_PERIOD, inverted, rewardTerms } from '../pendulum';
import type { State } from '../pendulum';
import { ClosedForm } from '../simulator';
import { World } from '../world';
import { rowOf } from './asker';
import type { Asker } from './asker';

/// Scores by the program's rules (src/pendulum/task.h): an episode lasts 20 s and succeeds if both
/// links are upright throughout the last 10 s; its return is the sum of the rewards of the first
/// 10 s.

const SECONDS = 20; // of an episode
const SLICE = 25; // control steps between two reports

/// Starts near hanging, drawn as those of the program: q1, q2 (rad), w1, w2 (rad/s).
const STARTS = [
  [0.083, -0.041, 0.112, -0.067],
  [-0.126, 0.094, -0.035, 0.021],
  [0.014, 0.158, 0.072, -0.143],
  [-0.052, -0.117, 0.161, 0.088],
  [0.191, 0.026, -0.098, 0.047],
  [-0.007, -0.063, -0.148, -0.011],
  [0.105, 0.071, 0.004, 0.132],
  [-0.089, -0.018, 0.057, -0.104],
  [0.037, -0.172, -0.081, 0.009],
  [-0.143, 0.049, 0.026, 0.165],
] as const;

export const EPISODES = STARTS.length;

export interface Score {
  balanced: number; // episodes of EPISODES
  swingUp: number | null; // s, median over those
  return: number; // mean over all
}

interface Episode {
  readonly world: World;
  sum: number; // rewards
  upSince: number | null; // control step
}

/// Scores a policy, or a controller in another thread. The same one always gets the same score.
/// `onProgress` gets the share that is done. Never settles after a refusal.
export async function scoreOf(
  controller: Policy | Asker,
  onProgress: (share: number) => void,
): Promise<Score> {
  const episodes = STARTS.map(([q1, q2, w1, w2]) => begin(controller, { q1, q2, w1, w2 }));
  const period = 'controller' in controller ? controller.period : CONTROL_PERIOD;
  const steps = Math.round(SECONDS / period);
  for (let k = 0; k < steps; ++k) {
    if (!('controller' in controller)) {
      const rows = new Float64Array(episodes.flatMap(({ world }) => [...rowOf(world)]));
      const torques = await controller.ask(rows);
      episodes.forEach(({ world }, i) => (world.byHand = torques[i]!));
    }
    for (const episode of episodes) advance(episode, k, steps / 2);
    if (k % SLICE === 0) onProgress(k / steps);
  }
  const ups = episodes.flatMap(({ upSince }) =>
    upSince !== null && upSince <= steps / 2 ? [upSince * period] : [],
  );
  return {
    balanced: ups.length,
    swingUp: median(ups),
    return: episodes.reduce((sum, episode) => sum + episode.sum, 0) / EPISODES,
  };
}

function begin(controller: Policy | Asker, start: State): Episode {
  const world = new World(new ClosedForm());
  if ('controller' in controller) {
    world.policy = controller;
    world.agentOn = true;
  }
  world.reset(start);
  return { world, sum: 0, upSince: null };
}

/// Control step `k` of an episode whose rewards count up to step `half`.
function advance(episode: Episode, k: number, half: number): void {
  const { world } = episode;
  world.advanceToControl();
  const { plant, state, torque } = world;
  if (k < half) for (const term of rewardTerms(plant, state, torque)) episode.sum += term;
  if (!inverted(state)) episode.upSince = null;
  else episode.upSince ??= k + 1;
}

function median(numbers: number[]): number | null {
  if (numbers.length === 0) return null;
  const sorted = numbers.toSorted((a, b) => a - b);
  const middle = (sorted.length - 1) / 2;
  return (sorted[Math.floor(middle)]! + sorted[Math.ceil(middle)]!) / 2;
}
