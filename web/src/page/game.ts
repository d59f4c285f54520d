import { CONTROL_PERIOD, relativeHeight } from '../pendulum';
import type { State } from '../pendulum';
import type { World } from '../world';
import { addressOf } from './address';
import { copy } from './clipboard';
import { button, element, write } from './dom';
import { recall, remember } from './storage';

/// The game with the visitor as the motor: how long do both links stay up? A ghost repeats the best
/// try.

const LONGEST = 30 / CONTROL_PERIOD; // longest try of a ghost, in states
const FALLEN = -0.5; // relative height of the tip below which a try ends
const HALF = 0.5; // speed with help
const BALANCED = 1; // s

export class Game {
  private readonly world: World;
  private readonly setSpeed: (speed: number) => void;
  private readonly half = element<HTMLInputElement>('motor-half');
  private readonly send = button('motor-send', () => void this.copyResult());
  private counts = false; // whether the visitor is the motor now
  private states: State[] = []; // of this try, one per control step
  private up = 0; // s upright without a break, in this try
  private longest = 0; // s, the most of this try
  private held = 0; // s, world time of the hand's last grip
  private best = 0; // s, at this speed
  private key = ''; // storage key of `best`
  private said = ''; // result of the last try
  private bestStates: readonly State[] = [];
  private highest = -1; // relative height of the tip, over all tries

  /// `again` hangs the pendulum.
  constructor(world: World, setSpeed: (speed: number) => void, again: () => void) {
    this.world = world;
    this.setSpeed = setSpeed;
    button('motor-again', () => {
      again();
      this.next();
    });
    this.half.addEventListener('change', () => this.changeSpeed());
  }

  /// Call when the step begins.
  open(): void {
    this.counts = true;
    this.highest = -1;
    this.states = [];
    this.up = this.longest = 0;
    this.half.checked = false;
    this.changeSpeed();
  }

  /// Ends the game and its last try.
  close(): void {
    this.next();
    this.counts = false;
  }

  /// The best try's state at this time since its start; null without one.
  get ghost(): State | null {
    return this.bestStates[this.states.length] ?? null;
  }

  /// A hint or result for the visitor.
  get answer(): string {
    if (this.up > BALANCED) return 'You balanced it by hand! Few do.';
    if (this.said || this.states.length === 0) return this.said;
    const percent = 10 * Math.round(5 * (1 + this.highest));
    const so = percent > 0 ? `Highest so far: ${percent}% of the way up. ` : '';
    return `${so}Push the way it swings, and change when it turns.`;
  }

  /// Call at each control step.
  moment(state: State): void {
    if (!this.counts) return;
    const { world } = this;
    if (world.drag) this.held = world.time;
    this.states.push(state);
    this.up = Math.min(world.uprightFor ?? 0, world.time - this.held);
    this.longest = Math.max(this.longest, this.up);
    if (this.longest > this.best) {
      this.best = this.longest;
      this.bestStates = this.states;
    }
    const height = relativeHeight(world.plant, state);
    if (world.time > this.held) this.highest = Math.max(this.highest, height);
    const fallen = height < FALLEN;
    if (this.states.length >= LONGEST || (this.longest > 0 && fallen)) this.next();
  }

  /// Call at each frame.
  draw(): void {
    write(element('motor-now'), seconds(this.up));
    write(element('motor-best'), seconds(this.best));
    this.send.disabled = this.best < 0.1;
  }

  /// Ends a try and begins the next.
  next(): void {
    if (this.longest > 0) {
      const isBest = this.bestStates === this.states;
      if (isBest) remember(this.key, String(this.best));
      this.said = isBest
        ? `Your best: ${seconds(this.best)}.`
        : `${seconds(this.longest)} this time.`;
    }
    this.states = [];
    this.up = this.longest = 0;
  }

  private changeSpeed(): void {
    this.next();
    this.setSpeed(this.half.checked ? HALF : 1);
    this.key = this.half.checked ? 'best-half' : 'best'; // half speed has its own record
    this.best = Math.max(Number(recall(this.key)) || 0, 0);
    this.bestStates = [];
    this.said = '';
  }

  private copyResult(): Promise<void> {
    const slowly = this.half.checked ? ', at half speed' : '';
    const text = `I held both links of a double pendulum up for ${seconds(this.best)} by hand${slowly}. Can you?`;
    return copy(`${text} ${addressOf('tour=2')}`, 'Your result');
  }
}

function seconds(time: number): string {
  return `${time.toFixed(1)} s`;
}
