import { CONTROL_PERIOD } from './pendulum';
import type { Range, State } from './pendulum';

/// Errors of sensors and motor; 0: none. src/pendulum/sensors.h describes the last four.
export interface Disturbance {
  sensor_noise: number; // standard deviation, on each measured angle and velocity, rad and rad/s
  delay: number; // from the choice of a torque to its effect, in control periods
  sensor_latency: number; // age of the measured state, s
  encoder_counts: number; // per revolution
  velocity_window: number; // over which velocities are differences of angles, s
  velocity_filter: number; // time constant of their low-pass, s
}

export const PERFECT: Readonly<Disturbance> = {
  sensor_noise: 0,
  delay: 0,
  sensor_latency: 0,
  encoder_counts: 0,
  velocity_window: 0,
  velocity_filter: 0,
};

/// Allowed values, the same as in the program.
export const DISTURBANCE_LIMITS: Readonly<Record<keyof Disturbance, Range>> = {
  sensor_noise: [0, 10],
  delay: [0, Math.round(1 / CONTROL_PERIOD)], // up to 1 s
  sensor_latency: [0, 0.1],
  encoder_counts: [0, 1e9],
  velocity_window: [0, 0.1],
  velocity_filter: [0, 1],
};

/// A draw from the normal distribution (Box and Muller 1958).
function normal(): number {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}

/// Whether sensors show the present state, apart from noise.
export function exact(disturbance: Readonly<Disturbance>): boolean {
  const { sensor_latency, encoder_counts, velocity_window, velocity_filter } = disturbance;
  return sensor_latency + encoder_counts + velocity_window + velocity_filter === 0;
}

/// A state with the sensors' noise.
export function blurred(s: State, noise: number): State {
  if (noise === 0) return s;
  const blur = (x: number) => x + noise * normal();
  return { q1: blur(s.q1), q2: blur(s.q2), w1: blur(s.w1), w2: blur(s.w2) };
}

/// A motor with a delay of some control periods. It applies no torque until the first one arrives.
export class DelayLine {
  private underWay: number[] = [];

  clear(): void {
    this.underWay = [];
  }

  /// Takes the torque chosen now and returns the one that acts now. If the delay has become
  /// shorter, the oldest waiting torques are skipped.
  apply(torque: number, delay: number): number {
    this.underWay.push(torque);
    if (this.underWay.length <= delay) return 0;
    this.underWay = this.underWay.slice(this.underWay.length - 1 - delay);
    return this.underWay.shift()!;
  }
}
