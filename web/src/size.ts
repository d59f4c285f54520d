import type { Parameter, Plant } from './pendulum';

/// The size of the pendulum. It is a double pendulum of one material: masses grow with size³, torques
/// with size⁴, times with √size. In its natural units it is therefore the same pendulum at every size
/// (src/pendulum/scale.h). The page's world, its policies and its controllers count in units of size
/// 1, whose links have 0.5 m. Only the physics (Simulator) and what the page shows are in SI units.

/// Units of the pendulum of a size, as multiples of those of size 1.
export class Units {
  readonly size: number;
  readonly time: number;

  constructor(size: number) {
    this.size = size;
    this.time = Math.sqrt(size);
  }

  get mass(): number {
    return this.size ** 3;
  }
  /// Of velocities of angles.
  get velocity(): number {
    return 1 / this.time;
  }
  get force(): number {
    return this.size ** 3;
  }
  /// The same for energies.
  get torque(): number {
    return this.size ** 4;
  }
  get damping(): number {
    return this.torque * this.time;
  }
  /// Of moments of inertia.
  get inertia(): number {
    return this.size ** 5;
  }

  /// The unit of a parameter of the plant.
  of(parameter: Parameter): number {
    switch (parameter) {
      case 'mass1':
      case 'mass2':
        return this.mass;
      case 'length1':
      case 'length2':
        return this.size;
      case 'damping1':
      case 'damping2':
        return this.damping;
      case 'torque_limit':
        return this.torque;
      case 'gravity':
        return 1;
    }
  }
}

/// The plant in SI units.
export function inSi(plant: Readonly<Plant>): Plant {
  const { size } = plant;
  if (size === 1) return { ...plant };
  const units = new Units(size);
  return {
    size,
    mass1: units.mass * plant.mass1,
    mass2: units.mass * plant.mass2,
    length1: size * plant.length1,
    length2: size * plant.length2,
    damping1: units.damping * plant.damping1,
    damping2: units.damping * plant.damping2,
    gravity: plant.gravity,
    torque_limit: units.torque * plant.torque_limit,
  };
}
