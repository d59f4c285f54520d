import type { State } from '../pendulum';
import { STEPS_PER_SECOND } from '../world';
import type { World } from '../world';

const LONGEST_FRAME = 0.1; // s: a tab that comes back does not jump

/// Advances the world in real time, slower or faster.
export class Clock {
  speed = 1;
  /// Whether the next step can be made, or a controller in another thread still computes.
  ready: () => boolean = () => true;
  private readonly world: World;
  private due = 0; // physics steps not yet made, with a fraction
  private before: State;
  private twinBefore: State | null = null;

  constructor(world: World) {
    this.world = world;
    this.before = world.state;
  }

  /// Advances by `seconds` of real time. False if the state blew up.
  advance(seconds: number): boolean {
    const most = LONGEST_FRAME * this.speed * STEPS_PER_SECOND;
    this.due = Math.min(this.due + seconds * this.speed * STEPS_PER_SECOND, most);
    let sound = true;
    for (; this.due >= 1 && this.ready(); --this.due) {
      this.remember();
      sound = this.world.advance() && sound;
    }
    return sound;
  }

  /// Drops the fraction of a step, after the state was set or advanced step by step.
  settle(): void {
    this.due = 0;
    this.remember();
  }

  private remember(): void {
    this.before = this.world.state;
    this.twinBefore = this.world.twin?.state ?? null;
  }

  /// The state between two physics steps, for smooth slow motion.
  get state(): State {
    return this.between(this.before, this.world.state);
  }

  /// The same for the twin; null without one.
  get twinState(): State | null {
    const { twin } = this.world;
    return twin && this.between(this.twinBefore ?? twin.state, twin.state);
  }

  private between(from: State, to: State): State {
    const share = Math.min(this.due, 1);
    const between = (a: number, b: number) => a + share * (b - a);
    return {
      q1: between(from.q1, to.q1),
      q2: between(from.q2, to.q2),
      w1: between(from.w1, to.w1),
      w2: between(from.w2, to.w2),
    };
  }
}
