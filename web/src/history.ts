import { STEPS_PER_SECOND } from './world';
import type { Moment } from './world';

// Half a physics step of margin, so that rounding does not decide about a moment on the edge.
const MARGIN = 0.5 / STEPS_PER_SECOND; // s

/// The last moments, oldest first.
export class History {
  private moments: Moment[] = [];
  private first = 0; // index of the oldest moment that is kept
  private readonly seconds: number;

  constructor(seconds: number) {
    this.seconds = seconds;
  }

  add(moment: Moment): void {
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
  }

  /// CSV as `upswing simulate` writes it, with all digits; time starts at 0.
  csv(): string {
    const kept = this.moments.slice(this.first);
    const start = kept[0]?.t ?? 0;
    const rows = kept.map(({ t, state: { q1, q2, w1, w2 }, torque }) =>
      [(t - start).toFixed(2), q1, q2, w1, w2, torque].join(),
    );
    return ['t,qpos0,qpos1,qvel0,qvel1,torque', ...rows].join('\n') + '\n';
  }
}
