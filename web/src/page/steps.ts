import { NOMINAL } from '../pendulum';
import type { State } from '../pendulum';
import type { Label } from '../view/labels';
import type { Moment, World } from '../world';
import { addressOf } from './address';
import { send } from './clipboard';
import { button, element, write } from './dom';
import { Game } from './game';
import { prefersStill } from './motion';
import { MotorKeys } from './motor';
import { OWN } from './share';
import type { Shared } from './share';

/// The steps of the tour: their actions on the page, and their answers to the visitor. Their words
/// and controls are in index.html.

/// The parts of the page that steps use.
export interface Stage {
  readonly world: World;
  /// Sets agent and settings; all others get their initial values. The pendulum moves on. False if
  /// a later request replaced this one.
  take(shared: Partial<Shared>): Promise<boolean>;
  /// The same as take(), and hangs the pendulum.
  begin(shared: Partial<Shared>): Promise<boolean>;
  /// Changes only the agent. False if it cannot be loaded or a later request replaced it.
  choose(agent: string): Promise<boolean>;
  readonly agents: { has(id: string): boolean; isHere(id: string): boolean };
  setAgentOn(on: boolean): void;
  setSpeed(speed: number): void;
  /// Hangs the pendulum.
  reset(): void;
  /// Sets the map's first quantity.
  resetMap(): void;
  readonly learn: {
    start(): void;
    /// Starts, pauses or resumes the training.
    toggle(): void;
    show(): void;
    readonly paused: boolean;
    readonly story: { readonly count: string; readonly milestone: string };
    readonly keeps: boolean;
    readonly begun: boolean;
  };
}

export interface Step {
  readonly id: string; // its element is "step-ID"
  readonly agents: readonly string[]; // needed for this step; without them it is left out
  readonly keys?: readonly string[]; // the page's keys that it names; all others do nothing
  readonly labels?: (world: World) => Label[]; // on the stage
  /// Called when the step is shown. `ghost`: a try in the address; empty: none.
  begin(ghost: string): Promise<void>;
  /// Called when another step is shown.
  end?(): void;
  /// Whether its pendulum moves at once. With reduced motion it waits for a button.
  readonly moves?: boolean;
  /// A pendulum to draw behind the first one.
  readonly ghost?: () => State | null;
  /// The try in the page's address; empty: none.
  readonly code?: () => string;
  /// Called at each control step.
  moment?(moment: Moment): void;
  /// Called after a click on the map started the pendulum somewhere.
  started?(): void;
  /// The answer to the visitor's actions, asked for ten times a second; empty: none.
  answer?(world: World): string;
}

const NOMINAL_AGENT = 'd3qn';
const SMALL_AGENT = 'fast'; // a twentieth of the default agent's size
const ADAPTIVE_AGENT = 'd3qn-adaptive';
const LIGHT = 0.75; // kg
const HELD = 2; // s upright that count as balanced
const WON = 5; // s upright that win a race
const LONGEST = 20; // s, of a race
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
      const on = !prefersStill();
      again.textContent = on ? 'Swing up again' : 'Swing up';
      const { agents } = stage;
      if (agents.isHere(NOMINAL_AGENT) || !agents.has(SMALL_AGENT))
        return void (await stage.begin({ agent: NOMINAL_AGENT, on }));
      // The small agent loads within a moment; the large one replaces it during the swing.
      if (await stage.begin({ agent: SMALL_AGENT, on })) void stage.choose(NOMINAL_AGENT);
    },
    answer: (world) =>
      heldFor(world) > HELD
        ? 'Balanced, after 80 minutes of practice. Can you do that? Press Next and try it.'
        : '',
  };
}

function motor(stage: Stage): Step {
  const keys = new MotorKeys(stage.world);
  const game = new Game(
    stage.world,
    (speed) => stage.setSpeed(speed),
    () => stage.reset(),
  );
  return {
    id: 'motor',
    agents: [],
    labels: ({ torque }) => [
      GOAL,
      ...(torque === 0 ? [] : [{ at: 'motor', text: 'your torque' } as const]),
      ...(game.ghost ? [{ at: 'ghost', text: game.ghostName } as const] : []),
    ],
    async begin(ghost) {
      keys.enabled = true;
      if (await stage.begin({ agent: NOMINAL_AGENT, on: false })) game.open(ghost);
    },
    end() {
      keys.enabled = false;
      game.close();
    },
    ghost: () => game.ghost,
    code: () => game.code,
    moment: ({ state }) => game.moment(state),
    answer() {
      game.draw();
      return game.answer;
    },
  };
}

function learn(stage: Stage): Step {
  const start = button('tour-learn', () => {
    if (stage.learn.paused) stage.learn.toggle();
    else stage.learn.start();
  });
  return {
    id: 'learn',
    agents: [NOMINAL_AGENT],
    labels: () => (stage.learn.begun ? [{ at: 'goal', text: 'expected points' }] : []),
    async begin() {
      const learned = stage.learn.keeps;
      const on = learned && !prefersStill();
      if (!(await stage.begin({ agent: learned ? OWN : NOMINAL_AGENT, on }))) return;
      stage.learn.show();
    },
    answer() {
      const { count, milestone } = stage.learn.story;
      start.textContent = stage.learn.paused ? 'Resume' : milestone === '' ? 'Learn' : 'Start over';
      write(element('tour-count'), count);
      return milestone;
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
    moves: true,
    keys: ARROWS,
    async begin() {
      await enter(stage, { agent: NOMINAL_AGENT, on: true });
      shoved = 0;
      fell = false;
    },
    answer(world) {
      if (world.push) {
        shoved = world.time;
        if (heldFor(world) > HELD) fell = false; // so that the next fall counts as another one
      }
      if (shoved === 0)
        return heldFor(world) > HELD || !world.agentOn ? '' : 'Wait until it is up …';
      if (heldFor(world) === 0) fell = true;
      if (fell && heldFor(world) > HELD) return 'It fell, and swung up again by itself.';
      if (fell) return 'It falls …';
      if (world.time - shoved < HELD) return 'It catches the shove …';
      return 'It caught that shove. Now try several, quickly.';
    },
  };
}

/// A race of two agents with a pendulum that is new to one of them.
function bet(stage: Stage): Step {
  let onMany = false; // the visitor's bet
  let decided = '';
  let begun = 0; // s, in the world's time
  const race = { agent: NOMINAL_AGENT, twin: ADAPTIVE_AGENT, plant: { ...NOMINAL, mass2: LIGHT } };
  const choices = [
    [button('bet-one', () => void run(false)), false],
    [button('bet-many', () => void run(true)), true],
  ] as const;

  /// Hangs both pendulums, and starts them if there is a bet.
  const begin = async (on: boolean) => {
    if (!(await stage.begin({ ...race, on }))) return;
    decided = '';
    begun = stage.world.time;
  };
  const run = (many: boolean) => {
    onMany = many;
    for (const [choice, of] of choices) choice.ariaPressed = String(of === many);
    return begin(true);
  };
  return {
    id: 'bet',
    agents: [NOMINAL_AGENT, ADAPTIVE_AGENT],
    labels: () => [{ at: 'link2', text: `${LIGHT} kg` }],
    async begin() {
      for (const [choice] of choices) choice.ariaPressed = 'false';
      await begin(false);
    },
    answer(world) {
      write(element('first-name'), 'learned on one');
      write(element('twin-name'), 'learned on many');
      if (!world.agentOn || !world.twin) return '';
      const [one, many] = [heldFor(world), heldFor(world.twin)];
      decided ||= verdictOf(onMany, one, many, world.time - begun);
      return decided || 'Both try …';
    },
  };
}

/// The result of the race for a bet on the agent of many pendulums, or on the other; empty while it
/// goes on. `one` and `many`: how long (s) each has balanced; `raced`: duration (s).
function verdictOf(onMany: boolean, one: number, many: number, raced: number): string {
  if (many > WON && one < HELD) return `${onMany ? RIGHT : LOST}: ${MANY_HOLDS}`;
  if (one > WON && many < HELD) return `${onMany ? LOST : RIGHT}: ${ONE_HOLDS}`;
  if (one > WON && many > WON) return BOTH_HOLD;
  return raced > LONGEST && one < HELD && many < HELD ? NONE_HOLDS : '';
}

const RIGHT = 'You were right';
export const LOST = 'You lost';
const MANY_HOLDS =
  'only the agent that learned on many balances it: it estimates the mass from the motion.';
const ONE_HOLDS = 'only the agent that learned on one balances it.';
const BOTH_HOLD = 'A draw: both balance it.';
const NONE_HOLDS = `A draw: neither balances it within ${LONGEST} s.`;

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
    moves: true,
    keys: ARROWS,
    async begin() {
      speed.value = '1';
      element('tour-speed-value').textContent = '1×';
      await stage.begin({ agent: NOMINAL_AGENT, on: !prefersStill() });
    },
    answer: (world) =>
      heldFor(world) > HELD
        ? 'Upright, small torques are best. Drag the pendulum and watch the bars.'
        : '',
  };
}

function map(stage: Stage): Step {
  let clicked = false;
  return {
    id: 'map',
    agents: [NOMINAL_AGENT],
    moves: true,
    async begin() {
      clicked = false;
      stage.resetMap();
      await enter(stage, { agent: NOMINAL_AGENT, on: true });
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

/// The last step: a summary and links.
function end(stage: Stage): Step {
  button('tour-send', () => void send(INVITATION, addressOf('tour'), 'An invitation'));
  return {
    id: 'end',
    agents: [NOMINAL_AGENT],
    moves: true,
    async begin() {
      const agent = stage.learn.keeps ? OWN : NOMINAL_AGENT;
      await stage.begin({ agent, on: !prefersStill() });
      element('tour-end').textContent = stage.learn.keeps
        ? 'Everything, with your own agent'
        : 'Everything at once';
    },
  };
}

const INVITATION = 'A double pendulum learns to stand up, in your browser. Can you do it by hand?';

/// Swings at once; with reduced motion the pendulum hangs and waits.
function enter(stage: Stage, shared: Partial<Shared>): Promise<boolean> {
  return prefersStill() ? stage.begin({ ...shared, on: false }) : stage.take(shared);
}

export function makeSteps(stage: Stage): Step[] {
  return [watch, motor, learn, shove, bet, values, map, end].map((make) => make(stage));
}
