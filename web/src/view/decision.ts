import type {
  CategoricalDecision,
  ComputedDecision,
  Decision,
  GaussianDecision,
  QDecision,
} from '../decision';
import { roundBelow } from '../quantity';
import type { Shown } from '../quantity';
import { Canvas } from './canvas';
import { signed } from './charts';

const LABEL_WIDTH = 30; // pixels, of a torque under its bar
const BOTTOM = 16; // pixels, for the torques below a chart
const NAME = 13; // pixels, for the name of their axis
const ROOMY = 90; // pixels of height that leave room for that name
const TOP = 4;
const SCALE = 38; // pixels, for the costs next to Q-values
const CUT_OFF = 0.005; // smallest share that gets a number
const EASE = 0.2; // share of the way to a bar's new height, at each drawing

/// Chart of a decision: Q-values, or the torque's distribution.
export class DecisionChart {
  readonly canvas = new Canvas('q');
  private below = 0; // pixels for the name of the axis
  private room = 1; // points of reward, from the best Q-value to the bottom of the chart
  private shown: Shown = { factor: 1, unit: 'N·m' }; // of torques
  private bars: number[] = []; // heights as drawn, in units of their values

  /// A Q-value is `rewardScale` times a reward. `shown`: unit of the torques.
  draw(decision: Decision | null, rewardScale: number, shown: Shown): void {
    this.shown = shown;
    this.canvas.clear();
    if (!decision) return;
    this.nameAxis();
    if (!isFinite(decision)) {
      this.canvas.text('not finite', this.canvas.width / 2, this.canvas.height / 2, 'center');
      return; // keeps the scale
    }
    if (decision.kind === 'q') this.drawQ(decision, rewardScale);
    else if (decision.kind === 'gaussian') this.drawGaussian(decision);
    else if (decision.kind === 'categorical') this.drawProbabilities(decision);
    else this.drawComputed(decision);
  }

  /// Names the axis of torques if there is room, and leaves the rest of the canvas to the chart.
  private nameAxis(): void {
    const { canvas } = this;
    this.below = canvas.height < ROOMY ? 0 : NAME;
    const name = `torque, ${this.shown.unit}`;
    if (this.below > 0) canvas.text(name, canvas.width / 2, canvas.height - 6, 'center');
  }

  private inUnit(torque: number): string {
    return signed(this.shown.factor * torque);
  }

  private get bottom(): number {
    return this.canvas.height - BOTTOM - this.below;
  }

  /// Q-values differ little compared with their size. So the chart shows only the upper ends of the
  /// bars: the tallest reaches the top, and each other one is lower by the reward that it costs.
  private drawQ({ q, action, torques }: QDecision, rewardScale: number): void {
    const { canvas, bottom } = this;
    const cost = (i: number) => (q[action]! - q[i]!) / rewardScale;
    // The scale grows at once and shrinks slowly.
    const most = 1.1 * Math.max(...torques.map((_, i) => cost(i)));
    this.room = Math.max(most, 0.1, 0.95 * this.room);
    const y = (points: number) => TOP + 2 + (points / this.room) * (bottom - TOP - 2);
    const round = roundBelow(0.9 * this.room);
    for (const points of [0, round]) {
      const ends: [number, number][] = [
        [SCALE, y(points)],
        [canvas.width, y(points)],
      ];
      canvas.line(ends, 'grid', 1);
    }
    canvas.text('best', SCALE - 4, y(0) + 3, 'right');
    canvas.text(signed(-round), SCALE - 4, y(round), 'right');
    this.drawBars(
      torques,
      SCALE,
      (i) => -cost(i),
      (value, most) => {
        const top = y(most - value);
        return [top, bottom - top];
      },
    );
  }

  /// Bars from 0 to 1.
  private drawProbabilities({ probabilities, torques }: CategoricalDecision): void {
    const { bottom } = this;
    const height = (share: number) => (bottom - TOP) * share;
    const box = (share: number) => [bottom - height(share), height(share)] as const;
    this.drawBars(torques, 0, (i) => probabilities[i]!, box);
  }

  /// Bars from `left` on, each with its torque, the tallest in colour: the agent takes it. `box`: top
  /// and height (pixels) of a value, given the largest one.
  private drawBars(
    torques: Float64Array,
    left: number,
    value: (i: number) => number,
    box: (value: number, most: number) => readonly [number, number],
  ): void {
    const { canvas, bottom } = this;
    const width = (canvas.width - left) / torques.length;
    const labelled = Math.ceil(LABEL_WIDTH / width); // labels every N-th bar
    if (this.bars.length !== torques.length) {
      this.bars = Array.from(torques, (_, i) => value(i));
    }
    // Eased, because the agent chooses 50 times a second.
    this.bars = this.bars.map((bar, i) => bar + EASE * (value(i) - bar));
    const most = Math.max(...this.bars);
    torques.forEach((torque, i) => {
      const bar = this.bars[i]!;
      const [top, height] = box(bar, most);
      const place = [left + i * width + 2.5, top, width - 5, height] as const;
      canvas.rectangle(...place, bar === most ? 'torque' : 'bar');
      canvas.context.strokeStyle = canvas.color('grid');
      canvas.context.lineWidth = 1;
      canvas.context.strokeRect(...place);
      if (i % labelled === 0) {
        canvas.text(this.inUnit(torque), left + (i + 0.5) * width, bottom + 9, 'center');
      }
    });
  }

  /// The density over the torques, as high as the chart; its central 68% in colour, and a line at
  /// the mean, which is applied.
  private drawGaussian({ limit, low, high, torque, probabilities }: GaussianDecision): void {
    const { canvas, bottom } = this;
    const { left, right, x } = this.axis(limit);
    const pieces = Math.max(1, Math.round((right - left) / 2));
    const shares = probabilities(pieces);
    const density = shares.subarray(1, -1);
    const top = Math.max(...density);
    const points = Array.from(density, (value, i): [number, number] => [
      left + ((i + 0.5) / pieces) * (right - left),
      bottom - (top > 0 ? value / top : 0) * (bottom - TOP),
    ]);
    const within = points.filter(([at]) => at >= x(low) - 1 && at <= x(high) + 1);
    if (within.length > 1) canvas.area(within, bottom, 'spread');
    canvas.line(points, 'edge');
    this.drawLine(x(torque));
    this.writeCutOff(shares[0]!, shares.at(-1)!, left, right);
  }

  /// A bar from 0 to the torque.
  private drawComputed({ torque, limit }: ComputedDecision): void {
    const { x } = this.axis(limit);
    const [from, to] = [Math.min(x(0), x(torque)), Math.max(x(0), x(torque))];
    this.canvas.rectangle(from, TOP, to - from, this.bottom - TOP, 'bar');
    this.drawLine(x(torque));
  }

  /// The torques from -limit to limit, and their places on the canvas.
  private axis(limit: number) {
    const { canvas, bottom } = this;
    const [left, right] = [10, canvas.width - 10];
    const x = (torque: number) => left + ((torque + limit) / (2 * limit)) * (right - left);
    canvas.line(
      [
        [left, bottom],
        [right, bottom],
      ],
      'grid',
      1,
    );
    for (const torque of [-limit, 0, limit]) {
      const name = this.inUnit(torque);
      canvas.context.font = canvas.font('12px'); // as of Canvas.text()
      const half = canvas.context.measureText(name).width / 2;
      const middle = Math.min(Math.max(x(torque), half), canvas.width - half);
      canvas.text(name, middle, bottom + 9, 'center');
    }
    return { left, right, x };
  }

  /// At the torque that is applied.
  private drawLine(at: number): void {
    this.canvas.line(
      [
        [at, TOP],
        [at, this.bottom],
      ],
      'torque',
      2.5,
    );
  }

  /// The probabilities of more than the limit, at both ends.
  private writeCutOff(low: number, high: number, left: number, right: number): void {
    const percent = (share: number) => `${Math.round(100 * share)}%`;
    if (low >= CUT_OFF) this.canvas.text(percent(low), left - 8, 10, 'left');
    if (high >= CUT_OFF) this.canvas.text(percent(high), right + 8, 10, 'right');
  }
}

function isFinite(decision: Decision): boolean {
  if (decision.kind === 'q') return decision.q.every(Number.isFinite);
  if (decision.kind === 'categorical') return decision.probabilities.every(Number.isFinite);
  if (decision.kind === 'computed') return Number.isFinite(decision.torque);
  return Number.isFinite(decision.low + decision.high);
}
