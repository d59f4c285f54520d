import { expect, test } from 'vitest';
import { core } from './core';
import { Fields, parseTable } from './fields';
import { IDENTIFIED_FIELDS } from './identifier';
import { JUDGEMENT_FIELDS, OBSERVATION_SIZE, PLANT_FIELDS, STATE_FIELDS } from './pendulum';

const NAMES = ['q1', 'q2', 'w1', 'w2'] as const;
const VALUES = { q1: 1, q2: 2, w1: 3, w2: 4 };

/// Fields of a state in a core whose table has this line.
function stateIn(line: string): Fields<readonly [typeof NAMES]> {
  const fields = new Fields('state', NAMES);
  fields.find(parseTable(line));
  return fields;
}

test("numbers are in the core's order", () => {
  const fields = stateIn('state w1:1 q2:1 q1:1 w2:1');
  expect(fields.numbers(VALUES)).toEqual([3, 2, 1, 4]);
  expect(fields.object(Float64Array.of(3, 2, 1, 4))).toEqual(VALUES);
});

test('a field may have several numbers', () => {
  const fields = stateIn('state q1:1 q2:3 w1:1 w2:1');
  const numbers = Float64Array.of(0, 1, 2, 3, 4, 5);
  expect([...fields.readAll(numbers, 'q2')]).toEqual([1, 2, 3]);
  expect(fields.read(numbers, 'w1')).toBe(4);
  expect(fields.size).toBe(6);
});

test.each([
  ['a missing field', 'state q1:1 q2:1 w1:1'],
  ['another field', 'state q1:1 q2:1 w1:1 w2:1 torque:1'],
  ['another name', 'state q1:1 q2:1 w1:1 v2:1'],
  ['no such struct', 'poses q1:1 q2:1 w1:1 w2:1'],
])('%s is an error', (_, line) => {
  expect(() => stateIn(line)).toThrow('state: the page expects the fields q1, q2, w1, w2');
});

test("a struct that differs from the running core's is an error", () => {
  expect(() => new Fields('capsule', ['mass', 'radius'])).toThrow('the core has length, mass');
});

test("the core's own table", () => {
  core().exports.field_table();
  const table = parseTable(core().text);
  expect([...table.get('state')!.keys()]).toEqual(NAMES);
  const sizes = [PLANT_FIELDS, STATE_FIELDS, JUDGEMENT_FIELDS, IDENTIFIED_FIELDS].map(
    (f) => f.size,
  );
  expect(sizes).toEqual([9, 4, OBSERVATION_SIZE + 5 + 5, 13]);
});
