import type { Units } from '../size';
import { withMinus } from '../text';
import type { Moment } from '../world';
import { Canvas } from './canvas';

export const SECONDS_SHOWN = 10; // at size 1
const MOST_POINTS = 1000; // of a line
const TIMES = 16; // pixels, for the ends of the axis of time

interface StripScale {
  low: number;
  high: number;
  target?: number; // a line to reach
  unit?: string; // of its numbers
  mean?: number; // moments; draws their mean in front of fast changes
  labels: readonly (readonly [number, string])[];
}

/// One quantity over the last ten seconds.
export class Strip {
  readonly canvas: Canvas;
  private readonly color: string;
  private readonly value: (moment: Moment) => number;

  constructor(id: string, color: string, value: (moment: Moment) => number) {
    this.canvas = new Canvas(id);
    this.color = color;
    this.value = value;
  }

  draw(all: readonly Moment[], now: number, units: Units, scale: StripScale): void {
    const { canvas, value } = this;
    if (!canvas.shown) return;
    const moments = thinned(all);
    canvas.clear();
    const left = 34;
    const y = (v: number) =>
      6 + ((canvas.height - 6 - TIMES) * (scale.high - v)) / (scale.high - scale.low);
    const x = (t: number) =>
      canvas.width - ((now - t) / SECONDS_SHOWN) * (canvas.width - left - 2) - 2;
    for (const [v, label] of scale.labels) {
      canvas.text(label, left - 5, y(v), 'right');
      canvas.line(
        [
          [left, y(v)],
          [canvas.width, y(v)],
        ],
        'grid',
        1,
      );
    }
    if (scale.target !== undefined) {
      canvas.context.setLineDash([5, 4]);
      canvas.line(
        [
          [left, y(scale.target)],
          [canvas.width, y(scale.target)],
        ],
        'good',
        1.5,
      );
      canvas.context.setLineDash([]);
    }
    canvas.text(`${signed(units.time * SECONDS_SHOWN)} s ago`, left, canvas.height - 6);
    canvas.text('now', canvas.width - 2, canvas.height - 6, 'right');
    if (scale.unit) canvas.text(scale.unit, left - 5, y(scale.high / 2), 'right');
    const values = moments.map((m) => Math.min(Math.max(value(m), scale.low), scale.high));
    const draw = (of: number[], width: number) =>
      canvas.line(
        of.map((v, i) => [x(moments[i]!.t), y(v)]),
        this.color,
        width,
      );
    if (scale.mean === undefined) return draw(values, 2);
    canvas.context.globalAlpha = 0.35;
    draw(values, 1);
    canvas.context.globalAlpha = 1;
    draw(runningMean(values, scale.mean), 2.5);
  }
}

/// Every n-th moment, so that at most MOST_POINTS are left.
function thinned(moments: readonly Moment[]): readonly Moment[] {
  const n = Math.ceil(moments.length / MOST_POINTS);
  return n <= 1 ? moments : moments.filter((_, i) => (moments.length - 1 - i) % n === 0);
}

/// The mean of each value and the values before it, `count` in all.
function runningMean(values: number[], count: number): number[] {
  let sum = 0;
  return values.map((value, i) => {
    sum += value - (i >= count ? values[i - count]! : 0);
    return sum / Math.min(i + 1, count);
  });
}

/// Velocity over angle of both links; upright in the middle.
export class PhasePortrait {
  readonly canvas = new Canvas('phase');

  draw(all: readonly Moment[], units: Units): void {
    const { canvas } = this;
    if (!canvas.shown) return;
    const moments = thinned(all);
    canvas.clear();
    const [cx, cy] = [canvas.width / 2, canvas.height / 2];
    const x = (angle: number) => cx + (angle / Math.PI) * (cx - 4);
    const fastest = 12; // rad/s, at size 1
    const y = (w: number) => cy - (Math.min(Math.max(w, -fastest), fastest) / fastest) * (cy - 10);
    canvas.line(
      [
        [0, cy],
        [canvas.width, cy],
      ],
      'grid',
      1,
    );
    canvas.line(
      [
        [cx, 0],
        [cx, canvas.height - 14],
      ],
      'grid',
      1,
    );
    canvas.text('angle −180°', 2, canvas.height - 6);
    canvas.text('upright', cx, canvas.height - 6, 'center');
    canvas.text('180°', canvas.width - 2, canvas.height - 6, 'right');
    canvas.text(`velocity ${signed(units.velocity * fastest)} rad/s`, cx + 4, 8);
    for (const [color, angleOf, rateOf] of LINKS) {
      let piece: [number, number][] = [];
      for (const { state } of moments) {
        const next: [number, number] = [x(fromUpright(angleOf(state))), y(rateOf(state))];
        const previous = piece.at(-1);
        if (previous && Math.abs(next[0] - previous[0]) > cx) {
          canvas.line(piece, color); // over the edge: continue at the other side
          piece = [];
        }
        piece.push(next);
      }
      canvas.line(piece, color);
      const last = piece.at(-1);
      if (last) canvas.disc(last[0], last[1], 4, color);
    }
  }
}

type Of = (state: Moment['state']) => number;
const LINKS: readonly [string, Of, Of][] = [
  ['link1', (s) => s.q1, (s) => s.w1],
  ['link2', (s) => s.q1 + s.q2, (s) => s.w1 + s.w2],
];

/// An absolute angle relative to upright, in ±π.
function fromUpright(angle: number): number {
  const turns = (angle + Math.PI) / (2 * Math.PI);
  return (turns - Math.round(turns)) * 2 * Math.PI;
}

/// Three significant digits.
export function signed(value: number): string {
  return withMinus(String(Number(value.toPrecision(3))));
}

export interface Curve {
  step: number[];
  success_rate: number[];
  mean_return: number[];
}

/// Share of evaluation episodes that succeeded, over the steps of training.
export class LearningCurve {
  readonly canvas = new Canvas('curve');

  draw(curve: Curve | null): void {
    const { canvas } = this;
    canvas.clear();
    if (!curve) {
      canvas.text('no learning curve in this file', canvas.width / 2, canvas.height / 2, 'center');
      return;
    }
    const left = 38;
    const bottom = canvas.height - 16;
    const last = curve.step.at(-1) ?? 1;
    const x = (step: number) => left + (step / last) * (canvas.width - left - 6);
    const y = (share: number) => 6 + (bottom - 6) * (1 - share);
    for (const share of [0, 0.5, 1]) {
      canvas.text(`${100 * share}%`, left - 5, y(share), 'right');
      canvas.line(
        [
          [left, y(share)],
          [canvas.width, y(share)],
        ],
        'grid',
        1,
      );
    }
    canvas.text('0', left, canvas.height - 6);
    canvas.text(`${last.toLocaleString('en')} steps`, canvas.width - 2, canvas.height - 6, 'right');
    canvas.line(
      [
        [x(0), y(0)],
        ...curve.step.map((s, i): [number, number] => [x(s), y(curve.success_rate[i]!)]),
      ],
      'link1',
      2,
    );
  }
}
