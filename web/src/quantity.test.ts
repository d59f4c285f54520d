import { expect, test } from 'vitest';
import { quantity, roundBelow, shownIn, sizeText } from './quantity';

test.each([
  [1, 'kg', '1 kg'],
  [0.25, 'N·m', '0.25 N·m'],
  [0, 'N·m·s', '0 N·m·s'],
  [0.05, 'kg', '0.05 kg'],
  [1.25e-4, 'kg', '0.125 g'],
  [1e-6, 'kg', '1 mg'],
  [0.0025, 'kg', '2.5 g'],
  [1000, 'kg', '1 t'],
  [2500000, 'kg', '2500 t'],
  [3.125e-5, 'N·m', '31.25 µN·m'],
  [-50000, 'N·m', '−50 kN·m'],
  [2.795e-7, 'N·m·s', '279.5 nN·m·s'],
  [1e-12, 'N·m', '0.001 nN·m'],
  [0.001, 'm', '1 mm'],
] as const)('%d %s is shown as %s', (value, unit, text) => {
  expect(quantity(value, 1, unit)).toBe(text);
});

test('an axis has one unit, for its largest number', () => {
  const { factor, unit } = shownIn(5, 6.25e-6, 'N·m');
  expect(unit).toBe('µN·m');
  expect(5 * factor).toBeCloseTo(31.25, 9);
  expect(shownIn(0.3125, 1, 'N·m', 1)).toEqual({ factor: 1000, unit: 'mN·m' });
  expect(shownIn(5, 1, 'N·m')).toEqual({ factor: 1, unit: 'N·m' });
});

test('a size is named by a thing as long', () => {
  expect([0.05, 0.5, 0.79, 1, 2, 10].map(sizeText)).toEqual([
    '5 cm, a matchbox',
    '50 cm, a chair',
    '79 cm, a table',
    '1 m, a guitar',
    '2 m, a door',
    '10 m, a house',
  ]);
});

test('rounds down to 1, 2 or 5', () => {
  expect([0.013, 0.03, 0.07, 1, 4.9, 999].map(roundBelow)).toEqual([0.01, 0.02, 0.05, 1, 2, 500]);
});
