import type { GaussianTorque } from './gaussian';
import { BadInput, read } from './safetensors';
import type { TensorFile } from './safetensors';

/// What a policy makes of an observation, for the motor and for who watches.

interface Choice {
  torque: number; // N·m
  value: number; // V in units of the network; NaN where the policy estimates none
}

/// Of a Q-network: the torque with the largest Q-value.
export interface QDecision extends Choice {
  kind: 'q';
  torques: Float64Array; // (A) N·m
  q: Float32Array; // (A)
  action: number; // which of them
}

/// Of an actor that draws from a Gaussian: its mean.
export interface GaussianDecision extends Choice {
  kind: 'gaussian';
  distribution: GaussianTorque;
}

/// Of an actor that draws one of some torques: the likeliest.
export interface CategoricalDecision extends Choice {
  kind: 'categorical';
  torques: Float64Array; // (A) N·m
  probabilities: Float64Array; // (A)
  action: number; // which of them
}

export type Decision = QDecision | GaussianDecision | CategoricalDecision;

/// The part of a policy that chooses torques.
export interface Controller {
  readonly inputs: number; // how many numbers an observation has
  readonly text: string; // what it is, for people
  readonly strongest: number; // N·m, the largest torque
  /// Largest |difference| between the outputs in the file and those computed here.
  readonly selfCheckError: number;
  decide(observation: Float32Array): Decision;
}

/// Index of the largest number, the first of equals.
export function argMax(values: ArrayLike<number>): number {
  let best = 0;
  for (let i = 1; i < values.length; ++i) if (values[i]! > values[best]!) best = i;
  return best;
}

const MAX_SAMPLES = 64; // that are checked while the visitor waits
/// Up to which share of the largest output programs differ that sum in other orders; measured where
/// nn/policy_file.cc has the same number.
const TOLERANCE = 1e-5;

/// The file's sample observations, and how many there are: as many as the tensor `counted` has rows.
/// Throws BadInput.
export function readSamples(file: TensorFile, counted: string, inputs: number): Float32Array[] {
  const samples = file.tensors.get(counted)?.shape[0] ?? 0;
  if (samples === 0 || samples > MAX_SAMPLES) {
    throw new BadInput(`expected 1 to ${MAX_SAMPLES} samples to check, got ${samples}`);
  }
  const all = read(file, 'sample.obs', 'F32', [samples, inputs]) as Float32Array;
  return Array.from({ length: samples }, (_, i) => all.subarray(i * inputs, (i + 1) * inputs));
}

/// Compares outputs with those of the tensor `name`, of as many rows and columns. `what` they are is
/// for messages. Returns the largest difference, and the one that rounding makes at most. Throws
/// BadInput.
export function checkOutputs(
  file: TensorFile,
  name: string,
  what: string,
  outputs: Float32Array[],
): { error: number; tolerance: number } {
  const columns = outputs[0]!.length;
  const expected = read(file, name, 'F32', [outputs.length, columns]) as Float32Array;
  const tolerance = TOLERANCE * expected.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  let largest = 0;
  outputs.forEach((row, i) =>
    row.forEach((value, k) => {
      const wanted = expected[i * columns + k]!;
      const error = Math.abs(value - wanted);
      if (!(error <= tolerance)) {
        throw new BadInput(`self-check: expected ${what} ${wanted}, got ${value} (sample ${i})`);
      }
      largest = Math.max(largest, error);
    }),
  );
  return { error: largest, tolerance };
}

/// Throws BadInput unless the torque of sample `i` is that of the largest preference, or of one that
/// rounding cannot tell from it.
export function checkChoice(
  torque: number,
  torques: Float64Array,
  preferences: Float32Array,
  margin: number,
  i: number,
): void {
  const best = preferences[argMax(preferences)]!;
  const mayBeChosen = (value: number, a: number) => torques[a] === torque && best - value <= margin;
  if (preferences.some(mayBeChosen)) return;
  throw new BadInput(`self-check: a torque of ${torque} is not the best (sample ${i})`);
}
