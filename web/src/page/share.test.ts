import { expect, test } from 'vitest';
import { NOMINAL } from '../pendulum';
import type { Range } from '../pendulum';
import { BEGINNING, decode, encode } from './share';
import type { Shared } from './share';

const RANGES: ReadonlyMap<string, Range> = new Map<string, Range>([
  ['mass1', [0.2, 3]],
  ['gravity', [1, 25]],
  ['speed', [0.1, 2]],
  ['sensor_noise', [0, 0.2]],
  ['delay', [0, 5]],
  ['sensor_latency', [0, 0.1]],
  ['encoder_counts', [0, 1e9]],
  ['velocity_window', [0, 0.1]],
]);
const has = (agent: string) => agent !== 'unknown' && agent !== 'own';

test('the initial state gives an empty link', () => {
  expect(encode(BEGINNING)).toBe('');
  expect(decode('', RANGES, has)).toEqual({ shared: BEGINNING, problems: [] });
});

test('a link restores its state', () => {
  const shared: Shared = {
    twin: 'sac',
    agent: 'a b&c',
    on: true,
    goal: 'down-up',
    speed: 0.3,
    plant: { ...NOMINAL, mass1: 1.2345678901234567, gravity: 3.71 },
    sensor_noise: 0.05,
    delay: 2,
    sensor_latency: 0.005,
    encoder_counts: 4096,
    velocity_window: 0.01,
    velocity_filter: 0,
  };
  expect(decode(`#${encode(shared)}`, RANGES, has)).toEqual({ shared, problems: [] });
});

test.each([
  ['mass1=0.1', 'mass1: expected 0.2 to 3, got "0.1"'],
  ['mass1=1e99', 'mass1: expected 0.2 to 3, got "1e99"'],
  ['mass1=NaN', 'mass1: expected 0.2 to 3, got "NaN"'],
  ['mass1=', 'mass1: expected 0.2 to 3, got ""'],
  ['goal=up', 'goal: expected up-up, up-down, down-up, down-down, got "up"'],
  ['mass3=1', 'unknown setting "mass3"'],
  [`${'x'.repeat(5000)}=1`, `unknown setting "${'x'.repeat(59)}…"`],
  [`mass1=${'1'.repeat(5000)}`, `mass1: expected 0.2 to 3, got "${'1'.repeat(59)}…"`],
  ['a%0Ab=1', 'unknown setting "a\ufffdb"'],
  ['__proto__=1', 'unknown setting "__proto__"'],
])('%s is reported and left out', (hash, problem) => {
  expect(decode(hash, RANGES, has)).toEqual({ shared: BEGINNING, problems: [problem] });
});

test("a missing agent is left out, and a visitor's own policy gets its own message", () => {
  const { shared, problems } = decode('agent=unknown&twin=own', RANGES, has);
  expect([shared.agent, shared.twin]).toEqual([null, null]);
  expect(problems).toEqual([
    'unknown agent "unknown"',
    'it does not contain its sender’s own policy',
  ]);
});
