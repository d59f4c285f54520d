import { CONTROL_PERIOD, relativeHeight } from '../pendulum';
import type { State } from '../pendulum';
import type { World } from '../world';
import { addressOf } from './address';
import { send } from './clipboard';
import { button, element, write } from './dom';
import { encodeKeys, LONGEST, replay } from './ghost';
import type { Key } from './ghost';
import { warn } from './message';
import { recall, remember } from './storage';

/// The game with the visitor as the motor: how soon are both links up? A ghost repeats the best try,
/// or the try of a visitor who sent a link.

const FALLEN = -0.5; // relative height of the tip below which the pendulum hangs again after a win
const HALF = 0.5; // speed with help
const BALANCED = 1; // s
const AGENT = 2.4; // s, of the default agent, which a test checks

export class Game {
  private readonly world: World;
  private readonly setSpeed: (speed: number) => void;
  private readonly hang: () => void;
  private readonly half = element<HTMLInputElement>('motor-half');
  private readonly arrows = [element('motor-right'), element('motor-left')] as const; // of -1 and 1
  private readonly send = button('motor-send', () => void this.sendResult());
  private counts = false; // whether the visitor is the motor now
  private keys: Key[] = []; // of this try
  private states: State[] = []; // of this try, one more than keys
  private helped = false; // whether a hand or a shove helped in this try
  private up: number | null = null; // s, when both links came up in this try
  private held = 0; // s without a break since then
  private fallen = false;
  private best: { time: number; keys: readonly Key[]; states: readonly State[] } | null = null;
  private record = 0; // s, at this speed, of all visits; 0: none
  private rival: { code: string; time: number; states: readonly State[] } | null = null;
  private said = ''; // result of the last try

  /// `hang` hangs the pendulum.
  constructor(world: World, setSpeed: (speed: number) => void, hang: () => void) {
    this.world = world;
    this.setSpeed = setSpeed;
    this.hang = hang;
    button('motor-again', () => {
      this.said = '';
      this.again();
    });
    this.half.addEventListener('change', () => this.changeSpeed());
  }

  /// Call when the step begins. `code`: a sent try; empty: none.
  open(code: string): void {
    this.counts = true;
    this.rival = null;
    const states = code === '' ? null : replay(code);
    if (states) this.rival = { code, states, time: (states.length - 1) * CONTROL_PERIOD };
    else if (code !== '') warn('The try in the link does not bring both links up.');
    this.half.checked = false;
    this.changeSpeed();
  }

  /// Ends the game and its last try.
  close(): void {
    this.counts = false;
    this.light(0);
  }

  /// The sent try in the page's address; empty: none.
  get code(): string {
    return this.rival?.code ?? '';
  }

  /// The state of the best or sent try at this time since its start; null without one.
  get ghost(): State | null {
    const { states } = this.rival ?? this.best ?? { states: [] };
    if (states.length === 0) return null;
    return states[Math.min(this.keys.length, states.length - 1)]!;
  }

  /// Whose try the ghost repeats.
  get ghostName(): string {
    return this.rival ? 'the sent try' : 'your best try';
  }

  /// A hint or result for the visitor.
  get answer(): string {
    if (this.held > BALANCED) return 'You balanced it by hand! Few do.';
    if (this.said) return this.said;
    if (this.keys.length === 0) {
      return this.rival
        ? `Beat ${seconds(this.rival.time)}: the faint pendulum shows that try.`
        : '';
    }
    if (this.helped) return 'A hand helped. Start over, and use only the motor.';
    return 'Push the way the upper link swings, and change when it turns.';
  }

  /// Call at each control step, once the motor has its torque.
  moment(state: State): void {
    if (!this.counts) return;
    const { world } = this;
    this.held = world.uprightFor ?? 0;
    if (this.up !== null) {
      this.fallen ||= relativeHeight(world.plant, state) < FALLEN;
      return;
    }
    const key = Math.sign(world.byHand) as Key;
    this.helped ||= world.drag !== null || world.push !== null;
    if (this.keys.length === 0 && key === 0) return; // not begun
    this.states.push(state);
    if (world.uprightFor !== null && !this.helped) this.win();
    else if (this.keys.length < LONGEST) this.keys.push(key);
  }

  /// Both links are up.
  private win(): void {
    const { keys, states } = this;
    const time = keys.length * CONTROL_PERIOD;
    this.up = time;
    if (!this.best || time < this.best.time) this.best = { time, keys, states };
    const isRecord = this.record === 0 || time < this.record;
    if (isRecord) {
      this.record = time;
      remember(this.key, String(time));
    }
    this.said = this.resultOf(time, isRecord);
  }

  private resultOf(time: number, isRecord: boolean): string {
    const { rival } = this;
    const so = `Up after ${seconds(time)}`;
    if (rival && time < rival.time)
      return `You won: ${seconds(time)} against ${seconds(rival.time)}.`;
    if (rival) return `${so}. The other try took ${seconds(rival.time)}.`;
    if (time < AGENT - 0.05) return `${so}, faster than the agent, which then stays up!`;
    return isRecord ? `You did it! ${so}; the agent needs ${seconds(AGENT)}.` : `${so}.`;
  }

  /// Call ten times a second.
  draw(): void {
    if (this.fallen) this.again();
    write(element('motor-now'), seconds(this.up ?? this.keys.length * CONTROL_PERIOD));
    write(element('motor-best'), this.record > 0 ? seconds(this.record) : '–');
    this.send.disabled = this.best === null;
    const hint = this.half.checked && this.up === null;
    this.light(hint ? (this.world.state.w1 < 0 ? -1 : 1) : 0);
  }

  /// Marks the arrow that adds energy.
  private light(key: Key): void {
    this.arrows.forEach((arrow, i) => arrow.toggleAttribute('data-hint', key === [-1, 1][i]));
  }

  /// Hangs the pendulum for the next try.
  private again(): void {
    this.hang();
    this.keys = [];
    this.states = [];
    this.helped = this.fallen = false;
    this.up = null;
    this.held = 0;
  }

  /// The record's key in the storage. Half speed has its own record.
  private get key(): string {
    return this.half.checked ? 'soonest-half' : 'soonest';
  }

  private changeSpeed(): void {
    this.setSpeed(this.half.checked ? HALF : 1);
    this.record = Math.max(Number(recall(this.key)) || 0, 0);
    this.best = null;
    this.said = '';
    this.again();
  }

  private sendResult(): Promise<void> {
    const { time, keys } = this.best!;
    const slowly = this.half.checked ? ' at half speed' : '';
    const text = `I got both links of a double pendulum up in ${seconds(time)}${slowly}. Beat me:`;
    return send(text, addressOf(`tour=2&ghost=${encodeKeys(keys)}`), 'Your result');
  }
}

function seconds(time: number): string {
  return `${time.toFixed(1)} s`;
}
