/// The neurons of a Q-network, for display only: the core computes the decisions.

const EPSILON = 1e-5; // of the layer normalisation

interface Layer {
  weight: Float32Array; // (out × in)
  bias: Float32Array; // (out)
  gain: Float32Array | null; // of the layer normalisation, (out); null: no normalisation
  shift: Float32Array | null;
}

export class Neurons {
  private readonly layers: readonly Layer[];

  private constructor(layers: readonly Layer[]) {
    this.layers = layers;
  }

  /// From a policy file that the core has checked (docs/reference/policy-format.md). Null if it is
  /// not a Q-network in 32-bit floats.
  static of(file: ArrayBuffer): Neurons | null {
    const tensors = tensorsOf(file);
    const names = [...tensors.keys()]
      .filter((name) => /^feature\.\d+\.weight$/.test(name))
      .map((name) => name.replace('.weight', ''))
      .sort((a, b) => Number(a.split('.')[1]) - Number(b.split('.')[1]));
    if (tensors.has('streams.weight')) names.push('streams');
    const layers = names.map((name) => ({
      weight: tensors.get(`${name}.weight`),
      bias: tensors.get(`${name}.bias`),
      gain: tensors.get(`${name}.norm.weight`) ?? null,
      shift: tensors.get(`${name}.norm.bias`) ?? null,
    }));
    const whole = layers.every(({ weight, bias }) => weight && bias);
    return whole && tensors.has('sample.q') ? new Neurons(layers as Layer[]) : null;
  }

  /// The output of each hidden layer for an observation.
  active(observation: Float32Array): Float32Array[] {
    let x = observation;
    return this.layers.map((layer) => (x = activate(layer, x)));
  }
}

/// ReLU(N(W x + b)).
function activate({ weight, bias, gain, shift }: Layer, x: Float32Array): Float32Array {
  const z = bias.map((b, i) => {
    let sum = b;
    for (let k = 0; k < x.length; ++k) sum += weight[i * x.length + k]! * x[k]!;
    return sum;
  });
  if (gain && shift) {
    const mean = z.reduce((sum, value) => sum + value, 0) / z.length;
    const variance = z.reduce((sum, value) => sum + (value - mean) ** 2, 0) / z.length;
    const scale = 1 / Math.sqrt(variance + EPSILON);
    z.forEach((value, i) => (z[i] = gain[i]! * (value - mean) * scale + shift[i]!));
  }
  return z.map((value) => Math.max(0, value));
}

/// The tensors of 32-bit floats in a safetensors file, by name.
export function tensorsOf(file: ArrayBuffer): Map<string, Float32Array> {
  const size = Number(new DataView(file).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 8, size))) as Record<
    string,
    { dtype?: string; data_offsets?: [number, number] }
  >;
  const found = new Map<string, Float32Array>();
  for (const [name, { dtype, data_offsets }] of Object.entries(header)) {
    if (dtype !== 'F32' || !data_offsets) continue;
    const [begin, end] = data_offsets;
    found.set(name, new Float32Array(file.slice(8 + size + begin, 8 + size + end)));
  }
  return found;
}
