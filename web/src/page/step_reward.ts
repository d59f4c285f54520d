import { CONTROL_PERIOD } from '../pendulum';
import { button, element, write } from './dom';
import { NOMINAL_AGENT } from './step';
import type { Stage, Step } from './step';

/// A step of the tour: three rewards, and what an agent makes of them.

const SEEN = 3; // s of turning or rest until the answer says so
const FAST = 4; // rad/s
const SLOW = 0.3; // rad/s

interface Preset {
  readonly id: string;
  readonly reward: string;
  /// What the agent does once it has learned its reward; empty before.
  readonly found: (speed: number, height: number) => string;
}

/// `speed`: mean velocity of the upper link, rad/s; `height`: mean height of the tip, 0 hanging to 1.
const PRESETS: readonly Preset[] = [
  {
    id: 'spin',
    reward: 'spin: 0.2*w1',
    found: (speed) =>
      speed > FAST
        ? `It spins, ${(speed / (2 * Math.PI)).toFixed(1)} turns a second. Why stand still? That earns nothing.`
        : '',
  },
  {
    id: 'height',
    reward: 'height: h',
    found: (_, height) =>
      height > 0.7 ? 'It stays high, but it need not stand still: no points for that.' : '',
  },
  {
    id: 'lazy',
    reward: 'balance: 5*inverted; lazy: -0.4*tau^2',
    found: (speed, height) =>
      Math.abs(speed) < SLOW && height < 0.1
        ? 'It hangs and rests. Each effort costs points at once, and it never finds out what standing brings.'
        : '',
  },
];

export function reward(stage: Stage): Step {
  let chosen: Preset | null = null;
  let speed = 0;
  let height = 0;
  let found = '';
  const buttons = PRESETS.map((preset) => button(`reward-${preset.id}`, () => run(preset)));
  const mark = () => buttons.forEach((one, i) => (one.ariaPressed = String(PRESETS[i] === chosen)));
  const run = (preset: Preset) => {
    chosen = preset;
    [speed, height, found] = [0, 0, ''];
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
    moment({ state: { w1 }, height: now }) {
      const share = CONTROL_PERIOD / SEEN; // of a control step in the running means
      speed += share * (w1 - speed);
      height += share * ((now + 1) / 2 - height);
    },
    answer() {
      write(element('reward-count'), chosen ? stage.learn.story.count : '');
      if (!chosen) return '';
      found = chosen.found(speed, height) || found;
      return found || 'It tries …';
    },
  };
}
