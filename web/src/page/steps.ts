import { NOMINAL, relativeHeight } from '../pendulum';
import type { Label } from '../view/labels';
import type { World } from '../world';
import { button, element } from './dom';
import { prefersStill } from './motion';
import { MotorKeys } from './motor';
import { OWN } from './share';
import type { Shared } from './share';
import { Slider } from './sliders';

/// The steps of the tour: what each does with the page, and what it says to what has happened. Their
/// words and controls are in index.html.

/// What a step does with the page.
export interface Stage {
  readonly world: World;
  /// Chooses agent and settings, all others as at the beginning; the pendulum moves on. False if others
  /// were asked for meanwhile.
  take(shared: Partial<Shared>): Promise<boolean>;
  /// The same, from hanging.
  begin(shared: Partial<Shared>): Promise<boolean>;
  setAgentOn(on: boolean): void;
  setSpeed(speed: number): void;
  setMass(kilograms: number): void; // of the lower link
  /// From hanging.
  reset(): void;
  /// What the map shows at first.
  resetMap(): void;
  readonly learn: { start(): void; stop(): void; readonly story: string; readonly keeps: boolean };
}

export interface Step {
  readonly id: string; // "step-ID" is its element
  readonly agents: readonly string[]; // without which it is left out
  readonly keys?: readonly string[]; // of the page's, that it names; the others do nothing
  readonly labels?: (world: World) => Label[]; // on the stage
  /// When it is shown.
  begin(): Promise<void>;
  /// When another is shown.
  end?(): void;
  /// When a click on the map has started it somewhere.
  started?(): void;
  /// Ten times a second. What to say to what the visitor did, empty for nothing.
  answer?(world: World): string;
}

const NOMINAL_AGENT = 'd3qn';
const ADAPTIVE_AGENT = 'd3qn-adaptive';
const LIGHT = 0.75; // kg
const HELD = 2; // s upright that count as balanced
const FAILED = 10; // s without, that count as failed
const ARROWS = ['ArrowLeft', 'ArrowRight'];
const GOAL: Label = { at: 'goal', text: 'both links in here' };

const heldFor = (world: World) => world.uprightFor ?? 0;

function watch(stage: Stage): Step {
  const swingUp = () => {
    stage.setAgentOn(true);
    stage.reset();
  };
  const again = button('watch-again', swingUp);
  return {
    id: 'watch',
    agents: [NOMINAL_AGENT],
    labels: () => [GOAL, { at: 'motor', text: 'the motor' }],
    async begin() {
      again.textContent = prefersStill() ? 'Swing up' : 'Swing up again';
      await stage.begin({ agent: NOMINAL_AGENT, on: !prefersStill() });
    },
    answer: (world) =>
      heldFor(world) > HELD ? 'Balanced. How hard can it be? Go on and try it yourself.' : '',
  };
}

function motor(stage: Stage): Step {
  const keys = new MotorKeys(stage.world);
  let best = 0; // share of the way up
  let byHand = false;
  return {
    id: 'motor',
    agents: [],
    labels: ({ torque }) => (torque === 0 ? [GOAL] : [GOAL, { at: 'motor', text: 'your torque' }]),
    async begin() {
      best = 0;
      byHand = false;
      keys.enabled = true;
      await stage.begin({ agent: NOMINAL_AGENT, on: false });
    },
    end() {
      keys.enabled = false;
    },
    answer(world) {
      best = Math.max(best, (relativeHeight(world.plant, world.state) + 1) / 2);
      byHand ||= heldFor(world) > 1;
      if (byHand) return 'You balanced it by hand! Hardly anybody does.';
      if (best < 0.02) return '';
      const atTop = relativeHeight(world.plant, world.state) > 0.8;
      const hint = atTop ? 'Now catch it at the top …' : 'Push in time with the swing.';
      return `Your best: ${Math.round(100 * best)}% of the way up. ${hint}`;
    },
  };
}

function agent(stage: Stage): Step {
  const on = button('tour-agent', () => stage.setAgentOn(!stage.world.agentOn));
  return {
    id: 'agent',
    agents: [NOMINAL_AGENT],
    labels: ({ torque }) => (torque === 0 ? [] : [{ at: 'motor', text: 'its torque' }]),
    async begin() {
      await stage.take({ agent: NOMINAL_AGENT, on: false });
    },
    answer(world) {
      on.ariaPressed = String(world.agentOn);
      return world.agentOn && heldFor(world) > HELD
        ? 'The same motor as yours. It learned this in 80 minutes of swinging, computed within seconds.'
        : '';
    },
  };
}

function shove(stage: Stage): Step {
  let shoved = 0; // time of the last shove (s)
  let fell = false;
  const push = (direction: -1 | 1) => stage.world.shoveTo(direction);
  button('tour-shove-left', () => push(-1));
  button('tour-shove-right', () => push(1));
  return {
    id: 'shove',
    agents: [NOMINAL_AGENT],
    keys: ARROWS,
    async begin() {
      await stage.take({ agent: NOMINAL_AGENT, on: true });
      shoved = 0;
      fell = false;
    },
    answer(world) {
      if (world.push) {
        shoved = world.time;
        if (heldFor(world) > HELD) fell = false; // it begins anew
      }
      if (shoved === 0) return heldFor(world) > HELD ? '' : 'Wait until it is up …';
      if (heldFor(world) === 0) fell = true;
      if (fell && heldFor(world) > HELD) return 'Down, and up again by itself.';
      if (fell) return 'Down it goes …';
      if (world.time - shoved < HELD) return 'It works to catch that …';
      return 'It caught that one. Now several, quickly.';
    },
  };
}

function mass(stage: Stage): Step {
  let changed = 0; // when (s); 0 if never
  const slider = new Slider(
    {
      ...{ name: 'tour-mass', label: 'Mass of the orange link', unit: 'kg' },
      ...{ min: 0.7, max: 1.3, limits: [0.7, 1.3], step: 0.05, initial: NOMINAL.mass2 },
    },
    (kilograms) => {
      stage.setMass(kilograms);
      stage.reset();
      changed = stage.world.time;
    },
  );
  slider.trained = [NOMINAL.mass2, NOMINAL.mass2];
  element('tour-mass-slider').append(slider.element);
  return {
    id: 'mass',
    agents: [NOMINAL_AGENT],
    labels: ({ plant }) => [{ at: 'link2', text: `${plant.mass2} kg` }],
    async begin() {
      slider.value = NOMINAL.mass2;
      changed = 0;
      await stage.take({ agent: NOMINAL_AGENT, on: true });
    },
    answer(world) {
      const seconds = world.time - changed;
      if (changed === 0) return '';
      if (heldFor(world) > HELD) return `It still holds ${slider.value} kg.`;
      if (seconds < FAILED) return `It tries ${slider.value} kg …`;
      return `It cannot hold ${slider.value} kg: too far from the 1 kg that it learned with.`;
    },
  };
}

function many(stage: Stage): Step {
  let begun = 0; // s
  const choice = element<HTMLFieldSetElement>('tour-agents');
  const input = (id: string) => choice.querySelector<HTMLInputElement>(`[value=${id}]`)!;
  const plant = { ...NOMINAL, mass2: LIGHT };
  choice.addEventListener('change', () => {
    const agent = input(ADAPTIVE_AGENT).checked ? ADAPTIVE_AGENT : NOMINAL_AGENT;
    begun = stage.world.time;
    void stage.begin({ agent, plant, on: true });
  });
  return {
    id: 'many',
    agents: [NOMINAL_AGENT, ADAPTIVE_AGENT],
    labels: () => [{ at: 'link2', text: `${LIGHT} kg` }],
    async begin() {
      input(NOMINAL_AGENT).checked = true;
      begun = 0;
      await stage.begin({ agent: NOMINAL_AGENT, plant, on: true });
    },
    answer(world) {
      const holds = heldFor(world) > HELD;
      if (!input(ADAPTIVE_AGENT).checked) {
        if (holds) return 'It holds, for now …';
        const tried = world.time - begun > FAILED;
        return tried ? 'This one fails again and again.' : 'It tries …';
      }
      return holds
        ? 'It holds: it feels out which pendulum it has, and balances that one.'
        : 'It tries …';
    },
  };
}

function values(stage: Stage): Step {
  const speed = element<HTMLInputElement>('tour-speed');
  const show = () => {
    element('tour-speed-value').textContent = `${speed.value}×`;
    stage.setSpeed(Number(speed.value));
  };
  speed.addEventListener('input', show);
  return {
    id: 'values',
    agents: [NOMINAL_AGENT],
    keys: ARROWS,
    async begin() {
      speed.value = '1';
      element('tour-speed-value').textContent = '1×';
      await stage.begin({ agent: NOMINAL_AGENT, on: true });
    },
    answer: (world) =>
      heldFor(world) > HELD
        ? 'Upright, a small torque is the highest bar. Drag it down, and see the bars change.'
        : '',
  };
}

function map(stage: Stage): Step {
  let clicked = false;
  return {
    id: 'map',
    agents: [NOMINAL_AGENT],
    async begin() {
      clicked = false;
      stage.resetMap();
      await stage.take({ agent: NOMINAL_AGENT, on: true });
    },
    started() {
      clicked = true;
      stage.setAgentOn(true);
    },
    answer(world) {
      if (!clicked) return '';
      return heldFor(world) > HELD
        ? 'From there it found its way to the bright middle: upright.'
        : 'Follow the dot …';
    },
  };
}

function learn(stage: Stage): Step {
  const start = button('tour-learn', () => stage.learn.start());
  return {
    id: 'learn',
    agents: [NOMINAL_AGENT],
    async begin() {
      const learned = stage.learn.keeps;
      await stage.begin({ agent: learned ? OWN : NOMINAL_AGENT, on: learned });
    },
    end: () => stage.learn.stop(),
    answer() {
      const { story } = stage.learn;
      start.textContent = story === '' ? 'Learn' : 'Start over';
      return story;
    },
  };
}

export function makeSteps(stage: Stage): Step[] {
  return [watch, motor, agent, shove, mass, many, values, map, learn].map((make) => make(stage));
}
