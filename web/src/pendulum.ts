import { core } from './core';
import { Fields } from './fields';

/// The double pendulum and its task as formulas: those of src/pendulum/task.cc, in the core. Its
/// constants, which a test compares with the program's, are needed before there is a core.
///
/// Symbols: q1, q2 joint angles (rad; both 0 hanging, q2 relative to link 1), w1, w2 their velocities
/// (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau torque at joint 1 (N·m).
///
/// Units are those of the pendulum of size 1 (size.ts), where they are SI units.

export { CONTROL_PERIOD } from './period';
export const CAPSULE_RADIUS = 0.04; // of both links, m
export const ARMATURE = 0.01; // of both joints, kg·m²

/// The plant's parameters, and its size. The capsules keep their radius; inertia and centre of mass
/// follow mass and length.
export interface Plant {
  size: number; // factor of all lengths
  mass1: number; // kg
  mass2: number;
  length1: number; // m
  length2: number;
  damping1: number; // N·m·s/rad
  damping2: number;
  gravity: number; // m/s², along -z
  torque_limit: number; // N·m
}

export type Parameter = Exclude<keyof Plant, 'size'>;

export const PARAMETERS = [
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

/// Allowed values in the page, which the program takes, too.
export const PLANT_LIMITS: Readonly<Record<keyof Plant, Range>> = {
  size: [0.05, 10],
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
  size: 1,
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

export const COORDINATES = ['q1', 'q2', 'w1', 'w2'] as const satisfies readonly (keyof State)[];

// The core's structs (web/wasm/fields.h).
export const PLANT_NAMES = [...PARAMETERS, 'size'] as const satisfies readonly (keyof Plant)[];
export const PLANT_FIELDS = new Fields('plant', PLANT_NAMES);
export const STATE_FIELDS = new Fields('state', COORDINATES);
const JUDGED_FIELDS = new Fields('judged', PLANT_NAMES, COORDINATES, ['torque', 'goal1', 'goal2']);
const CAPSULE_FIELDS = new Fields('capsule', ['mass', 'radius', 'length']);
const CAPSULE_INERTIA_FIELDS = new Fields('capsule_inertia', ['across', 'along']);
const JUDGEMENT_NAMES = [
  'observation',
  'energy',
  'normalized_energy',
  'tip_height',
  'relative_height',
  'inverted',
  'reward_terms',
] as const;
export const JUDGEMENT_FIELDS = new Fields('judgement', JUDGEMENT_NAMES);
type Judgement = (typeof JUDGEMENT_NAMES)[number];

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
  const capsule = CAPSULE_FIELDS.numbers({ mass: m, radius: r, length: l });
  return CAPSULE_INERTIA_FIELDS.object(core().formula(capsule, core().exports.capsule_inertia));
}

/// The core's judgement of a state under a torque. A call takes 4 µs, a tenth of a policy's decision,
/// so one call for all fields is cheap enough.
function judge(plant: Plant, state: State, torque = 0, goal: Goal | null = null): Float64Array {
  const [goal1, goal2] = goalNumbers(goal);
  const numbers = JUDGED_FIELDS.numbers(plant, state, { torque, goal1, goal2 });
  return core().formula(numbers, core().exports.pendulum_at);
}

function judged(name: Judgement, plant: Plant, state: State): number {
  return JUDGEMENT_FIELDS.read(judge(plant, state), name);
}

/// The plant of size 1 with the parameters of an object, which may have more keys.
export function plantIn(given: Readonly<Record<Parameter, number>>): Plant {
  const parameters = PARAMETERS.map((name) => [name, given[name]]);
  return { ...NOMINAL, ...Object.fromEntries(parameters) } as Plant;
}

/// Mechanical energy (J), with thin-rod inertias m l²/12 and heights counted from the pivot.
export function energy(plant: Plant, s: State): number {
  return judged('energy', plant, s);
}

/// Energy mapped so that hanging at rest is 0 and upright at rest is 1.
export function normalizedEnergy(plant: Plant, s: State): number {
  return judged('normalized_energy', plant, s);
}

/// Height of the second link's tip over the pivot (m).
export function tipHeight(plant: Plant, s: State): number {
  return judged('tip_height', plant, s);
}

/// tipHeight over l1 + l2, as in the observation: -1 hanging, 1 upright.
export function relativeHeight(plant: Plant, s: State): number {
  return judged('relative_height', plant, s);
}

/// Both links within 30° of the goal's directions; the second by its absolute angle q1 + q2.
export function inverted(s: State, goal: Goal | null = null): boolean {
  return JUDGEMENT_FIELDS.read(judge(NOMINAL, s, 0, goal), 'inverted') === 1;
}

export const OBSERVATION_SIZE = 8;
/// [cos q1, sin q1, w1/10, cos q2, sin q2, w2/20, Ê, ĥ] with Ê = normalizedEnergy and ĥ =
/// relativeHeight.
export function observe(plant: Plant, s: State): Float32Array {
  return Float32Array.from(JUDGEMENT_FIELDS.readAll(judge(plant, s), 'observation'));
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
  return [...JUDGEMENT_FIELDS.readAll(judge(plant, s, tau, goal), 'reward_terms')];
}

/// Why the physics is not stable for a plant; empty if it is.
export function plantProblem(plant: Plant): string {
  let stable = 0;
  core().formula(PLANT_FIELDS.numbers(plant), () => (stable = core().exports.pendulum_check()));
  return stable === 0 ? core().text : '';
}

/// Number of physics steps in a control period (s), as in the program, for a plant without a
/// plantProblem().
export function physicsSteps(plant: Plant, period: number): number {
  let steps = 0;
  core().formula(PLANT_FIELDS.numbers(plant), () => (steps = core().exports.physics_steps(period)));
  return steps;
}

/// The model as MJCF, with all digits of the plant's numbers, which are in SI units. Contacts and
/// constraints are off: a step takes less time and the trajectory is the same.
export function mjcf(plant: Plant): string {
  core().formula(PLANT_FIELDS.numbers(plant), core().exports.pendulum_mjcf);
  return core().text;
}
