import { core } from './core';
import type { Core } from './core';
import type { Controller, Decision, Memory } from './decision';
import { Fields } from './fields';

/// Description of a policy file by the core (web/wasm/api.cc).
interface About {
  kind: Decision['kind'];
  text: string;
  inputs: number;
  columns: number; // of a decision's row
  torques: number[]; // N·m, of its own plant
  limit: number; // the same; for policies without a table of torques
  memory: number; // steps
  identifies: boolean;
  any_pose: boolean; // whether it observes its goal
  period: number; // between two decisions, s of its own plant
  /// Units of the built-in plant in those of its observations; 1 unless its plant has another size.
  time_unit: number;
  torque_unit: number;
  selfCheckError: number;
  metadata: Record<string, string>;
}

const DECISION_FIELDS = new Fields('decision', ['torque', 'value']);
const GAUSSIAN_FIELDS = new Fields('gaussian', ['low', 'high', 'mean', 'log_std']);

const forgotten = new FinalizationRegistry<() => void>((close) => close());

/// Frees a policy's memory in the core. Outside the class, so that it cannot hold the policy
/// itself.
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

/// A policy in the core, with its buffers. Its own plant may have another size; its torques here are
/// those of the built-in plant.
export class CoreController implements Controller {
  readonly about: Readonly<About>;
  /// Frees the memory now. Otherwise the garbage collector frees it later.
  readonly close: () => void;
  private readonly policy: number;
  private readonly observation: number; // address of the input
  private readonly row: number; // address of the decision
  private readonly torques: Float64Array;

  /// Reads and checks a policy file, or makes the controller of a name. Throws BadInput.
  constructor(from: ArrayBuffer | string) {
    const { policy_open, policy_make } = core().exports;
    const [bytes, open] =
      typeof from === 'string'
        ? [new TextEncoder().encode(from), policy_make]
        : [new Uint8Array(from), policy_open];
    this.policy = core().withBytes(bytes, (at, size) => core().expect(open(at, size)));
    this.about = JSON.parse(core().text) as About;
    this.torques = Float64Array.from(this.about.torques, (torque) => this.unit * torque);
    this.observation = core().reserve(4 * this.inputs);
    this.row = core().reserve(8 * this.about.columns);
    const close = closer(core(), this.policy, this.observation, this.row);
    forgotten.register(this, close, this);
    this.close = () => {
      forgotten.unregister(this);
      close();
    };
  }

  private get unit(): number {
    return this.about.torque_unit;
  }
  get inputs(): number {
    return this.about.inputs;
  }
  get isLearned(): boolean {
    return this.about.kind !== 'computed';
  }
  get selfCheckError(): number {
    return this.about.selfCheckError;
  }
  get strongest(): number {
    return this.torques.length > 0 ? Math.max(...this.torques) : this.unit * this.about.limit;
  }

  get text(): string {
    return this.about.text;
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
    return this.decision(
      new Float64Array(exports.memory.buffer, this.row, this.about.columns).slice(),
    );
  }

  /// The decision in a row: DECISION_FIELDS, then the numbers of its kind (web/wasm/api.cc).
  private decision(row: Float64Array): Decision {
    const { kind } = this.about;
    const { torques, unit } = this;
    const limit = unit * this.about.limit;
    const { torque: chosen, value } = DECISION_FIELDS.object(row);
    const [torque, action] = [unit * chosen, this.about.torques.indexOf(chosen)];
    const rest = row.subarray(DECISION_FIELDS.size);
    switch (kind) {
      case 'q':
        return { kind, torques, q: rest, action, torque, value };
      case 'categorical':
        return {
          kind,
          torques,
          probabilities: rest,
          action,
          torque,
          value,
        };
      case 'computed':
        return { kind, limit, torque, value };
      case 'gaussian': {
        const { low, high, mean, log_std } = GAUSSIAN_FIELDS.object(rest);
        const probabilities = (pieces: number) =>
          core().numbers(pieces + 2, (at) =>
            core().exports.gaussian_probabilities(this.policy, mean, log_std, at, pieces + 2),
          );
        const [from, to] = [unit * low, unit * high];
        return { kind, limit, low: from, high: to, probabilities, torque, value };
      }
    }
  }
}
