import { core } from './core';
import { Fields } from './fields';
import { COORDINATES, PLANT_FIELDS, STATE_FIELDS } from './pendulum';
import type { Plant, State } from './pendulum';

const IDENTIFIER_FIELDS = new Fields('identifier', COORDINATES, ['torque', 'noise']);
export const IDENTIFIED_FIELDS = new Fields('identified', ['identified']);

const forgotten = new FinalizationRegistry<() => void>((close) => close());

/// Estimates an unknown plant from its motion, as src/pendulum/identification.h.
export class Identifier {
  private readonly at: number;

  /// `period`: of control, s.
  constructor(nominal: Plant, period: number) {
    const { exports } = core();
    let at = 0;
    core().formula(PLANT_FIELDS.numbers(nominal), () => {
      at = exports.identifier_open(period);
    });
    this.at = at;
    forgotten.register(this, () => exports.identifier_close(at));
  }

  /// Forgets everything about the plant.
  begin(measured: State): void {
    core().formula(STATE_FIELDS.numbers(measured), () => core().exports.identifier_begin(this.at));
  }

  /// Call after a control period under `torque` (N·m). `noise`: of the sensors.
  update(measured: State, torque: number, noise: number): void {
    const numbers = IDENTIFIER_FIELDS.numbers(measured, { torque, noise });
    core().formula(numbers, () => core().exports.identifier_update(this.at));
  }

  /// The numbers that identification adds to the observation of a state.
  observe(state: State): Float64Array {
    const observed = core().formula(STATE_FIELDS.numbers(state), () =>
      core().exports.identifier_observe(this.at),
    );
    return IDENTIFIED_FIELDS.readAll(observed, 'identified').slice();
  }
}
