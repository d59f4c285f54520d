import { BadInput, read } from './safetensors';
import type { TensorFile } from './safetensors';

/// What networks are made of.

const MAX_UNITS = 4096;
const MAX_LAYERS = 16;
const EPSILON = 1e-5; // of layer normalisation

export interface Layer {
  weight: Float32Array; // (out × in)
  bias: Float32Array; // (out)
  norm?: { weight: Float32Array; bias: Float32Array };
}

/// A layer of a file. Throws BadInput unless it has these sizes.
export function readLayer(file: TensorFile, name: string, out: number, inputs: number): Layer {
  return {
    weight: read(file, `${name}.weight`, 'F32', [out, inputs]) as Float32Array,
    bias: read(file, `${name}.bias`, 'F32', [out]) as Float32Array,
  };
}

/// y = W x + b
export function linear({ weight, bias }: Layer, x: Float32Array): Float32Array {
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

export type Activation = 'relu' | 'tanh';

export function activate(y: Float32Array, activation: Activation): Float32Array {
  const f = activation === 'tanh' ? Math.tanh : (x: number) => Math.max(0, x);
  for (let i = 0; i < y.length; ++i) y[i] = f(y[i]!);
  return y;
}

/// The layers of a network from its inputs to its features.
export interface TrunkShape {
  inputs: number;
  hidden: number[];
  layer_norm: boolean;
  activation: Activation;
}

/// Whether it is a number of units that a layer can have.
export function isUnits(n: unknown): n is number {
  return Number.isInteger(n) && (n as number) > 0 && (n as number) <= MAX_UNITS;
}

export function isTrunk(shape: Partial<TrunkShape> | null): boolean {
  return (
    isUnits(shape?.inputs) &&
    Array.isArray(shape.hidden) &&
    shape.hidden.length > 0 &&
    shape.hidden.length <= MAX_LAYERS &&
    shape.hidden.every(isUnits) &&
    typeof shape.layer_norm === 'boolean' &&
    (shape.activation === 'relu' || shape.activation === 'tanh')
  );
}

export class Trunk {
  readonly features: number; // how many
  private readonly layers: Layer[] = [];
  private readonly activation: Activation;

  /// Its arrays' names in the file begin with `prefix`. Throws BadInput unless it holds them with
  /// the shapes that they must have.
  constructor(shape: TrunkShape, file: TensorFile, prefix = '') {
    let { inputs } = shape;
    this.activation = shape.activation;
    shape.hidden.forEach((out, i) => {
      const name = `${prefix}feature.${i}`;
      const layer = readLayer(file, name, out, inputs);
      if (shape.layer_norm) {
        layer.norm = {
          weight: read(file, `${name}.norm.weight`, 'F32', [out]) as Float32Array,
          bias: read(file, `${name}.norm.bias`, 'F32', [out]) as Float32Array,
        };
      }
      this.layers.push(layer);
      inputs = out;
    });
    this.features = inputs;
  }

  forward(inputs: Float32Array): Float32Array {
    let x = inputs;
    for (const layer of this.layers) {
      const y = linear(layer, x);
      if (layer.norm) normalize(y, layer.norm);
      x = activate(y, this.activation);
    }
    return x;
  }
}

/// A network's shape from the metadata. Throws BadInput.
export function parseTrunk(text: string, key: string): TrunkShape {
  let shape: TrunkShape | null;
  try {
    shape = JSON.parse(text) as TrunkShape | null;
  } catch {
    throw new BadInput(`metadata "${key}" is not JSON`);
  }
  if (shape === null || !isTrunk(shape)) {
    throw new BadInput(`metadata "${key}" has sizes that no policy of Upswing has`);
  }
  return shape;
}
