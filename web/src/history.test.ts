import { expect, test } from 'vitest';
import { HANGING } from './pendulum';
import { History } from './history';

const moment = (t: number) => ({ t, state: { ...HANGING }, torque: 1.25, energy: 0, height: -1 });

test('keeps the last seconds, oldest first', () => {
  const history = new History(10);
  for (let k = 0; k <= 5000; ++k) history.add(moment(k / 50));
  const shown = history.from(95);
  expect(shown.length).toBe(251);
  expect([shown[0]!.t, shown.at(-1)!.t]).toEqual([95, 100]);
  expect(history.from(0).length).toBeLessThanOrEqual(2 * 501);
  expect(history.from(101)).toEqual([]);
});

test('a window includes its oldest moment, whenever it began', () => {
  for (let start = 0; start < 1000; start += 9) {
    const history = new History(60);
    const time = (k: number) => (start + 4 * k) / 200; // as World.time
    for (let k = 0; k <= 4000; ++k) history.add(moment(time(k)));
    // Control steps 0.02 s apart: 65 in 1.3 s, and the first one.
    expect(history.from(time(4000) - 1.3).length, `${start}`).toBe(66);
    expect(history.from(time(4000) - 10).length, `${start}`).toBe(501);
    expect(history.from(0).length, `${start}`).toBe(3001);
  }
});

test("writes CSV with time from the history's start", () => {
  const history = new History(10);
  history.add(moment(3));
  history.add({ ...moment(3.02), state: { q1: 0.1, q2: -1 / 3, w1: 0, w2: 2 } });
  expect(history.csv()).toBe(
    't,q1,q2,w1,w2,torque\n0.00,0,0,0,0,1.25\n0.02,0.1,-0.3333333333333333,0,2,1.25\n',
  );
});

test('writes only the moments at the last size, in its units', () => {
  const history = new History(10);
  const moved = { ...moment(3.02), state: { q1: 0.1, q2: 0, w1: 1, w2: 2 } };
  history.add(moment(3));
  history.add(moved, 4);
  history.add({ ...moved, t: 3.04 }, 4);
  const rows = history.csv().trimEnd().split('\n').slice(1);
  expect(rows.map((row) => row.split(',').slice(0, 5))).toEqual([
    ['0.00', '0.1', '0', '0.5', '1'],
    ['0.04', '0.1', '0', '0.5', '1'],
  ]);
});
