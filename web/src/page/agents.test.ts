import { expect, test } from 'vitest';
import { parseCurve, parseEntry } from './agents';

const ENTRY = { id: 'a', file: 'a.safetensors', agent: 'd3qn' };
const CURVE = { step: [10, 20], success_rate: [0, 1], mean_return: [-1, 2600] };

test('an entry needs ID, file and agent', () => {
  expect(parseEntry(ENTRY)).toEqual({ ...ENTRY, command: null, curve: null, checkpoints: [] });
  for (const entry of [
    null,
    1,
    'x',
    [],
    {},
    { ...ENTRY, id: 1 },
    { ...ENTRY, id: '' },
    { ...ENTRY, file: null },
    { ...ENTRY, agent: 'x'.repeat(1000) },
    { ...ENTRY, id: 'own' }, // stands for a visitor's
  ]) {
    expect(parseEntry(entry)).toBeNull();
  }
});

test('only a single shell command is shown', () => {
  const commandOf = (command: unknown) => parseEntry({ ...ENTRY, command })!.command;
  expect(commandOf('./upswing train --seed 1')).toBe('./upswing train --seed 1');
  expect(commandOf('./upswing train; id')).toBeNull();
  expect(commandOf(7)).toBeNull();
});

test('invalid checkpoints are left out', () => {
  const way = [
    { step: 0, file: 'a-at-0.safetensors' },
    { step: 20, file: 'a.safetensors' },
  ];
  const checkpointsOf = (checkpoints: unknown) =>
    parseEntry({ ...ENTRY, checkpoints })!.checkpoints;
  expect(checkpointsOf(way)).toEqual(way);
  for (const checkpoints of [
    'x',
    [null],
    [...way].reverse(),
    [{ ...way[0], step: -1 }],
    [{ ...way[0], step: 0.5 }],
    [{ ...way[0], file: '' }],
    Array.from({ length: 1000 }, (_, step) => ({ ...way[0], step })),
  ]) {
    expect(checkpointsOf(checkpoints)).toEqual([]);
  }
});

test('an invalid learning curve is left out', () => {
  expect(parseCurve(CURVE)).toEqual(CURVE);
  for (const curve of [
    undefined,
    'x',
    { ...CURVE, step: [10] },
    { ...CURVE, step: [20, 10] },
    { ...CURVE, step: ['10', '20'] },
    { ...CURVE, success_rate: [0, 2] },
    { ...CURVE, mean_return: [null, 1] },
    { step: [], success_rate: [], mean_return: [] },
  ]) {
    expect(parseCurve(curve)).toBeNull();
  }
});
