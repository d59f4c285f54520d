import { argMax, checkChoice, checkOutputs, readSamples } from './decision';
import type { Controller, Decision } from './decision';
import { GaussianTorque } from './gaussian';
import { isUnits, linear, parseTrunk, readLayer, Trunk } from './layers';
import type { Layer, TrunkShape } from './layers';
import { BadInput, read } from './safetensors';
import type { TensorFile } from './safetensors';

/// How an actor's outputs choose a torque (docs/policy-format.md).
const OUTPUTS = ['squashed-gaussian', 'clipped-gaussian', 'categorical'] as const;
export type ActorOutput = (typeof OUTPUTS)[number];

export function isActorOutput(text: string): text is ActorOutput {
  return (OUTPUTS as readonly string[]).includes(text);
}

/// A network of a trunk and a linear layer.
class Mlp {
  readonly shape: TrunkShape;
  private readonly trunk: Trunk;
  private readonly output: Layer;

  constructor(shape: TrunkShape, outputs: number, file: TensorFile, prefix = '') {
    this.shape = shape;
    this.trunk = new Trunk(shape, file, prefix);
    this.output = readLayer(file, `${prefix}output`, outputs, this.trunk.features);
  }

  forward(x: Float32Array): Float32Array {
    return linear(this.output, this.trunk.forward(x));
  }

  get text(): string {
    return [this.shape.inputs, ...this.shape.hidden].join('-');
  }
}

/// Takes the middle of the distribution that an actor network puts out. A critic may estimate the
/// value of what it sees, or of that with its mean action.
export class Actor implements Controller {
  readonly inputs: number;
  readonly selfCheckError: number;
  private readonly output: ActorOutput;
  private readonly network: Mlp;
  private readonly critic: Mlp | null = null;
  private readonly limit: number; // N·m
  private readonly torques: Float64Array; // (A) N·m, of a categorical one

  /// `network` and `critic` (undefined: there is none) are metadata. Throws BadInput.
  constructor(file: TensorFile, output: ActorOutput, network: string, critic: string | undefined) {
    const categorical = output === 'categorical';
    const shape = parseTrunk(network, 'network');
    this.output = output;
    this.inputs = shape.inputs;
    this.limit = read(file, 'action_limit', 'F64', [1])[0]!;
    if (!(this.limit > 0)) throw new BadInput('tensor "action_limit": expected a positive number');
    this.torques = new Float64Array();
    if (categorical) {
      const count = file.tensors.get('torques')?.shape[0] ?? 0;
      if (!isUnits(count)) throw new BadInput(`tensor "torques": expected 1 to 4096, got ${count}`);
      this.torques = read(file, 'torques', 'F64', [count]) as Float64Array;
    }
    this.network = new Mlp(shape, categorical ? this.torques.length : 2, file);
    if (critic !== undefined) {
      const criticShape = parseTrunk(critic, 'critic');
      const more = criticShape.inputs - shape.inputs;
      if (more !== 0 && more !== 1) {
        throw new BadInput(
          `expected a critic of ${shape.inputs} or ${shape.inputs + 1} inputs, got ${criticShape.inputs}`,
        );
      }
      this.critic = new Mlp(criticShape, 1, file, 'critic.');
    }
    this.selfCheckError = this.checkSamples(file);
  }

  get strongest(): number {
    return this.output === 'categorical' ? Math.max(...this.torques) : this.limit;
  }

  get text(): string {
    const how =
      this.output === 'categorical'
        ? `one of ${this.torques.length} torques`
        : this.output === 'squashed-gaussian'
          ? 'a Gaussian squashed by tanh'
          : 'a Gaussian, clipped';
    return [
      `Actor ${this.network.text}: ${how}`,
      this.network.shape.layer_norm ? ', layer normalisation' : '',
      this.critic ? `; critic ${this.critic.text}` : '',
    ].join('');
  }

  decide(observation: Float32Array): Decision {
    const outputs = this.network.forward(observation);
    if (this.output !== 'categorical') {
      const squashed = this.output === 'squashed-gaussian';
      const distribution = new GaussianTorque(this.limit, squashed, outputs[0]!, outputs[1]!);
      // Numbers that overflowed on the way move nothing.
      const torque = Number.isFinite(distribution.mean) ? distribution.mean : 0;
      return { kind: 'gaussian', distribution, torque, value: this.value(observation, torque) };
    }
    const { torques } = this;
    const action = argMax(outputs);
    const weights = Float64Array.from(outputs, (logit) => Math.exp(logit - outputs[action]!));
    const sum = weights.reduce((total, weight) => total + weight, 0);
    const torque = torques[action]!;
    return {
      kind: 'categorical',
      ...{ torques, action, torque, probabilities: weights.map((weight) => weight / sum) },
      value: this.value(observation, torque),
    };
  }

  /// What the critic says of the observation, or of that and the torque in ±1 behind it.
  private value(observation: Float32Array, torque: number): number {
    if (!this.critic) return NaN;
    if (this.critic.shape.inputs === this.inputs) return this.critic.forward(observation)[0]!;
    const inputs = new Float32Array(this.inputs + 1);
    inputs.set(observation);
    inputs[this.inputs] = torque / this.limit;
    return this.critic.forward(inputs)[0]!;
  }

  private checkSamples(file: TensorFile): number {
    const samples = readSamples(file, 'sample.action', this.inputs);
    const actions = read(file, 'sample.action', 'F64', [samples.length, 1]);
    const outputs = samples.map((observation) => this.network.forward(observation));
    const { error, tolerance } = checkOutputs(file, 'sample.output', 'output', outputs);
    samples.forEach((observation, i) => {
      const action = actions[i]!;
      if (this.output === 'categorical') {
        checkChoice(action, this.torques, outputs[i]!, 2 * tolerance, i);
        return;
      }
      const { torque } = this.decide(observation);
      if (Math.abs(torque - action) <= this.limit * Math.max(tolerance, 1e-9)) return;
      throw new BadInput(`self-check: expected a torque of ${action}, got ${torque} (sample ${i})`);
    });
    if (!this.critic) return error;
    const values = samples.map((observation) => Float32Array.of(this.decide(observation).value));
    return Math.max(error, checkOutputs(file, 'sample.value', 'value', values).error);
  }
}
