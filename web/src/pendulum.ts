/// The double pendulum and its task as formulas, the same as sim/double_pendulum.cc: a test compares
/// them with vectors that the C++ program writes.
///
/// Symbols: q1, q2 joint angles (rad; both 0 hanging, q2 relative to link 1), w1, w2 their velocities
/// (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau torque at joint 1 (N·m).

export const CONTROL_PERIOD = 0.02; // s between two actions
export const PHYSICS_STEPS = 4; // in a control period
export const CAPSULE_RADIUS = 0.04; // of both links, m

/// What can be set at run time. The capsules keep their radius; inertia and centre of mass follow
/// mass and length.
export interface Plant {
  mass1: number; // kg
  mass2: number;
  length1: number; // m
  length2: number;
  damping1: number; // N·m·s/rad
  damping2: number;
  gravity: number; // m/s², along -z
  torque_limit: number; // N·m
}

export type Parameter = keyof Plant;

/// Smallest and largest value.
export type Range = readonly [number, number];

/// Allowed values, the same as in the program.
export const PLANT_LIMITS: Readonly<Record<Parameter, Range>> = {
  mass1: [0.01, 100],
  mass2: [0.01, 100],
  length1: [0.1, 10],
  length2: [0.1, 10],
  damping1: [0, 100],
  damping2: [0, 100],
  gravity: [0.01, 100],
  torque_limit: [0.01, 1000],
};

export const NOMINAL: Readonly<Plant> = {
  mass1: 1,
  mass2: 1,
  length1: 0.5,
  length2: 0.5,
  damping1: 0.2,
  damping2: 0.2,
  gravity: 9.81,
  torque_limit: 5,
};

export interface State {
  q1: number; // rad
  q2: number;
  w1: number; // rad/s
  w2: number;
}

export const HANGING: Readonly<State> = { q1: 0, q2: 0, w1: 0, w2: 0 };

/// Principal moments of inertia (kg·m²) of a solid capsule, across and along its axis: mass m (kg),
/// radius r (m), length l of its cylinder (m).
export function capsuleInertia(m: number, r: number, l: number) {
  // The mass is divided by volume between the cylinder and the two half spheres.
  const cylinder = Math.PI * r * r * l;
  const sphere = (4 / 3) * Math.PI * r * r * r;
  const mc = (m * cylinder) / (cylinder + sphere);
  const ms = m - mc;
  return {
    across:
      (mc * (3 * r * r + l * l)) / 12 + ms * ((2 * r * r) / 5 + (l * l) / 4 + (3 * l * r) / 8),
    along: (mc * r * r) / 2 + (ms * 2 * r * r) / 5,
  };
}

/// Mechanical energy (J), with thin-rod inertias m l²/12 and heights counted from the pivot.
export function energy(plant: Plant, { q1, q2, w1, w2 }: State): number {
  const { mass1: m1, mass2: m2, length1: l1, length2: l2, gravity: g } = plant;
  const I1 = (m1 * l1 * l1) / 12;
  const I2 = (m2 * l2 * l2) / 12;
  const w12 = w1 + w2; // absolute velocity of link 2
  const potential =
    -m1 * g * (l1 / 2) * Math.cos(q1) - m2 * g * (l1 * Math.cos(q1) + (l2 / 2) * Math.cos(q1 + q2));
  const v1Squared = (l1 / 2) * (l1 / 2) * w1 * w1; // of link 1's centre
  const v2Squared =
    l1 * l1 * w1 * w1 + (l2 / 2) * (l2 / 2) * w12 * w12 + l1 * l2 * Math.cos(q2) * w1 * w12;
  return 0.5 * (I1 * w1 * w1 + I2 * w12 * w12 + m1 * v1Squared + m2 * v2Squared) + potential;
}

/// Energy at rest upright (J); hanging at rest it is the negative of this.
export function energyTarget(plant: Plant): number {
  const { mass1: m1, mass2: m2, length1: l1, length2: l2, gravity: g } = plant;
  return (m1 * g * l1) / 2 + m2 * g * (l1 + l2 / 2);
}

/// Energy mapped so that hanging at rest is 0 and upright at rest is 1.
export function normalizedEnergy(plant: Plant, s: State): number {
  const target = energyTarget(plant);
  return (energy(plant, s) + target) / (2 * target);
}

/// Height of the second link's tip over the pivot (m).
export function tipHeight(plant: Plant, s: State): number {
  return -plant.length1 * Math.cos(s.q1) - plant.length2 * Math.cos(s.q1 + s.q2);
}

/// The same over l1 + l2: -1 hanging, 1 upright.
export function relativeHeight(plant: Plant, s: State): number {
  return tipHeight(plant, s) / (plant.length1 + plant.length2);
}

/// Both links within 30° of straight up; the second by its absolute angle q1 + q2.
export function inverted({ q1, q2 }: State): boolean {
  const cos30 = Math.sqrt(3) / 2;
  return -Math.cos(q1) >= cos30 && -Math.cos(q1 + q2) >= cos30;
}

export const OBSERVATION_SIZE = 8;
/// Heuristic largest velocities (rad/s), by which the observation divides.
export const MAX_VELOCITY: readonly [number, number] = [10, 20];

/// [cos q1, sin q1, w1/10, cos q2, sin q2, w2/20, Ê, ĥ] with Ê = normalizedEnergy and ĥ =
/// relativeHeight.
export function observe(plant: Plant, s: State): Float32Array {
  return Float32Array.of(
    Math.cos(s.q1),
    Math.sin(s.q1),
    s.w1 / MAX_VELOCITY[0],
    Math.cos(s.q2),
    Math.sin(s.q2),
    s.w2 / MAX_VELOCITY[1],
    normalizedEnergy(plant, s),
    relativeHeight(plant, s),
  );
}

/// The reward's five terms for being in state s under torque tau, signed, so that their sum is the
/// reward: energy, height, balance, velocity penalty, torque penalty.
export function rewardTerms(plant: Plant, s: State, tau: number): number[] {
  const up = inverted(s);
  return [
    Math.min(Math.max(normalizedEnergy(plant, s), 0), 1.5),
    (relativeHeight(plant, s) + 1) / 2,
    up ? 5 : 0,
    up ? -0.01 * (s.w1 * s.w1 + s.w2 * s.w2) : 0,
    (up ? -0.05 : -0.01) * tau * tau,
  ];
}

/// The model as MJCF, with the plant's numbers to the last digit. Nothing touches and nothing is
/// constrained: without these stages a step takes less time and the trajectory is the same.
export function mjcf(plant: Plant): string {
  return `<mujoco model="double_pendulum">
  <option gravity="0 0 -${plant.gravity}" timestep="0.005" integrator="RK4">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="link1">
      <joint name="joint1" type="hinge" axis="0 1 0" damping="${plant.damping1}" armature="0.01"/>
      <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -${plant.length1}" mass="${plant.mass1}"/>
      <body name="link2" pos="0 0 -${plant.length1}">
        <joint name="joint2" type="hinge" axis="0 1 0" damping="${plant.damping2}" armature="0.01"/>
        <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -${plant.length2}" mass="${plant.mass2}"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="torque1" joint="joint1" ctrllimited="true" ctrlrange="-${plant.torque_limit} ${plant.torque_limit}"/>
  </actuator>
</mujoco>
`;
}
