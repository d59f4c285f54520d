import { core } from './core';
import { HANGING, NOMINAL, plantNumbers } from './pendulum';
import type { Plant, State } from './pendulum';

const FASTEST = 150; // rad/s, 0.75 rad in a step

/// A point in the pendulum's plane: x to the right, z up, the pivot at 0 (m); or a force (N).
export interface Vec {
  x: number;
  z: number;
}

/// A force on the pendulum: on link 1 or 2, at `along` m from its hinge.
export interface Push {
  link: 1 | 2;
  along: number;
  force: Vec;
}

/// The double pendulum's physics.
export interface Simulator {
  state: State;
  /// A new plant leaves the state as it is.
  plant: Readonly<Plant>;
  /// Another pendulum of the same engine.
  another(): Simulator;
  /// One physics step, 0.005 s, under a torque (N·m) and perhaps a push. False if the state has blown
  /// up, or spins so fast that steps of this size do not follow it: then it hangs again.
  step(torque: number, push: Push | null): boolean;
}

/// Whether steps of this size follow the state.
export function isSound({ q1, q2, w1, w2 }: State): boolean {
  return Number.isFinite(q1 + q2) && Math.abs(w1) < FASTEST && Math.abs(w2) < FASTEST;
}

/// The pendulum's equations of motion in our own core (web/wasm/step.h), which is here long before MuJoCo.
export class ClosedForm implements Simulator {
  state: State = { ...HANGING };
  plant: Readonly<Plant> = { ...NOMINAL };

  another(): ClosedForm {
    return new ClosedForm();
  }

  step(torque: number, push: Push | null): boolean {
    const { q1, q2, w1, w2 } = this.state;
    const { link, along, force } = push ?? NONE;
    const before = [...plantNumbers(this.plant), q1, q2, w1, w2];
    const numbers = [...before, torque, link, along, force.x, force.z];
    const after = core().formula(numbers, core().exports.pendulum_step);
    const state = { q1: after[0]!, q2: after[1]!, w1: after[2]!, w2: after[3]! };
    const sound = isSound(state);
    this.state = sound ? state : { ...HANGING };
    return sound;
  }
}

const NONE = { link: 0, along: 0, force: { x: 0, z: 0 } };
