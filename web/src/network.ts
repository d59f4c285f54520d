import { BadInput, read } from './safetensors';
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

const MAX_UNITS = 4096;
const MAX_LAYERS = 16;
const EPSILON = 1e-5; // of layer normalisation

interface Layer {
  weight: Float32Array; // (out × in)
  bias: Float32Array; // (out)
  norm?: { weight: Float32Array; bias: Float32Array };
}

/// y = W x + b
function linear({ weight, bias }: Layer, x: Float32Array): Float32Array {
  const y = new Float32Array(bias.length);
  for (let row = 0, at = 0; row < y.length; ++row) {
    let sum = bias[row]!;
    for (let i = 0; i < x.length; ++i) sum += weight[at++]! * x[i]!;
    y[row] = sum;
  }
  return y;
}

function normalize(y: Float32Array, { weight, bias }: NonNullable<Layer['norm']>): void {
  const mean = y.reduce((sum, v) => sum + v, 0) / y.length;
  const variance = y.reduce((sum, v) => sum + (v - mean) ** 2, 0) / y.length;
  const scale = 1 / Math.sqrt(variance + EPSILON);
  for (let i = 0; i < y.length; ++i) y[i] = (y[i]! - mean) * scale * weight[i]! + bias[i]!;
}

function relu(y: Float32Array): Float32Array {
  for (let i = 0; i < y.length; ++i) y[i] = Math.max(0, y[i]!);
  return y;
}

/// The network's shape from the metadata. Throws BadInput.
export function parseShape(text: string): NetworkShape {
  let shape: NetworkShape;
  try {
    shape = JSON.parse(text) as NetworkShape;
  } catch {
    throw new BadInput('metadata "network" is not JSON');
  }
  const isUnits = (n: unknown) =>
    Number.isInteger(n) && (n as number) > 0 && (n as number) <= MAX_UNITS;
  const valid =
    isUnits(shape?.inputs) &&
    isUnits(shape.actions) &&
    Array.isArray(shape.hidden) &&
    shape.hidden.length > 0 &&
    shape.hidden.length <= MAX_LAYERS &&
    shape.hidden.every(isUnits) &&
    (!shape.dueling || isUnits(shape.head)) &&
    typeof shape.dueling === 'boolean' &&
    typeof shape.layer_norm === 'boolean';
  if (!valid) throw new BadInput('metadata "network" has sizes that no policy of Upswing has');
  return shape;
}

export class Network {
  private readonly features: Layer[] = [];
  private readonly streams?: Layer;
  private readonly value?: Layer;
  private readonly output: Layer; // advantages, if dueling
  readonly shape: NetworkShape;

  /// Throws BadInput unless the file holds every array with the shape that it must have.
  constructor(shape: NetworkShape, file: TensorFile) {
    this.shape = shape;
    const f32 = (name: string, ...size: number[]) => read(file, name, 'F32', size) as Float32Array;
    const layer = (name: string, out: number, inputs: number): Layer => ({
      weight: f32(`${name}.weight`, out, inputs),
      bias: f32(`${name}.bias`, out),
    });
    let inputs = shape.inputs;
    shape.hidden.forEach((out, i) => {
      const feature = layer(`feature.${i}`, out, inputs);
      if (shape.layer_norm) {
        const name = `feature.${i}.norm`;
        feature.norm = { weight: f32(`${name}.weight`, out), bias: f32(`${name}.bias`, out) };
      }
      this.features.push(feature);
      inputs = out;
    });
    if (shape.dueling) {
      this.streams = layer('streams', 2 * shape.head, inputs);
      this.value = layer('value', 1, shape.head);
      this.output = layer('advantage', shape.actions, shape.head);
    } else {
      this.output = layer('output', shape.actions, inputs);
    }
  }

  /// Q-values of one observation (D); dueling: Q = V + A - mean(A).
  forward(observation: Float32Array): QValues {
    let x = observation;
    for (const layer of this.features) {
      const y = linear(layer, x);
      if (layer.norm) normalize(y, layer.norm);
      x = relu(y);
    }
    if (!this.streams || !this.value) return { q: linear(this.output, x), value: NaN };
    const hidden = relu(linear(this.streams, x));
    const { head } = this.shape;
    const value = linear(this.value, hidden.subarray(0, head))[0]!;
    const advantage = linear(this.output, hidden.subarray(head));
    const mean = advantage.reduce((sum, a) => sum + a, 0) / advantage.length;
    return { q: advantage.map((a) => value + a - mean), value };
  }
}
