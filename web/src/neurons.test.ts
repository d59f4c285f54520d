import { expect, test } from 'vitest';
import { readPolicy } from '../tests/program';
import { Neurons, tensorsOf } from './neurons';

/// Q-values of the last hidden layer's output: u for the value, v for the advantages.
function qOf(tensors: Map<string, Float32Array>, x: Float32Array): number[] {
  const linear = (name: string, input: Float32Array) =>
    [...tensors.get(`${name}.bias`)!].map((bias, i) =>
      input.reduce((sum, value, k) => {
        return sum + tensors.get(`${name}.weight`)![i * input.length + k]! * value;
      }, bias),
    );
  if (!tensors.has('value.weight')) return linear('output', x);
  const [value] = linear('value', x.subarray(0, x.length / 2));
  const advantages = linear('advantage', x.subarray(x.length / 2));
  const mean = advantages.reduce((sum, a) => sum + a, 0) / advantages.length;
  return advantages.map((advantage) => value! + advantage - mean);
}

test.each(['d3qn', 'fast', 'dqn'])(
  'the neurons of %s lead to the Q-values of the samples in its file',
  (id) => {
    const file = readPolicy(id);
    const neurons = Neurons.of(file)!;
    const tensors = tensorsOf(file);
    const [observations, expected] = [tensors.get('sample.obs')!, tensors.get('sample.q')!];
    const samples = 16;
    const largest = Math.max(...expected.map(Math.abs));
    for (let i = 0; i < samples; ++i) {
      const inputs = observations.length / samples;
      const layers = neurons.active(observations.slice(i * inputs, (i + 1) * inputs));
      qOf(tensors, layers.at(-1)!).forEach((q, k) => {
        // Rounding of 32-bit floats, summed in another order.
        expect(Math.abs(q - expected[i * 9 + k]!)).toBeLessThan(1e-5 * largest);
      });
    }
  },
);

test('an actor has no neurons to show', () => {
  expect(Neurons.of(readPolicy('sac'))).toBeNull();
});
