import { MAX_VELOCITY, OBSERVATION_SIZE, observe } from './pendulum';
import type { Plant, State } from './pendulum';

export const MEMORY_SIZE = 3; // numbers that an observation remembers of each past step
const MEMORY_VELOCITY = 1; // rad/s
const MEMORY_TORQUE = 5; // N·m

/// What an agent sees: the observation of what the sensors measure, and of each past control step,
/// from the last one backwards, [Δw1, Δw2, tau]; zeros for steps before the start.
export class Observer {
  observation: Float32Array;
  private readonly size: number;

  constructor(memory: number) {
    this.size = OBSERVATION_SIZE + MEMORY_SIZE * memory;
    this.observation = new Float32Array(this.size);
  }

  /// A start: there is nothing to remember yet.
  begin(plant: Plant, measured: State): void {
    this.beginWith(observationOf(plant, measured));
  }

  /// One control step later, for which `torque` (N·m) was chosen.
  next(plant: Plant, measured: State, torque: number): void {
    this.nextWith(observationOf(plant, measured), torque);
  }

  /// The same with an observation (8) that is there already.
  beginWith(now: Float32Array): void {
    this.observation = new Float32Array(this.size);
    this.observation.set(now);
  }

  nextWith(now: Float32Array, torque: number): void {
    const before = this.observation;
    this.beginWith(now);
    if (this.size === OBSERVATION_SIZE) return;
    const change = (i: number) => Math.fround(now[i]! - before[i]!);
    const remembered = [
      change(2) * (MAX_VELOCITY[0] / MEMORY_VELOCITY),
      change(5) * (MAX_VELOCITY[1] / MEMORY_VELOCITY),
      torque / MEMORY_TORQUE,
      ...before.subarray(OBSERVATION_SIZE, this.size - MEMORY_SIZE),
    ];
    this.observation.set(remembered, OBSERVATION_SIZE);
  }
}

function observationOf(plant: Plant, s: State): Float32Array {
  const observation = new Float32Array(OBSERVATION_SIZE);
  observe(plant, s, observation);
  return observation;
}
