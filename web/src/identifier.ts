import { core } from './core';
import { plantNumbers } from './pendulum';
import type { Plant, State } from './pendulum';

const SIZE = 13; // numbers that identification adds to an observation

function numbers({ q1, q2, w1, w2 }: State): number[] {
  return [q1, q2, w1, w2];
}

const forgotten = new FinalizationRegistry<() => void>((close) => close());

/// Estimates an unknown plant from its motion, as src/pendulum/identification.h.
export class Identifier {
  private readonly at: number;

  constructor(nominal: Plant) {
    const { exports } = core();
    let at = 0;
    core().formula(plantNumbers(nominal), () => {
      at = exports.identifier_open();
    });
    this.at = at;
    forgotten.register(this, () => exports.identifier_close(at));
  }

  /// Forgets everything about the plant.
  begin(measured: State): void {
    core().formula(numbers(measured), () => core().exports.identifier_begin(this.at));
  }

  /// Call after a control period under `torque` (N·m). `noise`: of the sensors.
  update(measured: State, torque: number, noise: number): void {
    core().formula([...numbers(measured), torque, noise], () =>
      core().exports.identifier_update(this.at),
    );
  }

  /// The numbers that identification adds to the observation of a state.
  observe(state: State): Float64Array {
    return core()
      .formula(numbers(state), () => core().exports.identifier_observe(this.at))
      .slice(0, SIZE);
  }
}
