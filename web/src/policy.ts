import { Actor, isActorOutput } from './actor';
import type { Controller, Decision } from './decision';
import { Greedy } from './greedy';
import { MEMORY_SIZE } from './observation';
import { DISTURBANCE_LIMITS } from './disturbance';
import { CONTROL_PERIOD, MAX_VELOCITY, NOMINAL, OBSERVATION_SIZE, PLANT_LIMITS } from './pendulum';
import type { Parameter, Plant, Range } from './pendulum';
import { BadInput, parseSafetensors } from './safetensors';
import type { TensorFile } from './safetensors';
import { quoted } from './text';

/// A learned policy: observation → torque, nothing else needed (docs/policy-format.md).
export class Policy {
  readonly metadata: ReadonlyMap<string, string>;
  readonly controller: Controller;
  /// How many past steps an observation remembers.
  readonly memory: number;
  /// The plant that it was trained on.
  readonly plant: Plant;
  /// Factor by which rewards, and so its values, were multiplied during training.
  readonly rewardScale: number;

  /// Reads and checks the file: format, shapes, finite numbers, samples. Throws BadInput.
  constructor(bytes: ArrayBuffer) {
    const file = parseSafetensors(bytes);
    this.metadata = file.metadata;
    this.expect('format', 'upswing-policy');
    this.expect('format_version', '1');
    if (Number(this.about('control_period')) !== CONTROL_PERIOD) {
      this.expect('control_period', String(CONTROL_PERIOD));
    }
    if (file.metadata.has('model')) {
      throw new BadInput('it was trained on a model of its own, which this page does not have');
    }

    this.controller = this.readController(file);
    const { inputs } = this.controller;
    this.memory = (inputs - OBSERVATION_SIZE) / MEMORY_SIZE;
    if (!Number.isInteger(this.memory) || this.memory < 0) {
      throw new BadInput(`expected 8 inputs and 3 for each step remembered, got ${inputs}`);
    }
    this.checkObservation();
    this.plant = parsePlant(this.about('plant'));
    this.rewardScale = Number(this.metadata.get('reward_scale') ?? 1);
    if (!(this.rewardScale > 0 && this.rewardScale < Infinity)) {
      throw new BadInput('metadata "reward_scale": expected a positive number');
    }
  }

  about(key: string): string {
    const text = this.metadata.get(key);
    if (text === undefined) throw new BadInput(`expected metadata "${key}", found none`);
    return text;
  }

  act(observation: Float32Array): Decision {
    return this.controller.decide(observation);
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

  private readController(file: TensorFile): Controller {
    const output = this.about('output');
    const network = this.about('network');
    if (isActorOutput(output)) {
      return new Actor(file, output, network, this.metadata.get('critic'));
    }
    this.expect('output', 'levels');
    return new Greedy(file, network);
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
