import { core } from './core';
import { Fields } from './fields';
import { COORDINATES, HANGING, NOMINAL, PARAMETERS, STATE_FIELDS } from './pendulum';
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
  /// Changes the plant and keeps the state.
  plant: Readonly<Plant>;
  /// A new pendulum in the same engine.
  another(): Simulator;
  /// One physics step, 0.005 s, under a torque (N·m) and an optional push. Returns false and hangs
  /// the pendulum again if the state blew up or spins too fast for this step size.
  step(torque: number, push: Push | null): boolean;
}

/// Whether this step size is small enough for the state's velocities.
export function isSound({ q1, q2, w1, w2 }: State): boolean {
  return Number.isFinite(q1 + q2) && Math.abs(w1) < FASTEST && Math.abs(w2) < FASTEST;
}

/// The equations of motion in our own core (web/wasm/step.h), which loads long before MuJoCo.
export class ClosedForm implements Simulator {
  state: State = { ...HANGING };
  plant: Readonly<Plant> = { ...NOMINAL };

  another(): ClosedForm {
    return new ClosedForm();
  }

  step(torque: number, push: Push | null): boolean {
    const { link, along, force } = push ?? NONE;
    const { x, z } = force;
    const pushed = { torque, link, along, x, z };
    const numbers = PUSHED_FIELDS.numbers(this.plant, this.state, pushed);
    const state = STATE_FIELDS.object(core().formula(numbers, core().exports.pendulum_step));
    const sound = isSound(state);
    this.state = sound ? state : { ...HANGING };
    return sound;
  }
}

const PUSHED_NAMES = ['torque', 'link', 'along', 'x', 'z'] as const;
const PUSHED_FIELDS = new Fields('pushed', PARAMETERS, COORDINATES, PUSHED_NAMES);
const NONE = { link: 0, along: 0, force: { x: 0, z: 0 } };
