import { withMinus } from './text';

/// Physical quantities as text, with SI prefixes where a pendulum is far from the usual size.

const PREFIXES = ['n', 'µ', 'm', '', 'k', 'M'] as const; // from 10⁻⁹ on
const LARGEST = 1000; // number without a prefix

/// A unit, and the factor of numbers that are shown in it.
export interface Shown {
  factor: number;
  unit: string;
}

/// The unit for numbers up to `largest`, in `si` SI units. `unit`: the SI unit's name, which needs no
/// prefix from `least` on.
export function shownIn(largest: number, si: number, unit: string, least = 0.1): Shown {
  const size = Math.abs(largest * si);
  if (size === 0 || (size >= least && size < LARGEST)) return { factor: si, unit };
  if (unit === 'kg' && size >= LARGEST) return { factor: si / 1000, unit: 't' };
  if (unit === 'kg') return shownIn(largest, 1000 * si, 'g');
  const step = Math.floor(Math.log10(size) / 3 + 1e-9);
  const within = Math.min(Math.max(step, -3), 2);
  return { factor: si / 1000 ** within, unit: PREFIXES[within + 3] + unit };
}

/// A value with its unit, to four digits.
export function quantity(value: number, si: number, unit: string): string {
  const shown = shownIn(value, si, unit, 0.01);
  return withMinus(`${Number((value * shown.factor).toPrecision(4))} ${shown.unit}`);
}

/// `value` rounded down to 1, 2 or 5 times a power of ten.
export function roundBelow(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (value >= 5 * power ? 5 : value >= 2 * power ? 2 : 1);
}

/// Things about as long as the whole pendulum (m).
const LANDMARKS = [
  [0.05, 'a matchbox'],
  [0.1, 'a mug'],
  [0.2, 'a pencil'],
  [0.4, 'a chair'],
  [0.75, 'a table'],
  [1, 'a guitar'],
  [2, 'a door'],
  [5, 'a giraffe'],
  [10, 'a house'],
] as const;

/// A length (m) in figures, and the thing whose length is nearest.
export function sizeText(length: number): string {
  const apart = (other: number) => Math.abs(Math.log(length / other));
  const [, thing] = LANDMARKS.reduce((a, b) => (apart(b[0]) < apart(a[0]) ? b : a));
  const figures =
    length < 1
      ? `${Number((100 * length).toPrecision(2))} cm`
      : `${Number(length.toPrecision(2))} m`;
  return `${figures}, ${thing}`;
}
