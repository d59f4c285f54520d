import { CoreController } from './controller';
import type { Controller, Decision, Memory } from './decision';
import { DISTURBANCE_LIMITS } from './disturbance';
import type { Disturbance } from './disturbance';
import { CONTROL_PERIOD, PLANT_LIMITS, plantIn } from './pendulum';
import type { Parameter, Plant, Range } from './pendulum';
import { Neurons } from './neurons';
import { BadInput } from './bad_input';
import { printable } from './text';

const LONGEST_REASON = 200; // characters; a file's own text may be part of it

/// A learned policy (docs/reference/policy-format.md) or a controller: observation → torque.
export class Policy {
  readonly metadata: ReadonlyMap<string, string>;
  readonly controller: Controller;
  /// How many past steps an observation remembers.
  readonly memory: number;
  /// Whether an observation holds an estimate of the plant.
  readonly identifies: boolean;
  /// The plant that it was trained on, or made for.
  readonly plant: Plant;
  /// Factor by which rewards, and so its values, were multiplied during training.
  readonly rewardScale: number;
  private readonly file: ArrayBuffer | null; // null: a controller
  private _neurons: Neurons | null | undefined; // undefined: not made yet

  /// Reads and checks the file, as the program does, or makes the controller of a name. Throws BadInput.
  constructor(from: ArrayBuffer | string) {
    this.file = typeof from === 'string' ? null : from;
    try {
      const controller = new CoreController(from);
      this.controller = controller;
      this.memory = controller.about.memory;
      this.identifies = controller.about.identifies;
      this.metadata = new Map(Object.entries(controller.about.metadata));
    } catch (error) {
      if (!(error instanceof BadInput)) throw error;
      // The core names its source, which the page names itself.
      throw new BadInput(printable(error.message.replace(/^the file: /, ''), LONGEST_REASON));
    }
    this.plant = plantIn(JSON.parse(this.about('plant')) as Plant);
    this.rewardScale = Number(this.metadata.get('reward_scale') ?? 1);
  }

  /// Its neurons, for display; null where there are none to show.
  get neurons(): Neurons | null {
    if (this._neurons === undefined) this._neurons = this.file && Neurons.of(this.file);
    return this._neurons;
  }

  get isLearned(): boolean {
    return this.controller.isLearned;
  }

  /// Whether hundreds of decisions from new states can be had while one watches.
  get isQuick(): boolean {
    return this.metadata.get('agent') !== 'mpc';
  }

  /// Whether it can do more than hold what is upright already.
  get swingsUp(): boolean {
    return this.isLearned || this.metadata.get('agent') !== 'lqr';
  }

  about(key: string): string {
    const text = this.metadata.get(key);
    if (text === undefined) throw new BadInput(`expected metadata "${key}", found none`);
    return text;
  }

  /// Without a memory as at the beginning of an episode.
  act(observation: Float32Array, memory: Memory | null = null): Decision {
    return this.controller.decide(observation, memory);
  }

  /// The range [low, high] of a parameter during training.
  trainedRange(name: Parameter): Range {
    const share = this.setting(`randomize_${name}`);
    const nominal = this.plant[name];
    return within(PLANT_LIMITS[name], nominal * (1 - share), nominal * (1 + share));
  }

  /// The same for the errors of sensors and motor, in the units of Disturbance.
  trainedDisturbance(name: keyof Disturbance): Range {
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
}

/// The part of a range that is within limits.
function within([least, most]: Range, low: number, high: number): Range {
  const clamp = (x: number) => Math.min(Math.max(x, least), most);
  return [clamp(low), clamp(high)];
}
