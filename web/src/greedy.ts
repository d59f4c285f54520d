import { argMax, checkChoice, checkOutputs, readSamples } from './decision';
import type { Controller, QDecision } from './decision';
import { Network, parseShape } from './network';
import { read } from './safetensors';
import type { TensorFile } from './safetensors';

/// Chooses the torque with the largest Q-value (docs/policy-format.md, output `levels`).
export class Greedy implements Controller {
  readonly inputs: number;
  readonly network: Network;
  readonly torques: Float64Array; // (A) N·m
  readonly selfCheckError: number;

  /// Throws BadInput.
  constructor(file: TensorFile, network: string) {
    const shape = parseShape(network);
    this.inputs = shape.inputs;
    this.network = new Network(shape, file);
    this.torques = read(file, 'torques', 'F64', [shape.actions]) as Float64Array;
    this.selfCheckError = this.checkSamples(file);
  }

  get strongest(): number {
    return Math.max(...this.torques);
  }

  get text(): string {
    const { inputs, hidden, dueling, head, layer_norm } = this.network.shape;
    return [
      `${dueling ? 'Dueling' : 'Plain'} network ${[inputs, ...hidden].join('-')}`,
      dueling ? ` with heads of ${head}` : '',
      layer_norm ? ', layer normalisation' : '',
      `, ${this.torques.length} torques`,
    ].join('');
  }

  decide(observation: Float32Array): QDecision {
    const { torques } = this;
    const { q, value } = this.network.forward(observation);
    const action = argMax(q);
    return { kind: 'q', torques, q, action, torque: torques[action]!, value };
  }

  private checkSamples(file: TensorFile): number {
    const samples = readSamples(file, 'sample.torque', this.inputs);
    const torque = read(file, 'sample.torque', 'F64', [samples.length]);
    const q = samples.map((observation) => this.network.forward(observation).q);
    const { error, tolerance } = checkOutputs(file, 'sample.q', 'Q-value', q);
    q.forEach((row, i) => checkChoice(torque[i]!, this.torques, row, 2 * tolerance, i));
    return error;
  }
}
