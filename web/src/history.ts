import { Units } from './size';
import type { Moment } from './world';

// So that rounding does not decide about a moment on the edge.
const MARGIN = 1e-6; // s
const DECIMALS = [2, 3, 4, 5] as const; // of times in a file; see decimalsFor()

/// The last moments, oldest first.
export class History {
  private moments: Moment[] = [];
  private first = 0; // index of the oldest moment that is kept
  private readonly seconds: number;
  private size = 1; // of the pendulum
  private sizedAt = -Infinity; // when it got this size, s

  constructor(seconds: number) {
    this.seconds = seconds;
  }

  add(moment: Moment, size = 1): void {
    if (size !== this.size) this.sizedAt = moment.t;
    this.size = size;
    this.moments.push(moment);
    while (this.moments[this.first]!.t < moment.t - this.seconds - MARGIN) ++this.first;
    // Removes old moments in bulk, not at each step.
    if (this.first < 1000) return;
    this.moments = this.moments.slice(this.first);
    this.first = 0;
  }

  /// The moments from time t (s) on, inclusive.
  from(t: number): Moment[] {
    let first = this.moments.length;
    while (first > this.first && this.moments[first - 1]!.t >= t - MARGIN) --first;
    return this.moments.slice(first);
  }

  get last(): Moment | undefined {
    return this.moments.at(-1);
  }

  clear(): void {
    this.moments = [];
    this.first = 0;
    this.sizedAt = -Infinity;
  }

  /// CSV of the moments at this size, as `upswing simulate` writes it, in SI units and with all
  /// digits; time starts at 0.
  csv(): string {
    const units = new Units(this.size);
    const kept = this.from(this.sizedAt);
    const times = kept.map(({ t }) => units.time * (t - kept[0]!.t));
    const decimals = decimalsFor(times);
    const { torque: newtonMetres, velocity } = units;
    const rows = kept.map(({ state: { q1, q2, w1, w2 }, torque }, i) =>
      [
        times[i]!.toFixed(decimals),
        ...[q1, q2, velocity * w1, velocity * w2, newtonMetres * torque],
      ].join(),
    );
    return ['t,q1,q2,w1,w2,torque', ...rows].join('\n') + '\n';
  }
}

/// The fewest decimals that times need; 6 where none are enough.
function decimalsFor(times: readonly number[]): number {
  const fits = (decimals: number) =>
    times.every((t) => Math.abs(Number(t.toFixed(decimals)) - t) < MARGIN);
  return DECIMALS.find(fits) ?? 6;
}
