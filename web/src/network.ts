import { activate, isTrunk, isUnits, linear, readLayer, Trunk } from './layers';
import type { Layer } from './layers';
import { BadInput } from './safetensors';
import type { TensorFile } from './safetensors';

/// A Q-network: feature layers, then one output layer, or a value and an advantage stream
/// (Wang et al. 2016, eq. 9).
export interface NetworkShape {
  inputs: number;
  actions: number;
  hidden: number[];
  head: number; // units in each stream, if dueling
  dueling: boolean;
  layer_norm: boolean;
}

export interface QValues {
  q: Float32Array; // (A)
  value: number; // V, of a dueling network; NaN of a plain one
}

/// The network's shape from the metadata. Throws BadInput.
export function parseShape(text: string): NetworkShape {
  let shape: NetworkShape | null;
  try {
    shape = JSON.parse(text) as NetworkShape | null;
  } catch {
    throw new BadInput('metadata "network" is not JSON');
  }
  const valid =
    shape !== null &&
    isTrunk({ ...shape, activation: 'relu' }) &&
    isUnits(shape.actions) &&
    (!shape.dueling || isUnits(shape.head)) &&
    typeof shape.dueling === 'boolean';
  if (!valid) throw new BadInput('metadata "network" has sizes that no policy of Upswing has');
  return shape!;
}

export class Network {
  private readonly trunk: Trunk;
  private readonly streams?: Layer;
  private readonly value?: Layer;
  private readonly output: Layer; // advantages, if dueling
  readonly shape: NetworkShape;

  /// Throws BadInput unless the file holds every array with the shape that it must have.
  constructor(shape: NetworkShape, file: TensorFile) {
    this.shape = shape;
    this.trunk = new Trunk({ ...shape, activation: 'relu' }, file);
    const { features } = this.trunk;
    if (shape.dueling) {
      this.streams = readLayer(file, 'streams', 2 * shape.head, features);
      this.value = readLayer(file, 'value', 1, shape.head);
      this.output = readLayer(file, 'advantage', shape.actions, shape.head);
    } else {
      this.output = readLayer(file, 'output', shape.actions, features);
    }
  }

  /// Q-values of one observation (D); dueling: Q = V + A - mean(A).
  forward(observation: Float32Array): QValues {
    const x = this.trunk.forward(observation);
    if (!this.streams || !this.value) return { q: linear(this.output, x), value: NaN };
    const hidden = activate(linear(this.streams, x), 'relu');
    const { head } = this.shape;
    const value = linear(this.value, hidden.subarray(0, head))[0]!;
    const advantage = linear(this.output, hidden.subarray(head));
    const mean = advantage.reduce((sum, a) => sum + a, 0) / advantage.length;
    return { q: advantage.map((a) => value + a - mean), value };
  }
}
