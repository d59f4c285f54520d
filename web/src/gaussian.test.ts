import { expect, test } from 'vitest';
import { GaussianTorque, normal } from './gaussian';

test('the normal distribution, by its integral', () => {
  // Simpson's rule from far below, in steps of 0.01.
  const density = (x: number) => Math.exp((-x * x) / 2) / Math.sqrt(2 * Math.PI);
  let sum = 0;
  for (let k = 0; k < 1600; ++k) {
    const [a, b] = [-8 + k / 100, -8 + (k + 1) / 100];
    sum += (density(a) + 4 * density((a + b) / 2) + density(b)) / 600;
    expect(Math.abs(normal(b) - sum)).toBeLessThan(2e-7);
  }
  expect([normal(-Infinity), normal(Infinity)]).toEqual([0, 1]);
});

test.each([
  [true, 0.3, -1],
  [true, 2, 1],
  [true, -6, -4],
  [false, 0.3, -1],
  [false, 1.4, -0.5],
  [false, -0.2, 1],
])('squashed %s, mean %d, ln σ %d: the density is that of its samples', (squashed, mu, log) => {
  const limit = 5;
  const torque = new GaussianTorque(limit, squashed, mu, log);
  const pieces = 8;
  const density = torque.density(pieces);
  const width = (2 * limit) / pieces;
  const [low, high] = [torque.upTo(-limit), 1 - torque.upTo(limit)];
  expect(density.reduce((sum, p) => sum + p * width, low + high)).toBeCloseTo(1, 12);

  // Evenly drawn: the quantiles of u, by bisection.
  const draws = 4000;
  const counts = new Array<number>(pieces).fill(0);
  let [atLow, atHigh, central] = [0, 0, 0];
  for (let k = 0; k < draws; ++k) {
    let [from, to] = [-10, 10];
    while (to - from > 1e-9) {
      const middle = (from + to) / 2;
      if (normal(middle) < (k + 0.5) / draws) from = middle;
      else to = middle;
    }
    const u = mu + Math.exp(log) * from;
    if (!squashed && u <= -1) ++atLow;
    else if (!squashed && u >= 1) ++atHigh;
    else {
      const share = ((squashed ? Math.tanh(u) : u) + 1) / 2;
      ++counts[Math.min(pieces - 1, Math.floor(share * pieces))]!;
    }
    if (Math.abs(from) < 1) ++central;
  }
  counts.forEach((count, i) => {
    expect(Math.abs(count / draws - density[i]! * width)).toBeLessThan(2 / draws);
  });
  expect(Math.abs(atLow / draws - low)).toBeLessThan(2 / draws);
  expect(Math.abs(atHigh / draws - high)).toBeLessThan(2 / draws);
  expect(central / draws).toBeCloseTo(0.6827, 2);
  const bounded = (u: number) => limit * (squashed ? Math.tanh(u) : Math.min(Math.max(u, -1), 1));
  expect(torque.low).toBeCloseTo(bounded(mu - Math.exp(log)), 12);
  expect(torque.high).toBeCloseTo(bounded(mu + Math.exp(log)), 12);
});

test('ln σ is clamped as in training', () => {
  expect(new GaussianTorque(1, false, 0, -50).high).toBeCloseTo(Math.exp(-5), 12);
  expect(new GaussianTorque(1, true, 0, 1e30).high).toBeCloseTo(Math.tanh(Math.exp(2)), 12);
});
