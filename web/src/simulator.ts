import { core } from './core';
import { Fields } from './fields';
import { COORDINATES, HANGING, NOMINAL, PLANT_NAMES, STATE_FIELDS } from './pendulum';
import type { Plant, State } from './pendulum';
import { inSi, Units } from './size';

const FASTEST = 0.75; // rad in a step

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

/// The double pendulum's physics. It computes in SI units; everything here is in units of size 1
/// (size.ts).
export interface Simulator {
  state: State;
  /// Changes the plant and keeps the state.
  plant: Readonly<Plant>;
  /// A new pendulum in the same engine.
  another(): Simulator;
  /// One physics step of `seconds` under a torque (N·m) and an optional push. Returns false and
  /// hangs the pendulum again if the state blew up or spins too fast for this step size.
  step(torque: number, push: Push | null, seconds: number): boolean;
}

/// Whether steps of `seconds` are short enough for the state's velocities.
export function isSound({ q1, q2, w1, w2 }: State, seconds: number): boolean {
  const fastest = FASTEST / seconds; // rad/s
  return Number.isFinite(q1 + q2) && Math.abs(w1) < fastest && Math.abs(w2) < fastest;
}

/// The state with velocities in another unit.
export function withVelocities({ q1, q2, w1, w2 }: State, factor: number): State {
  return { q1, q2, w1: factor * w1, w2: factor * w2 };
}

/// The equations of motion in our own core (web/wasm/step.h), which loads long before MuJoCo.
export class ClosedForm implements Simulator {
  state: State = { ...HANGING };
  private _plant: Readonly<Plant> = { ...NOMINAL };
  private real: Readonly<Plant> = inSi(NOMINAL); // the plant in SI units
  private units = new Units(1);

  get plant(): Readonly<Plant> {
    return this._plant;
  }
  set plant(plant: Readonly<Plant>) {
    this._plant = { ...plant };
    this.real = inSi(plant);
    this.units = new Units(plant.size);
  }

  another(): ClosedForm {
    return new ClosedForm();
  }

  step(torque: number, push: Push | null, seconds: number): boolean {
    const { link, along, force } = push ?? NONE;
    const { real, units } = this;
    const pushed = {
      torque: units.torque * torque,
      timestep: units.time * seconds,
      link,
      along: units.size * along,
      x: units.force * force.x,
      z: units.force * force.z,
    };
    const start = withVelocities(this.state, units.velocity);
    const numbers = PUSHED_FIELDS.numbers(real, start, pushed);
    const end = STATE_FIELDS.object(core().formula(numbers, core().exports.pendulum_step));
    const state = withVelocities(end, units.time);
    const sound = isSound(state, seconds);
    this.state = sound ? state : { ...HANGING };
    return sound;
  }
}

const PUSHED_NAMES = ['torque', 'timestep', 'link', 'along', 'x', 'z'] as const;
const PUSHED_FIELDS = new Fields('pushed', PLANT_NAMES, COORDINATES, PUSHED_NAMES);
const NONE = { link: 0, along: 0, force: { x: 0, z: 0 } };
