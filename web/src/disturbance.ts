import { CONTROL_PERIOD } from './pendulum';
import type { Range, State } from './pendulum';

/// Errors of sensors and motor; all zero: none.
export interface Disturbance {
  sensor_noise: number; // standard deviation, on each measured angle and velocity, rad and rad/s
  delay: number; // from the choice of a torque to its effect, in control periods
}

/// Allowed values, the same as in the program.
export const DISTURBANCE_LIMITS: Readonly<Record<keyof Disturbance, Range>> = {
  sensor_noise: [0, 10],
  delay: [0, Math.round(1 / CONTROL_PERIOD)], // up to 1 s
};

/// A draw from the normal distribution (Box and Muller 1958).
function normal(): number {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}

/// A state as the sensors measure it.
export function measure(s: State, noise: number): State {
  if (noise === 0) return s;
  const blur = (x: number) => x + noise * normal();
  return { q1: blur(s.q1), q2: blur(s.q2), w1: blur(s.w1), w2: blur(s.w2) };
}

/// A motor with a delay of some control periods; until the first torque arrives it applies none.
export class DelayLine {
  private underWay: number[] = [];

  clear(): void {
    this.underWay = [];
  }

  /// Takes the torque chosen now, gives the one that acts now. A shorter delay than before skips the
  /// oldest torques that wait.
  apply(torque: number, delay: number): number {
    this.underWay.push(torque);
    if (this.underWay.length <= delay) return 0;
    this.underWay = this.underWay.slice(this.underWay.length - 1 - delay);
    return this.underWay.shift()!;
  }
}
