import { createHash } from 'node:crypto';
import { expect, test } from 'vitest';
import { coreModule } from '../../tests/core';
import { Core, core } from '../core';
import { OBSERVATION_SIZE } from '../pendulum';
import { Policy } from '../policy';
import { BadInput } from '../bad_input';
import { agentSettings, Learner } from './learner';
import type { LearnSettings } from './learner';

const newCore = async () => Core.start(await coreModule());
/// The tensors of a policy file. The header before them also lists settings, whose number grows;
/// the first bytes give its length.
function hash(file: ArrayBuffer): string {
  const tensors = 8 + Number(new DataView(file).getBigUint64(0, true));
  return createHash('sha256').update(new Uint8Array(file, tensors)).digest('hex').slice(0, 16);
}

/// The policy after `steps` steps of 32 environments, `slice` at a time.
function learned(host: Core, seed: number, steps: number, slice: number): ArrayBuffer {
  const learner = new Learner(host, 'fast', seed);
  for (let done = 0; done < steps; done += slice) expect(learner.run(slice)).toBe(true);
  expect(learner.report().steps).toBe(32 * steps);
  const file = learner.policy();
  learner.close();
  return file;
}

// tests/learn.page.ts tests a whole training, in Node and in a browser.

// Hash of a policy trained by this module, in any browser and in Node. It changes with the
// algorithms and the compiler, like the fingerprints of the program.
const FINGERPRINT = '40a898a704b8dcfe';

test('the same seed gives the same bits: in another core, in other slices', async () => {
  const one = await newCore();
  expect(hash(learned(one, 2, 300, 10))).not.toBe(FINGERPRINT);
  expect(hash(learned(one, 1, 300, 100))).toBe(FINGERPRINT);
  expect(hash(learned(await newCore(), 1, 300, 1))).toBe(FINGERPRINT);
});

test('SAC learns too, with settings of its own', async () => {
  const learner = new Learner(await newCore(), 'sac-fast', 1, { learning_starts: '64' });
  learner.run(10);
  const { steps, updates } = learner.report();
  expect(steps).toBe(320);
  expect(updates).toBeGreaterThan(0);
  expect(new Policy(learner.policy()).about('output')).toBe('squashed-gaussian');
});

test('a training for any pose gives a policy that observes its goal', async () => {
  const learner = new Learner(await newCore(), 'fast', 1, { any_pose: 'true' });
  learner.run(10);
  const policy = new Policy(learner.policy());
  expect(policy.seeksAnyPose).toBe(true);
  expect(policy.controller.inputs).toBe(OBSERVATION_SIZE + 2);
});

test('settings are checked as the program checks them, in one line', async () => {
  const host = await newCore();
  for (const [settings, words] of [
    [{ learning_rate: '-1' }, 'learning_rate: expected a number in [0, 10], got "-1"'],
    [{ learning_rat: '1' }, 'learning_rate'],
    [{ batch: '1000', replay: '100' }, 'batch: expected at most 100 transitions'],
    [{ hidden: '4096,4096', replay: '10000000' }, 'memory'],
    [{ model: 'x.xml' }, 'model: expected a setting, got "model"'],
    [{ seed: '1\nepsilon_end' }, 'NAME=VALUE'],
  ] as [Record<string, string>, string][]) {
    const open = () => new Learner(host, 'fast', 1, settings);
    expect(open).toThrow(BadInput);
    expect(open).toThrow(words);
  }
  expect(() => new Learner(host, 'nobody', 1)).toThrow('got "nobody"');
});

test('a training that diverges ends with a reason, and its core goes on', async () => {
  const host = await newCore();
  const learner = new Learner(host, 'fast', 1, {
    ...{ layer_norm: 'false', dueling: 'false', hidden: '64,64,64,64,64,64,64,64', gamma: '1' },
    ...{ reward_scale: '1e9', balance_weight: '1000', learning_rate: '10', tau: '1' },
    ...{ max_gradient_norm: '1e9', learning_starts: '128', updates_per_step: '1', batch: '32' },
    mirror: 'false',
  });
  expect(() => {
    for (let k = 0; k < 20; ++k) learner.run(50);
  }).toThrow("the gradient's norm is inf, expected a finite number");
  learner.close();
  expect(new Learner(host, 'fast', 1).run(1)).toBe(true);
});

test('a training by a reward of your own', () => {
  const learn = (settings: LearnSettings) => {
    const learner = new Learner(core(), 'fast', 1, { learning_starts: '256', ...settings });
    learner.run(20);
    const policy = new Uint8Array(learner.policy().slice(-4000)); // the numbers, not the settings
    learner.close();
    return policy;
  };
  const post = 'E; h; 5*inverted; -0.01*inverted*(w1*w1 + w2*w2); -(0.01 + 0.04*inverted)*tau*tau';
  expect(learn({ reward: post })).toEqual(learn({}));
  expect(learn({ reward: 'h - 0.1*abs(tau)' })).not.toEqual(learn({}));
  expect(() => learn({ reward: 'E + w3' })).toThrow(
    'reward: term1: expected a known name, got "w3" (did you mean w1?)',
  );
  expect(() => learn({ reward: 'sqrt(0.5 - h)' })).toThrow(
    /^reward: term1: expected a number within ±1e9, got nan at q1 = /,
  );
});

test('a reward that prefers a side is not mirrored, which a warning says', () => {
  const warnings = (settings: LearnSettings) => {
    const learner = new Learner(core(), 'fast', 1, settings);
    const { warnings: found } = learner.report();
    learner.close();
    return found;
  };
  expect(warnings({ reward: 'w1 + E; -w1' })).toEqual([]);
  expect(warnings({ reward: '0.2*w1' })).toEqual([
    expect.stringMatching(/^mirror is off, because mirrored states have another reward: /),
  ]);
  expect(() => warnings({ reward: '0.2*w1', mirror: 'true' })).toThrow(/^mirror: expected false/);
});

test("the settings of an agent, with the program's descriptions", () => {
  const settings = agentSettings(core(), 'fast');
  expect(settings.get('learning_rate')).toMatchObject({ value: '0.002', low: 0, high: 10 });
  expect(settings.get('hidden')).toMatchObject({ value: '48,32' });
  expect(settings.get('epsilon_end')!.help).toBe('lowest probability of a random action');
});

test('trainings one after another take no more memory', async () => {
  const host = await newCore();
  const train = () => {
    const learner = new Learner(host, 'fast', 1, { learning_starts: '256' });
    learner.run(30);
    expect(learner.report().updates).toBeGreaterThan(0);
    learner.policy();
    learner.report();
    learner.close();
  };
  for (let k = 0; k < 2; ++k) train();
  const before = host.exports.memory.buffer.byteLength;
  for (let k = 0; k < 10; ++k) train();
  expect(host.exports.memory.buffer.byteLength).toBe(before);
});
