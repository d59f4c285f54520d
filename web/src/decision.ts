/// What a policy makes of an observation, for the motor and for who watches.

interface Choice {
  torque: number; // N·m
  value: number; // V in units of the network; NaN where the policy estimates none
}

/// Of a Q-network: the torque with the largest Q-value.
export interface QDecision extends Choice {
  kind: 'q';
  torques: Float64Array; // (A) N·m
  q: Float64Array; // (A)
  action: number; // which of them
}

/// Of an actor that draws from a Gaussian: its mean.
export interface GaussianDecision extends Choice {
  kind: 'gaussian';
  limit: number; // N·m
  low: number; // N·m, the ends of the central 68% of the torques that it would draw
  high: number;
  /// The probability of being cut off at -limit, of each of so many equal pieces of the range, and of
  /// being cut off at limit.
  probabilities(pieces: number): Float64Array;
}

/// Of an actor that draws one of some torques: the likeliest.
export interface CategoricalDecision extends Choice {
  kind: 'categorical';
  torques: Float64Array; // (A) N·m
  probabilities: Float64Array; // (A)
  action: number; // which of them
}

/// Of a controller that is made from the equations of motion.
export interface ComputedDecision extends Choice {
  kind: 'computed';
  limit: number; // N·m
}

export type Decision = QDecision | GaussianDecision | CategoricalDecision | ComputedDecision;

/// What a policy remembers of an episode.
export interface Memory {
  close(): void;
}

/// The part of a policy that chooses torques.
export interface Controller {
  readonly inputs: number; // how many numbers an observation has
  readonly isLearned: boolean; // or else made from the equations of motion
  readonly text: string; // what it is, for people
  readonly strongest: number; // N·m, the largest torque
  /// Largest |difference| between the outputs in the file and those computed here.
  readonly selfCheckError: number;
  /// Without a memory as at the beginning of an episode.
  decide(observation: Float32Array, memory: Memory | null): Decision;
  /// Begins an episode; null where nothing of it is remembered.
  begin(): Memory | null;
  /// Frees what it holds; nothing may be asked of it after.
  close(): void;
}
