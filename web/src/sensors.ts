import { core } from './core';
import type { Disturbance } from './disturbance';
import type { State } from './pendulum';

/// Output of the sensors at a control step.
export interface Reading {
  state: State;
  torque: number; // N·m, during the last change of the velocities
  noise: number; // rad/s, standard deviation of that change by rounding
}

const forgotten = new FinalizationRegistry<() => void>((close) => close());

/// Encoders, computed velocities and latency of one pendulum, as in src/pendulum/sensors.h.
export class Sensors {
  private readonly at: number;

  constructor() {
    const { exports } = core();
    const at = exports.sensors_open();
    this.at = at;
    forgotten.register(this, () => exports.sensors_close(at));
  }

  /// Begins in a state, as if the joints had moved with its velocities before.
  begin({ q1, q2, w1, w2 }: State): void {
    core().formula([q1, q2, w1, w2], () => core().exports.sensors_begin(this.at));
  }

  /// Call at each control step, after a control period under this torque (N·m).
  measure({ q1, q2, w1, w2 }: State, before: number, model: Readonly<Disturbance>): Reading {
    const { sensor_latency, encoder_counts, velocity_window, velocity_filter } = model;
    const input = [q1, q2, w1, w2, before];
    input.push(sensor_latency, encoder_counts, velocity_window, velocity_filter);
    const [m1, m2, v1, v2, torque, noise] = core().formula(input, () =>
      core().exports.sensors_measure(this.at),
    ) as unknown as [number, number, number, number, number, number];
    return { state: { q1: m1, q2: m2, w1: v1, w2: v2 }, torque, noise };
  }
}
