import { MAX_VELOCITY, OBSERVATION_SIZE, observe } from './pendulum';
import type { Plant, State } from './pendulum';
import { MEMORY_SIZE } from './policy';

const MEMORY_VELOCITY = 1; // rad/s
const MEMORY_TORQUE = 5; // N·m

/// What an agent sees: the observation of what the sensors measure, and of each past control step,
/// from the last one backwards, [Δw1, Δw2, tau]; zeros for steps before the start.
export class Observer {
  observation: Float32Array;

  constructor(memory: number) {
    this.observation = new Float32Array(OBSERVATION_SIZE + MEMORY_SIZE * memory);
  }

  /// A start: there is nothing to remember yet.
  begin(plant: Plant, measured: State): void {
    this.observation = new Float32Array(this.observation.length);
    observe(plant, measured, this.observation);
  }

  /// One control step later, for which `torque` (N·m) was chosen.
  next(plant: Plant, measured: State, torque: number): void {
    const before = this.observation;
    const now = new Float32Array(before.length);
    observe(plant, measured, now);
    if (now.length > OBSERVATION_SIZE) {
      now[OBSERVATION_SIZE] =
        Math.fround(now[2]! - before[2]!) * (MAX_VELOCITY[0] / MEMORY_VELOCITY);
      now[OBSERVATION_SIZE + 1] =
        Math.fround(now[5]! - before[5]!) * (MAX_VELOCITY[1] / MEMORY_VELOCITY);
      now[OBSERVATION_SIZE + 2] = torque / MEMORY_TORQUE;
      now.set(before.subarray(OBSERVATION_SIZE, -MEMORY_SIZE), OBSERVATION_SIZE + MEMORY_SIZE);
    }
    this.observation = now;
  }
}
