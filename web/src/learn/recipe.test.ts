import { expect, test } from 'vitest';
import type { Setting } from './learner';
import { decodeRecipe, encodeRecipe } from './recipe';

const setting = (
  name: string,
  value: string,
  low: number | null,
  high: number | null,
): Setting => ({
  ...{ name, value, low, high },
  ...{ whole: false, unit: '', help: '' },
});
const SETTINGS = [
  setting('gamma', '0.99', 0, 1),
  setting('double', 'true', null, null),
  setting('reward', '', null, null),
];
const decode = (hash: string) => decodeRecipe(hash, ['fast', 'sac-fast'], () => SETTINGS);

test('a recipe survives its address', () => {
  const recipe = { agent: 'fast', seed: 42, settings: { gamma: '0.9', double: 'false' } };
  expect(encodeRecipe(recipe)).toBe('learn=fast&seed=42&gamma=0.9&double=false');
  expect(decode(`#${encodeRecipe(recipe)}`)).toEqual({ recipe, problems: [] });
});

test('a race survives its address', () => {
  const recipe = { agent: 'fast', seed: 1, settings: {}, rival: 'dqn' };
  expect(encodeRecipe(recipe)).toBe('learn=fast&seed=1&rival=dqn');
  expect(decode(`#${encodeRecipe(recipe)}`)).toEqual({ recipe, problems: [] });
});

test('a reward survives its address', () => {
  const reward = 'energy: E; up: 5*inverted && h > 0.5 ? 1 : 0';
  const recipe = { agent: 'fast', seed: 1, settings: { reward } };
  expect(decode(`#${encodeRecipe(recipe)}`)).toEqual({ recipe, problems: [] });
  for (const wrong of ['', 'x'.repeat(1001), 'E\n', 'π']) {
    const { recipe, problems } = decode(`#learn=fast&reward=${encodeURIComponent(wrong)}`);
    expect(recipe).toEqual({ agent: 'fast', seed: 1, settings: {} });
    expect(problems).toEqual(['reward: expected 1 to 1000 characters of an expression']);
  }
});

test('an address with only the view is no recipe', () => {
  expect(decode('#learn')).toEqual({ recipe: null, problems: [] });
});

test.each([
  ['learn=sac', null, 'learn: expected fast or sac-fast, got "sac"'],
  ['learn=fast&seed=-1', {}, 'seed: expected a whole number from 0 to 1000000000, got "-1"'],
  ['learn=fast&seed=1.5', {}, 'seed: expected a whole number from 0 to 1000000000, got "1.5"'],
  ['learn=fast&gamma=2', {}, 'gamma: expected a number from 0 to 1, got "2"'],
  ['learn=fast&gamma=', {}, 'gamma: expected a number from 0 to 1, got ""'],
  ['learn=fast&double=1', {}, 'double: expected true or false, got "1"'],
  ['learn=fast&rival=x', {}, 'rival: expected dqn, double, dueling, d3qn, sac, got "x"'],
  ['learn=fast&steps=1', {}, 'unknown setting "steps"'],
])('%s is refused in a line', (hash, settings, problem) => {
  const { recipe, problems } = decode(hash);
  expect(problems).toEqual([problem]);
  expect(recipe).toEqual(settings && { agent: 'fast', seed: 1, settings });
});
