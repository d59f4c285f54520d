/// A policy's decision about an observation, for the motor and for display.

interface Choice {
  torque: number; // N·m
  value: number; // V in units of the network; NaN where the policy estimates none
}

/// Of a Q-network: the torque with the largest Q-value.
export interface QDecision extends Choice {
  kind: 'q';
  torques: Float64Array; // (A) N·m
  q: Float64Array; // (A)
  action: number; // index of the chosen torque
}

/// Of a Gaussian actor: its mean.
export interface GaussianDecision extends Choice {
  kind: 'gaussian';
  limit: number; // N·m
  low: number; // N·m, lower end of the central 68% of its distribution
  high: number;
  /// Probabilities: of being cut off at -limit, of each of N equal pieces of the range, and of
  /// being cut off at limit.
  probabilities(pieces: number): Float64Array;
}

/// Of a categorical actor: the likeliest torque.
export interface CategoricalDecision extends Choice {
  kind: 'categorical';
  torques: Float64Array; // (A) N·m
  probabilities: Float64Array; // (A)
  action: number; // index of the chosen torque
}

/// Of a controller computed from the equations of motion.
export interface ComputedDecision extends Choice {
  kind: 'computed';
  limit: number; // N·m
}

export type Decision = QDecision | GaussianDecision | CategoricalDecision | ComputedDecision;

/// A policy's memory of an episode.
export interface Memory {
  close(): void;
}

/// The part of a policy that chooses torques.
export interface Controller {
  readonly inputs: number; // size of an observation
  readonly isLearned: boolean; // false: computed from the equations of motion
  readonly text: string; // description for people
  readonly strongest: number; // N·m, the largest torque
  /// Largest |difference| between the outputs in the file and those computed here.
  readonly selfCheckError: number;
  /// `memory` null: as at the beginning of an episode.
  decide(observation: Float32Array, memory: Memory | null): Decision;
  /// Begins an episode. Null if the policy has no memory.
  begin(): Memory | null;
  /// Frees its memory. Use nothing of it afterwards.
  close(): void;
}
