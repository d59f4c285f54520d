import { core } from './core';
import type { Disturbance } from './disturbance';
import { Fields } from './fields';
import { COORDINATES, STATE_FIELDS } from './pendulum';
import type { State } from './pendulum';

/// Output of the sensors at a control step.
export interface Reading {
  state: State;
  torque: number; // N·m, during the last change of the velocities
  noise: number; // rad/s, standard deviation of that change by rounding
}

const MODEL = ['sensor_latency', 'encoder_counts', 'velocity_window', 'velocity_filter'] as const;
const SENSORS_FIELDS = new Fields('sensors', COORDINATES, ['torque'], MODEL);
const READING_FIELDS = new Fields('reading', COORDINATES, ['torque', 'noise']);

const forgotten = new FinalizationRegistry<() => void>((close) => close());

/// Encoders, computed velocities and latency of one pendulum, as in src/pendulum/sensors.h.
export class Sensors {
  private readonly at: number;

  /// `period`: of control, s.
  constructor(period: number) {
    const { exports } = core();
    const at = exports.sensors_open(period);
    this.at = at;
    forgotten.register(this, () => exports.sensors_close(at));
  }

  /// Begins in a state, as if the joints had moved with its velocities before.
  begin(state: State): void {
    core().formula(STATE_FIELDS.numbers(state), () => core().exports.sensors_begin(this.at));
  }

  /// Call at each control step, after a control period under this torque (N·m).
  measure(state: State, before: number, model: Readonly<Disturbance>): Reading {
    const numbers = SENSORS_FIELDS.numbers(state, { torque: before }, model);
    const { torque, noise, ...measured } = READING_FIELDS.object(
      core().formula(numbers, () => core().exports.sensors_measure(this.at)),
    );
    return { state: measured, torque, noise };
  }
}
