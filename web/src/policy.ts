import { Network, parseShape } from './network';
import type { QValues } from './network';
import { MEMORY_SIZE } from './observation';
import { DISTURBANCE_LIMITS } from './disturbance';
import { CONTROL_PERIOD, MAX_VELOCITY, NOMINAL, OBSERVATION_SIZE, PLANT_LIMITS } from './pendulum';
import type { Parameter, Plant, Range } from './pendulum';
import { BadInput, parseSafetensors, read } from './safetensors';
import type { TensorFile } from './safetensors';
import { quoted } from './text';

const MAX_SAMPLES = 64; // that are checked while the visitor waits
/// Up to which share of the largest Q-value programs differ that sum in other orders; measured where
/// nn/q_policy.cc has the same number.
const TOLERANCE = 1e-5;

/// Index of the largest number, the first of equals.
export function argMax(values: ArrayLike<number>): number {
  let best = 0;
  for (let i = 1; i < values.length; ++i) if (values[i]! > values[best]!) best = i;
  return best;
}

/// A policy's output for an observation.
export interface Decision extends QValues {
  action: number; // the greedy one
  torque: number; // that it applies, N·m
}

/// A greedy controller: observation → torque, nothing else needed (docs/policy-format.md).
export class Policy {
  readonly metadata: ReadonlyMap<string, string>;
  readonly network: Network;
  readonly torques: Float64Array; // (A) N·m
  /// How many past steps an observation remembers.
  readonly memory: number;
  /// The plant that it was trained on.
  readonly plant: Plant;
  /// Factor by which rewards, and so its Q-values, were multiplied during training.
  readonly rewardScale: number;
  /// Largest |difference| between the Q-values in the file and those computed here.
  readonly selfCheckError: number;

  /// Reads and checks the file: format, shapes, finite numbers, samples. Throws BadInput.
  constructor(bytes: ArrayBuffer) {
    const file = parseSafetensors(bytes);
    this.metadata = file.metadata;
    this.expect('format', 'upswing-policy');
    this.expect('format_version', '1');
    this.expect('output', 'levels');
    if (Number(this.about('control_period')) !== CONTROL_PERIOD) {
      this.expect('control_period', String(CONTROL_PERIOD));
    }
    if (file.metadata.has('model')) {
      throw new BadInput('it was trained on a model of its own, which this page does not have');
    }

    const shape = parseShape(this.about('network'));
    this.memory = (shape.inputs - OBSERVATION_SIZE) / MEMORY_SIZE;
    if (!Number.isInteger(this.memory) || this.memory < 0) {
      throw new BadInput(`expected 8 inputs and 3 for each step remembered, got ${shape.inputs}`);
    }
    this.checkObservation();
    this.plant = parsePlant(this.about('plant'));
    this.rewardScale = Number(this.metadata.get('reward_scale') ?? 1);
    if (!(this.rewardScale > 0 && this.rewardScale < Infinity)) {
      throw new BadInput('metadata "reward_scale": expected a positive number');
    }
    this.network = new Network(shape, file);
    this.torques = read(file, 'torques', 'F64', [shape.actions]) as Float64Array;
    this.selfCheckError = this.checkSamples(file);
  }

  about(key: string): string {
    const text = this.metadata.get(key);
    if (text === undefined) throw new BadInput(`expected metadata "${key}", found none`);
    return text;
  }

  act(observation: Float32Array): Decision {
    const values = this.network.forward(observation);
    const action = argMax(values.q);
    return { ...values, action, torque: this.torques[action]! };
  }

  /// The range [low, high] of a parameter during training.
  trainedRange(name: Parameter): Range {
    const share = this.setting(`randomize_${name}`);
    const nominal = this.plant[name];
    return within(PLANT_LIMITS[name], nominal * (1 - share), nominal * (1 + share));
  }

  /// The same for the errors of sensors and motor: rad and rad/s, control periods.
  trainedDisturbance(name: 'sensor_noise' | 'delay'): Range {
    const unit = name === 'delay' ? CONTROL_PERIOD : 1;
    const least = this.setting(name) / unit;
    const most = least + this.setting(`randomize_${name}`) / unit;
    return within(DISTURBANCE_LIMITS[name], least, most);
  }

  /// A positive number from the training's configuration; 0 if there is none.
  private setting(name: string): number {
    const line = new RegExp(`^${name} = ([0-9.eE+-]+)$`, 'm');
    const value = Number(line.exec(this.metadata.get('config') ?? '')?.[1] ?? 0);
    return value > 0 && value < Infinity ? value : 0;
  }

  private expect(key: string, expected: string): void {
    const got = this.about(key);
    if (got !== expected) {
      throw new BadInput(`${key}: expected ${quoted(expected)}, got ${quoted(got)}`);
    }
  }

  /// Throws BadInput unless observations are scaled as here.
  private checkObservation(): void {
    const text = this.about('observation');
    let given: { max_velocity?: unknown; memory?: { steps?: unknown } } | null;
    try {
      given = JSON.parse(text) as typeof given;
    } catch {
      throw new BadInput('metadata "observation" is not JSON');
    }
    const scaled = JSON.stringify(given?.max_velocity) === JSON.stringify(MAX_VELOCITY);
    if (!scaled || (given?.memory?.steps ?? 0) !== this.memory) {
      throw new BadInput(
        'metadata "observation": expected the scales and memory of docs/policy-format.md',
      );
    }
  }

  /// Recomputes the stored outputs from the stored inputs; returns the largest difference. The torque
  /// is that of the largest Q-value, or of one that rounding cannot tell from it. Throws BadInput.
  private checkSamples(file: TensorFile): number {
    const samples = file.tensors.get('sample.torque')?.shape[0] ?? 0;
    if (samples === 0 || samples > MAX_SAMPLES) {
      throw new BadInput(`expected 1 to ${MAX_SAMPLES} samples to check, got ${samples}`);
    }
    const { inputs, actions } = this.network.shape;
    const obs = read(file, 'sample.obs', 'F32', [samples, inputs]) as Float32Array;
    const expected = read(file, 'sample.q', 'F32', [samples, actions]) as Float32Array;
    const torque = read(file, 'sample.torque', 'F64', [samples]);

    const tolerance = TOLERANCE * expected.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
    let largest = 0;
    for (let i = 0; i < samples; ++i) {
      const { q } = this.network.forward(obs.subarray(i * inputs, (i + 1) * inputs));
      q.forEach((value, a) => {
        const error = Math.abs(value - expected[i * actions + a]!);
        if (!(error <= tolerance)) {
          throw new BadInput(
            `self-check: expected Q-value ${expected[i * actions + a]}, got ${value} (sample ${i})`,
          );
        }
        largest = Math.max(largest, error);
      });
      const best = q[argMax(q)]!;
      const mayBeChosen = (value: number, a: number) =>
        this.torques[a] === torque[i] && best - value <= 2 * tolerance;
      if (!q.some(mayBeChosen)) {
        throw new BadInput(`self-check: a torque of ${torque[i]} is not the best (sample ${i})`);
      }
    }
    return largest;
  }
}

/// The part of a range that is within limits.
function within([least, most]: Range, low: number, high: number): Range {
  const clamp = (x: number) => Math.min(Math.max(x, least), most);
  return [clamp(low), clamp(high)];
}

function parsePlant(text: string): Plant {
  let given: Partial<Record<Parameter, unknown>>;
  try {
    given = JSON.parse(text) as typeof given;
  } catch {
    throw new BadInput('metadata "plant" is not JSON');
  }
  const plant = { ...NOMINAL };
  for (const name of Object.keys(NOMINAL) as Parameter[]) {
    const value = given?.[name];
    const [low, high] = PLANT_LIMITS[name];
    if (typeof value !== 'number' || !(value >= low && value <= high)) {
      const got = value === undefined ? 'none' : quoted(String(value));
      throw new BadInput(`metadata "plant": expected a ${name} of ${low} to ${high}, got ${got}`);
    }
    plant[name] = value;
  }
  return plant;
}
