import { MAX_VELOCITY } from './pendulum';

export const MEMORY_SIZE = 3; // numbers that an observation remembers of each past step
const MEMORY_VELOCITY = 1; // rad/s
const MEMORY_TORQUE = 5; // N·m

/// An observation with what it remembers of past control steps, from the last one backwards, three
/// numbers each: [Δw1, Δw2, tau]. `before` is the observation of a step earlier with its own memory,
/// and `torque` (N·m) what was chosen then; null at a start, where there is nothing to remember.
export function withMemory(
  now: Float32Array,
  memory: number,
  before: Float32Array | null,
  torque: number,
): Float32Array {
  const observation = new Float32Array(now.length + MEMORY_SIZE * memory);
  observation.set(now);
  if (!before || memory === 0) return observation;
  const change = (i: number) => Math.fround(now[i]! - before[i]!);
  const remembered = [
    change(2) * (MAX_VELOCITY[0] / MEMORY_VELOCITY),
    change(5) * (MAX_VELOCITY[1] / MEMORY_VELOCITY),
    torque / MEMORY_TORQUE,
    ...before.subarray(now.length, observation.length - MEMORY_SIZE),
  ];
  observation.set(remembered, now.length);
  return observation;
}
