import { core } from './core';

/// The double pendulum and its task as formulas: those of src/pendulum/task.cc, in the core. Its
/// constants, which a test compares with the program's, are needed before there is a core.
///
/// Symbols: q1, q2 joint angles (rad; both 0 hanging, q2 relative to link 1), w1, w2 their velocities
/// (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau torque at joint 1 (N·m).

export const CONTROL_PERIOD = 0.02; // s between two actions
export const PHYSICS_STEPS = 4; // in a control period
export const CAPSULE_RADIUS = 0.04; // of both links, m

/// The plant's parameters. The capsules keep their radius; inertia and centre of mass follow mass
/// and length.
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

/// In the core's order.
const PARAMETERS = [
  'mass1',
  'mass2',
  'length1',
  'length2',
  'damping1',
  'damping2',
  'gravity',
  'torque_limit',
] as const satisfies readonly Parameter[];

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

/// A pose at rest that a policy for any pose can reach, by its name in the program: which links
/// point up.
export interface Goal {
  name: GoalName;
  up1: boolean;
  up2: boolean;
}

export type GoalName = 'up-up' | 'up-down' | 'down-up' | 'down-down';

export const GOALS: Readonly<Record<GoalName, Goal>> = {
  'up-up': { name: 'up-up', up1: true, up2: true },
  'up-down': { name: 'up-down', up1: true, up2: false },
  'down-up': { name: 'down-up', up1: false, up2: true },
  'down-down': { name: 'down-down', up1: false, up2: false },
};

/// A goal in an observation: for each link 1 for up and -1 for down. Zeros for null, which is
/// upright for a policy without a choice.
export function goalNumbers(goal: Goal | null): [number, number] {
  const sign = (up: boolean) => (up ? 1 : -1);
  return goal ? [sign(goal.up1), sign(goal.up2)] : [0, 0];
}

/// Rest in the goal.
export function restIn(goal: Goal | null): State {
  const { up1, up2 } = goal ?? GOALS['up-up'];
  const [q1, q12] = [up1, up2].map((up) => (up ? Math.PI : 0)) as [number, number];
  return { q1, q2: q12 - q1, w1: 0, w2: 0 };
}

/// Principal moments of inertia (kg·m²) of a solid capsule, across and along its axis: mass m (kg),
/// radius r (m), length l of its cylinder (m).
export function capsuleInertia(m: number, r: number, l: number) {
  const [across, along] = core().formula([m, r, l], core().exports.capsule_inertia);
  return { across: across!, along: along! };
}

/// All the core's numbers about a state under a torque, in its order (web/wasm/api.cc). A call
/// takes 3 µs, a tenth of a policy's decision, so one call for all is cheap enough.
function at(
  plant: Plant,
  { q1, q2, w1, w2 }: State,
  torque = 0,
  goal: Goal | null = null,
): Float64Array {
  const numbers = [...plantNumbers(plant), q1, q2, w1, w2, torque, ...goalNumbers(goal)];
  return core().formula(numbers, core().exports.pendulum_at);
}

/// The plant's parameters of an object with more keys.
export function plantIn(given: Plant): Plant {
  return Object.fromEntries(PARAMETERS.map((name) => [name, given[name]])) as unknown as Plant;
}

/// In the core's order.
export function plantNumbers(plant: Plant): number[] {
  return PARAMETERS.map((name) => plant[name]);
}

/// Mechanical energy (J), with thin-rod inertias m l²/12 and heights counted from the pivot.
export function energy(plant: Plant, s: State): number {
  return at(plant, s)[8]!;
}

/// Energy mapped so that hanging at rest is 0 and upright at rest is 1.
export function normalizedEnergy(plant: Plant, s: State): number {
  return at(plant, s)[10]!;
}

/// Height of the second link's tip over the pivot (m).
export function tipHeight(plant: Plant, s: State): number {
  return at(plant, s)[11]!;
}

/// tipHeight over l1 + l2, as in the observation: -1 hanging, 1 upright.
export function relativeHeight(plant: Plant, s: State): number {
  return at(plant, s)[7]!;
}

/// Both links within 30° of the goal's directions; the second by its absolute angle q1 + q2.
export function inverted(s: State, goal: Goal | null = null): boolean {
  return at(NOMINAL, s, 0, goal)[12] === 1;
}

export const OBSERVATION_SIZE = 8;
/// [cos q1, sin q1, w1/10, cos q2, sin q2, w2/20, Ê, ĥ] with Ê = normalizedEnergy and ĥ =
/// relativeHeight.
export function observe(plant: Plant, s: State): Float32Array {
  return Float32Array.from(at(plant, s).subarray(0, OBSERVATION_SIZE));
}

/// Writes the memory of `steps` control steps into the end of `observation`. `before` is the
/// observation one step earlier, when `torque` (N·m) was chosen.
export function remember(
  before: Float32Array,
  torque: number,
  steps: number,
  observation: Float32Array,
): Float32Array {
  const { length: size, byteLength } = observation;
  const both = new Float32Array(2 * size);
  both.set(before);
  both.set(observation, size);
  return core().withBytes(new Uint8Array(both.buffer), (at) => {
    const { exports } = core();
    exports.observation_remember(at, torque, steps, at + byteLength, size);
    return new Float32Array(exports.memory.buffer, at + byteLength, size).slice();
  });
}

/// The reward's five terms for being in state s under torque tau, signed, so that their sum is the
/// reward: energy, height, balance, velocity penalty, torque penalty. `goal` null: for a policy
/// without a choice, whose energy counts beyond that of upright.
export function rewardTerms(
  plant: Plant,
  s: State,
  tau: number,
  goal: Goal | null = null,
): number[] {
  return [...at(plant, s, tau, goal).subarray(13, 18)];
}

/// Why the physics is not stable for a plant; empty if it is.
export function plantProblem(plant: Plant): string {
  let stable = 0;
  core().formula(plantNumbers(plant), () => (stable = core().exports.pendulum_check()));
  return stable === 0 ? core().text : '';
}

/// The model as MJCF, with all digits of the plant's numbers. Contacts and constraints are off: a
/// step takes less time and the trajectory is the same.
export function mjcf(plant: Plant): string {
  core().formula(plantNumbers(plant), core().exports.pendulum_mjcf);
  return core().text;
}
