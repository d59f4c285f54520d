import { CoreController } from './controller';
import type { Controller, Decision, Memory } from './decision';
import { DISTURBANCE_LIMITS } from './disturbance';
import type { Disturbance } from './disturbance';
import { NOMINAL, PLANT_LIMITS, plantIn } from './pendulum';
import type { Parameter, Plant, Range } from './pendulum';
import { Neurons } from './neurons';
import { BadInput } from './bad_input';
import { printable } from './text';

const LONGEST_REASON = 200; // characters; a file's own text may be part of it

/// A learned policy (docs/reference/policy-format.md) or a controller: observation → torque.
export class Policy {
  readonly metadata: ReadonlyMap<string, string>;
  readonly controller: Controller;
  /// Number of past steps in an observation.
  readonly memory: number;
  /// Whether an observation contains an estimate of the plant.
  readonly identifies: boolean;
  /// Whether an observation contains the pose to reach. Otherwise that is upright.
  readonly seeksAnyPose: boolean;
  /// The training plant, or a controller's design plant. Of a policy for another size, the built-in
  /// plant, to which it was carried over.
  readonly plant: Plant;
  readonly isCarried: boolean;
  /// Length (m) of the plant of another size, which is the size of a plant like the built-in one.
  readonly trainedSize: number;
  /// Time between two decisions, s.
  readonly period: number;
  /// The same at its trained size.
  readonly trainedPeriod: number;
  /// Factor of the rewards, and so of its values, during training.
  readonly rewardScale: number;
  /// Its file, or the name of a controller.
  readonly source: ArrayBuffer | string;
  private readonly timeUnit: number; // of the built-in plant, in those of the training plant
  private _neurons: Neurons | null | undefined; // undefined: not read yet

  /// Reads and checks a file, as the program does, or designs the controller with this name. Throws
  /// BadInput.
  constructor(from: ArrayBuffer | string) {
    this.source = from;
    try {
      const controller = new CoreController(from);
      this.controller = controller;
      this.memory = controller.about.memory;
      this.identifies = controller.about.identifies;
      this.seeksAnyPose = controller.about.any_pose;
      const { period, time_unit, torque_unit } = controller.about;
      this.isCarried = time_unit !== 1 || torque_unit !== 1;
      this.timeUnit = time_unit;
      this.trainedPeriod = period;
      this.period = period * time_unit;
      this.metadata = new Map(Object.entries(controller.about.metadata));
    } catch (error) {
      if (!(error instanceof BadInput)) throw error;
      // The page names the source itself.
      throw new BadInput(printable(error.message.replace(/^the file: /, ''), LONGEST_REASON));
    }
    const trained = JSON.parse(this.about('plant')) as Plant;
    this.plant = this.isCarried ? NOMINAL : plantIn(trained);
    this.trainedSize = this.isCarried ? trained.length1 + trained.length2 : 1;
    this.rewardScale = Number(this.metadata.get('reward_scale') ?? 1);
  }

  /// Its neurons, for display; null if it has none to show.
  get neurons(): Neurons | null {
    const { source } = this;
    if (this._neurons === undefined) {
      this._neurons = typeof source === 'string' ? null : Neurons.of(source);
    }
    return this._neurons;
  }

  get isLearned(): boolean {
    return this.controller.isLearned;
  }

  /// Whether it decides fast enough for a map of hundreds of states.
  get isQuick(): boolean {
    return this.metadata.get('agent') !== 'mpc';
  }

  /// Whether it can swing up, not only hold the pendulum upright.
  get swingsUp(): boolean {
    return this.isLearned || this.metadata.get('agent') !== 'lqr';
  }

  about(key: string): string {
    const text = this.metadata.get(key);
    if (text === undefined) throw new BadInput(`expected metadata "${key}", found none`);
    return text;
  }

  /// Decides as at the beginning of an episode, without a memory.
  act(observation: Float32Array, memory: Memory | null = null): Decision {
    return this.controller.decide(observation, memory);
  }

  /// The range [low, high] of a parameter during training.
  trainedRange(name: Parameter): Range {
    const share = this.setting(`randomize_${name}`);
    const nominal = this.plant[name];
    return within(PLANT_LIMITS[name], nominal * (1 - share), nominal * (1 + share));
  }

  /// The range of an error of sensors or motor during training, in the units of Disturbance.
  trainedDisturbance(name: keyof Disturbance): Range {
    const unit = this.disturbanceUnit(name);
    const least = this.setting(name) / unit;
    const most = least + this.setting(`randomize_${name}`) / unit;
    return within(DISTURBANCE_LIMITS[name], least, most);
  }

  /// The unit of an error of sensors or motor in the training's configuration.
  private disturbanceUnit(name: keyof Disturbance): number {
    if (name === 'delay') return this.trainedPeriod;
    return name === 'sensor_noise' || name === 'encoder_counts' ? 1 : 1 / this.timeUnit;
  }

  /// A positive number of the training's configuration; 0 if it is missing.
  private setting(name: string): number {
    const line = new RegExp(`^${name} = ([0-9.eE+-]+)$`, 'm');
    const value = Number(line.exec(this.metadata.get('config') ?? '')?.[1] ?? 0);
    return value > 0 && value < Infinity ? value : 0;
  }
}

/// Clips a range to limits.
function within([least, most]: Range, low: number, high: number): Range {
  const clamp = (x: number) => Math.min(Math.max(x, least), most);
  return [clamp(low), clamp(high)];
}
