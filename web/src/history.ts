import type { Moment } from './world';

/// The last moments, oldest first.
export class History {
  private moments: Moment[] = [];
  private readonly seconds: number;

  constructor(seconds: number) {
    this.seconds = seconds;
  }

  add(moment: Moment): void {
    this.moments.push(moment);
    // Cut now and then, not at each step.
    const kept = this.from(moment.t - this.seconds);
    if (this.moments.length > 2 * kept.length) this.moments = kept;
  }

  /// Those from time t (s) on.
  from(t: number): Moment[] {
    const first = this.moments.findIndex((moment) => moment.t >= t);
    return first < 0 ? [] : this.moments.slice(first);
  }

  get last(): Moment | undefined {
    return this.moments.at(-1);
  }

  clear(): void {
    this.moments = [];
  }

  /// As `upswing simulate` writes it, to the last digit.
  csv(): string {
    const start = this.moments[0]?.t ?? 0;
    const rows = this.moments.map(({ t, state: { q1, q2, w1, w2 }, torque }) =>
      [(t - start).toFixed(2), q1, q2, w1, w2, torque].join(),
    );
    return ['t,qpos0,qpos1,qvel0,qvel1,torque', ...rows].join('\n') + '\n';
  }
}
