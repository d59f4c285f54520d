import type { Parameter, Plant } from './pendulum';

/// The size of the pendulum. It is a double pendulum of one material: masses grow with size³, torques
/// with size⁴, times with √size. In its natural units it is therefore the same pendulum at every size
/// (src/pendulum/scale.h). The page's world, its policies and its controllers count in units of size
/// 1, whose links have 0.5 m. Only the physics (Simulator) and what the page shows are in SI units.

/// The power of the size with which a parameter grows.
const POWERS: Readonly<Record<Parameter, number>> = {
  mass1: 3,
  mass2: 3,
  length1: 1,
  length2: 1,
  damping1: 4.5,
  damping2: 4.5,
  gravity: 0,
  torque_limit: 4,
};

/// Units of the pendulum of a size, as multiples of those of size 1.
export class Units {
  readonly size: number;
  readonly time: number;
  readonly velocity: number; // of angles
  readonly force: number;
  readonly torque: number; // and energy
  readonly inertia: number;

  constructor(size: number) {
    this.size = size;
    this.time = Math.sqrt(size);
    this.velocity = 1 / this.time;
    this.force = size ** 3;
    this.torque = size ** 4;
    this.inertia = size ** 5;
  }

  /// The unit of a parameter of the plant.
  of(parameter: Parameter): number {
    return this.size ** POWERS[parameter];
  }
}

/// The plant in SI units.
export function inSi(plant: Readonly<Plant>): Plant {
  const real = { ...plant };
  for (const name of Object.keys(POWERS) as Parameter[]) real[name] *= plant.size ** POWERS[name];
  return real;
}
