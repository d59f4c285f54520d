import type { State } from '../pendulum';
import type { World } from '../world';

const LONGEST_FRAME = 0.1; // s: a tab that comes back does not jump
const ROUNDING = 1e-9; // s
const BUSIEST = 50; // ms of computing in a frame, after which the pendulum lags behind real time

/// Advances the world in real time, slower or faster. A small pendulum is fast, and a large one slow.
export class Clock {
  speed = 1;
  /// Real time (s) that was left out because the agent takes longer than its control period.
  lag = 0;
  /// Whether the next step can be made, or a controller in another thread still computes.
  ready: () => boolean = () => true;
  private readonly world: World;
  private due = 0; // s of the world's time, not yet advanced

  constructor(world: World) {
    this.world = world;
  }

  /// Advances by `seconds` of real time. False if the state blew up.
  advance(seconds: number): boolean {
    const { world } = this;
    const speed = this.speed / world.units.time;
    this.due = Math.min(this.due + seconds * speed, LONGEST_FRAME * speed);
    const end = performance.now() + BUSIEST;
    let sound = true;
    for (let step = world.timestep; this.due >= step - ROUNDING; step = world.timestep) {
      if (!this.ready()) break;
      if (performance.now() > end) {
        this.lag += (this.due - step) / speed;
        this.due = step; // the last step of this frame
      }
      sound = world.advance() && sound;
      this.due = Math.max(0, this.due - step);
    }
    return sound;
  }

  /// Drops the fraction of a step, after the state was set or advanced step by step.
  settle(): void {
    this.due = 0;
    this.world.settle();
  }

  /// Time (s) between the state that is shown and the world's newest one.
  private get late(): number {
    return Math.max(0, this.world.timestep - this.due);
  }

  /// The state between two physics steps, for smooth slow motion.
  get state(): State {
    return this.world.stateAgo(this.late);
  }

  /// The same for the twin; null without one.
  get twinState(): State | null {
    return this.world.twinStateAgo(this.late);
  }
}
