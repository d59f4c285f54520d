import { CONTROL_PERIOD } from '../pendulum';
import { button, element, write } from './dom';
import { NOMINAL_AGENT } from './step';
import type { Stage, Step } from './step';

/// A step of the tour: three rewards, and what an agent makes of them.

const MEMORY = 3; // s that the means remember
const FAST = 4; // rad/s
const SLOW = 0.3; // rad/s

interface Preset {
  readonly id: string;
  readonly reward: string;
  /// What the agent does once it has learned its reward; empty before.
  readonly found: (seen: Seen) => string;
}

/// Running means of a motion.
interface Seen {
  turning: number; // velocity of the upper link, rad/s
  moving: number; // its size, rad/s
  height: number; // of the tip, 0 hanging to 1
}

/// Starting values that fit no answer, so that each takes several seconds of motion.
const START: Readonly<Seen> = { turning: 0, moving: FAST, height: 0.5 };

const PRESETS: readonly Preset[] = [
  {
    id: 'spin',
    reward: 'spin: 0.2*w1',
    found: ({ turning }) =>
      turning > FAST
        ? `It spins, ${(turning / (2 * Math.PI)).toFixed(1)} turns a second. Why stand still? That earns nothing.`
        : '',
  },
  {
    id: 'height',
    reward: 'height: h',
    found: ({ height }) =>
      height > 0.7
        ? 'It stays up: nowhere else is as high. You did not have to ask for balance.'
        : '',
  },
  {
    id: 'lazy',
    reward: 'balance: 5*inverted; lazy: -0.4*tau^2',
    found: ({ moving, height }) =>
      moving < SLOW && height < 0.1
        ? 'It hangs and rests. Each effort costs points at once, and it never finds out what standing brings.'
        : '',
  },
];

export function reward(stage: Stage): Step {
  let chosen: Preset | null = null;
  let seen: Seen = START;
  let found = '';
  const buttons = PRESETS.map((preset) => button(`reward-${preset.id}`, () => run(preset)));
  const mark = () => buttons.forEach((one, i) => (one.ariaPressed = String(PRESETS[i] === chosen)));
  const run = (preset: Preset) => {
    chosen = preset;
    seen = START;
    found = '';
    mark();
    stage.learn.tryReward(preset.reward);
  };
  return {
    id: 'reward',
    agents: [NOMINAL_AGENT],
    async begin() {
      chosen = null;
      mark();
      await stage.begin({ agent: NOMINAL_AGENT, on: false });
    },
    end: () => stage.learn.endTry(),
    moment({ state: { w1 }, height }) {
      const share = CONTROL_PERIOD / MEMORY; // of a control step in the running means
      const mean = (before: number, now: number) => before + share * (now - before);
      seen = {
        turning: mean(seen.turning, w1),
        moving: mean(seen.moving, Math.abs(w1)),
        height: mean(seen.height, (height + 1) / 2),
      };
    },
    answer() {
      write(element('reward-count'), chosen ? stage.learn.story.count : '');
      if (!chosen) return '';
      found = chosen.found(seen) || found;
      return found || 'It tries …';
    },
  };
}
