import { core } from './core';
import type { Core } from './core';
import type { Controller, Decision, Memory } from './decision';
import { argMax } from './decision';
import { GaussianTorque } from './gaussian';

/// What the core says of a policy file (web/wasm/api.cc).
interface About {
  kind: 'q' | 'squashed-gaussian' | 'clipped-gaussian' | 'categorical' | 'computed';
  text: string;
  inputs: number;
  outputs: number; // of an actor
  values: number; // Q-values, or 1: V
  torques: number[]; // N·m
  limit: number; // N·m, of what has no table of torques
  memory: number; // steps
  identifies: boolean;
  selfCheckError: number;
  metadata: Record<string, string>;
}

const forgotten = new FinalizationRegistry<() => void>((close) => close());

/// Frees what a policy has in the core. Made here, where it cannot hold the policy itself.
function closer({ exports }: Core, policy: number, ...places: readonly number[]): () => void {
  return () => {
    exports.policy_close(policy);
    for (const place of places) exports.release(place);
  };
}

class CoreMemory implements Memory {
  readonly at: number;

  constructor(at: number) {
    this.at = at;
  }

  close(): void {
    core().exports.memory_close(this.at);
  }
}

/// A policy in the core, and what its decisions are made of.
export class CoreController implements Controller {
  readonly about: Readonly<About>;
  /// Frees its memory now; else that happens some time after nobody holds it any more.
  readonly close: () => void;
  private readonly policy: number;
  private readonly observation: number; // where one is put
  private readonly row: number; // where what is made of it lies
  private readonly torques: Float64Array;
  private readonly shape: Shape | null; // null of a controller

  /// Reads and checks a policy file, or makes the controller of a name. Throws BadInput.
  constructor(from: ArrayBuffer | string) {
    const { policy_open, policy_make } = core().exports;
    const [bytes, open] =
      typeof from === 'string'
        ? [new TextEncoder().encode(from), policy_make]
        : [new Uint8Array(from), policy_open];
    this.policy = core().withBytes(bytes, (at, size) => core().expect(open(at, size)));
    this.about = JSON.parse(core().text) as About;
    this.torques = Float64Array.from(this.about.torques);
    const { network } = this.about.metadata;
    this.shape = network === undefined ? null : (JSON.parse(network) as Shape);
    this.observation = core().reserve(4 * this.inputs);
    this.row = core().reserve(8 * this.columns);
    const close = closer(core(), this.policy, this.observation, this.row);
    forgotten.register(this, close, this);
    this.close = () => {
      forgotten.unregister(this);
      close();
    };
  }

  get inputs(): number {
    return this.about.inputs;
  }
  get selfCheckError(): number {
    return this.about.selfCheckError;
  }
  get strongest(): number {
    return this.torques.length > 0 ? Math.max(...this.torques) : this.about.limit;
  }

  get text(): string {
    const { shape } = this;
    const { kind, metadata, text } = this.about;
    if (kind === 'computed' || !shape) return text;
    const normalised = shape.layer_norm ? ', layer normalisation' : '';
    if (kind === 'q') {
      const heads = shape.dueling ? ` with heads of ${shape.head}` : '';
      const name = `${shape.dueling ? 'Dueling' : 'Plain'} network ${widths(shape)}`;
      return `${name}${heads}${normalised}, ${this.torques.length} torques`;
    }
    const critic = metadata.critic ? (JSON.parse(metadata.critic) as Shape) : null;
    const how = {
      'squashed-gaussian': 'a Gaussian squashed by tanh',
      'clipped-gaussian': 'a Gaussian, clipped',
      categorical: `one of ${this.torques.length} torques`,
    }[kind];
    return `Actor ${widths(shape)}: ${how}${normalised}${critic ? `; critic ${widths(critic)}` : ''}`;
  }

  begin(): Memory | null {
    const at = core().exports.memory_open(this.policy);
    return at === 0 ? null : new CoreMemory(at);
  }

  decide(observation: Float32Array, memory: Memory | null): Decision {
    const { exports } = core();
    new Float32Array(exports.memory.buffer, this.observation, this.inputs).set(observation);
    const past = memory instanceof CoreMemory ? memory.at : 0;
    core().expect(exports.policy_decide(this.policy, past, this.observation, this.row));
    return this.decision(new Float64Array(exports.memory.buffer, this.row, this.columns).slice());
  }

  private get columns(): number {
    return 1 + this.about.outputs + this.about.values;
  }

  /// From a row of torque, outputs and values.
  private decision(row: Float64Array): Decision {
    const { kind, outputs: count, values: valueCount, limit } = this.about;
    const { torques } = this;
    // Numbers that overflowed on the way move nothing.
    const torque = Number.isFinite(row[0]!) ? row[0]! : 0;
    const outputs = row.subarray(1, 1 + count);
    const values = row.subarray(1 + count);
    if (kind === 'computed') return { kind, limit, torque, value: NaN };
    if (kind === 'q') {
      const q = Float32Array.from(values);
      // Q = V + A - mean(A), so that V is their mean; a plain network has none.
      const value = this.shape?.dueling
        ? values.reduce((sum, x) => sum + x, 0) / values.length
        : NaN;
      return { kind, torques, q, action: torques.indexOf(torque), torque, value };
    }
    const value = valueCount > 0 ? values[0]! : NaN;
    if (kind === 'categorical') {
      const action = argMax(outputs);
      const weights = outputs.map((logit) => Math.exp(logit - outputs[action]!));
      const sum = weights.reduce((total, weight) => total + weight, 0);
      const probabilities = weights.map((weight) => weight / sum);
      return { kind, torques, action, torque, probabilities, value };
    }
    const squashed = kind === 'squashed-gaussian';
    const distribution = new GaussianTorque(limit, squashed, outputs[0]!, outputs[1]!);
    return { kind: 'gaussian', distribution, torque, value };
  }
}

/// Of a network, from a file's metadata, which the core has checked.
interface Shape {
  inputs: number;
  hidden: number[];
  layer_norm: boolean;
  dueling?: boolean;
  head?: number;
}

function widths({ inputs, hidden }: Shape): string {
  return [inputs, ...hidden].join('-');
}
