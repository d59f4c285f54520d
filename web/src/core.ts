import { BadInput } from './bad_input';
import { findFields } from './fields';

/// Our own core in C++ (web/wasm/api.cc), compiled to WebAssembly: policies, formulas and learning.
/// Only this file knows its memory.

/// The module's exports. Objects and memory are addresses; 0 is failure.
interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  reserve(bytes: number): number;
  release(at: number): void;
  text_at(): number;
  text_size(): number;
  bytes_at(): number;
  bytes_size(): number;
  policy_open(file: number, bytes: number): number;
  policy_close(policy: number): void;
  policy_make(name: number, bytes: number): number;
  memory_open(policy: number): number;
  memory_close(memory: number): void;
  policy_decide(policy: number, memory: number, observation: number, row: number): number;
  gaussian_probabilities(
    policy: number,
    mean: number,
    logStd: number,
    to: number,
    count: number,
  ): void;
  observation_remember(
    before: number,
    torque: number,
    steps: number,
    observation: number,
    size: number,
  ): void;
  numbers(): number;
  field_table(): void;
  pendulum_at(): void;
  pendulum_check(): number;
  physics_steps(period: number): number;
  pendulum_step(): void;
  identifier_open(period: number): number;
  identifier_close(identifier: number): void;
  identifier_begin(identifier: number): void;
  identifier_update(identifier: number): void;
  identifier_observe(identifier: number): void;
  sensors_open(period: number): number;
  sensors_close(sensors: number): void;
  sensors_begin(sensors: number): void;
  sensors_measure(sensors: number): void;
  capsule_inertia(): void;
  pendulum_mjcf(): void;
  learner_open(settings: number, bytes: number): number;
  learner_close(learner: number): void;
  learner_run(learner: number, steps: number): number;
  learner_report(learner: number): number;
  learner_last_update(learner: number): number;
  learner_policy(learner: number, best: number): number;
  learner_poses(learner: number): number;
  agent_settings(agent: number, bytes: number): number;
}

export class Core {
  readonly exports: Exports;
  private readonly decoder = new TextDecoder();

  private constructor(exports: Exports) {
    this.exports = exports;
  }

  static async start(module: WebAssembly.Module): Promise<Core> {
    let memory: WebAssembly.Memory;
    const EBADF = 8; // there are no files
    const system = {
      clock_time_get: (_clock: number, _precision: bigint, at: number): number => {
        const nanoseconds = BigInt(Math.round(1e6 * performance.now()));
        new DataView(memory.buffer).setBigUint64(at, nanoseconds, true);
        return 0;
      },
      environ_get: () => 0,
      environ_sizes_get: (count: number, bytes: number): number => {
        const view = new DataView(memory.buffer);
        view.setUint32(count, 0, true);
        view.setUint32(bytes, 0, true);
        return 0;
      },
      fd_close: () => EBADF,
      fd_fdstat_get: () => EBADF,
      fd_read: () => EBADF,
      fd_seek: () => EBADF,
      fd_write: () => EBADF,
      proc_exit: (code: number) => {
        throw new Error(`the core has stopped with ${code}`);
      },
    };
    const imports = { wasi_snapshot_preview1: system };
    const instance = await WebAssembly.instantiate(module, imports);
    const exports = instance.exports as unknown as Exports;
    memory = exports.memory;
    exports._initialize();
    return new Core(exports);
  }

  /// Text left by the last call.
  get text(): string {
    const { memory, text_at, text_size } = this.exports;
    return this.decoder.decode(new Uint8Array(memory.buffer, text_at(), text_size()));
  }

  /// A copy of the file left by the last call.
  get file(): ArrayBuffer {
    const { memory, bytes_at, bytes_size } = this.exports;
    return memory.buffer.slice(bytes_at(), bytes_at() + bytes_size()) as ArrayBuffer;
  }

  /// `result` if it is not 0. Otherwise throws BadInput with the reason.
  expect(result: number): number {
    if (result === 0) throw new BadInput(this.text);
    return result;
  }

  /// Address of `size` free bytes in the module's memory. Throws BadInput.
  reserve(size: number): number {
    const at = this.exports.reserve(Math.max(1, size));
    if (at === 0) throw new BadInput("it does not fit into a page's memory");
    return at;
  }

  /// A copy of `count` numbers that `work` writes to an address.
  numbers(count: number, work: (at: number) => void): Float64Array {
    const at = this.reserve(8 * count);
    try {
      work(at);
      return new Float64Array(this.exports.memory.buffer, at, count).slice();
    } finally {
      this.exports.release(at);
    }
  }

  /// Calls `use` with the address and size of `bytes` in the module's memory.
  withBytes<T>(bytes: Uint8Array, use: (at: number, size: number) => T): T {
    const at = this.reserve(bytes.length);
    try {
      new Uint8Array(this.exports.memory.buffer).set(bytes, at);
      return use(at, bytes.length);
    } finally {
      this.exports.release(at);
    }
  }

  /// The numbers that `work` computes from `input`, both in the order of Fields: a view of the core's
  /// memory, valid until the next call.
  formula(input: readonly number[], work: () => void): Float64Array {
    const numbers = () => new Float64Array(this.exports.memory.buffer, this.exports.numbers(), 32);
    numbers().set(input);
    work();
    return numbers();
  }
}

let started: Core | null = null;
let compiled: WebAssembly.Module | null = null;

/// Starts the core. Call this before anything else. Throws Error if its structs differ from the
/// page's.
export async function startCore(module: WebAssembly.Module): Promise<void> {
  const core = await Core.start(module);
  core.exports.field_table();
  findFields(core.text);
  started = core;
  compiled = module;
}

/// The compiled module, from which workers start their own core.
export function coreModule(): WebAssembly.Module {
  if (!compiled) throw new Error('the core has not been started');
  return compiled;
}

export function core(): Core {
  if (!started) throw new Error('the core has not been started');
  return started;
}
