import { blurred, DelayLine, exact, PERFECT } from './disturbance';
import type { Disturbance } from './disturbance';
import { Identifier } from './identifier';
import {
  CONTROL_PERIOD,
  goalNumbers,
  GOALS,
  HANGING,
  inverted,
  NOMINAL,
  normalizedEnergy,
  observe,
  PHYSICS_STEPS,
  relativeHeight,
  remember,
} from './pendulum';
import type { Goal, Plant, State } from './pendulum';
import type { Decision, Memory } from './decision';
import type { Policy } from './policy';
import { Sensors } from './sensors';
import type { Reading } from './sensors';
import type { Push, Simulator, Vec } from './simulator';

export const STEPS_PER_SECOND = PHYSICS_STEPS / CONTROL_PERIOD; // of physics

const SPRING = 60; // N/m, of the hand that drags
const DAMPER = 5; // N·s/m
const STRONGEST = 15; // N
const SHOVE = 0.4; // N, sideways at the tip; repeated shoves add up
const STRONGEST_SHOVE = 6; // N
const SHOVE_STEPS = 20; // 0.1 s

/// One moment, at each control step.
export interface Moment {
  t: number; // s
  state: State;
  torque: number; // N·m, held by the motor from then on
  energy: number; // 0 hanging, 1 upright
  height: number; // of the tip over l1 + l2
}

/// The pendulum with its motor, its agent, and the hand that disturbs it. Independent of the page.
export class World {
  simulator: Simulator;
  readonly disturbance: Disturbance = { ...PERFECT };
  agentOn = false;
  /// The visitor's torque (N·m), applied while the agent is off.
  byHand = 0;
  /// The hand's grip on the pendulum, and the hand's place.
  drag: { link: 1 | 2; along: number; target: Vec } | null = null;
  onMoment: (moment: Moment) => void = () => {};
  /// Called when state, plant, policy or decision may have changed.
  onChange: () => void = () => {};
  /// A second pendulum with its own policy. Start, plant, hand, shoves and errors of sensors and
  /// motor are the same for both.
  twin: World | null = null;

  torque = 0; // N·m, held by the motor now
  push: Push | null = null; // force that acts now
  /// The last shove, and the time of its end (s).
  shoved: { push: Push; at: number } | null = null;
  /// The agent's decision at the last control step, even while it is off; see also look().
  decision: Decision | null = null;

  private _plant: Plant = { ...NOMINAL };
  private _policy: Policy | null = null;
  private _goal: Goal = GOALS['up-up'];
  private observation: Float32Array | null = null; // at the last control step; null at the start
  private chosen = 0; // N·m, chosen at that step
  private memory: Memory | null = null; // the policy's, since the start
  /// Estimate of the plant, if the policy identifies it, and whether it has begun.
  private identifier: Identifier | null = null;
  private identifies = false;
  private readonly motor = new DelayLine();
  private readonly sensors = new Sensors();
  private reading: Reading | null = null; // at the last control step; null at the start
  private steps = 0; // physics steps since the page was opened
  private uprightSince: number | null = null; // physics step; null if the links are not in the goal
  private untilControl = 0; // steps until the agent chooses again
  private begun = 0; // physics step of the start
  private shove = { force: 0, steps: 0 };

  constructor(simulator: Simulator) {
    this.simulator = simulator;
    this.reset();
  }

  get plant(): Readonly<Plant> {
    return this._plant;
  }
  set plant(plant: Plant) {
    this._plant = { ...plant };
    this.simulator.plant = plant;
    this.identifies = false;
    if (this.twin) this.twin.plant = plant;
    this.onChange();
  }

  get policy(): Policy | null {
    return this._policy;
  }
  set policy(policy: Policy | null) {
    this._policy = policy;
    this.observation = null;
    this.identifier = policy?.identifies ? new Identifier(policy.plant) : null;
    this.identifies = false;
    this.forget();
    this.judge();
    this.look();
  }

  /// The pose to reach for a policy for any pose; also the twin's.
  set goal(goal: Goal) {
    this._goal = goal;
    if (this.twin) this.twin.goal = goal;
    if (!this.target) return;
    this.judge();
    this.look();
  }
  get goal(): Goal {
    return this._goal;
  }

  /// The goal of its policy; null if that is always upright.
  get target(): Goal | null {
    return this._policy?.seeksAnyPose ? this._goal : null;
  }

  /// Restarts the policy without memory.
  private forget(): void {
    this.memory?.close();
    this.memory = this._policy?.controller.begin() ?? null;
  }

  get state(): State {
    return this.simulator.state;
  }

  /// Continues in another engine, from the same state and with the same plant.
  continueIn(simulator: Simulator): void {
    simulator.plant = this._plant;
    simulator.state = this.state;
    this.simulator = simulator;
  }

  /// Time (s) since the page was opened; a reset does not set it back.
  get time(): number {
    return this.steps / STEPS_PER_SECOND;
  }

  /// Time (s) since the start.
  get elapsed(): number {
    return (this.steps - this.begun) / STEPS_PER_SECOND;
  }

  /// Whether the next physics step begins with a new torque.
  get isAtControl(): boolean {
    return this.untilControl === 0;
  }

  /// How long (s) both links have been in the goal, usually upright, without a break; null if they
  /// are not. Counted in steps, so that 1 s is exact.
  get uprightFor(): number | null {
    return this.uprightSince === null ? null : (this.steps - this.uprightSince) / STEPS_PER_SECOND;
  }

  /// Whether it hangs still, and nothing will move it.
  get resting(): boolean {
    const { state, agentOn, byHand, torque, drag, shove, twin } = this;
    const { q1, q2, w1, w2 } = state;
    if (agentOn || drag || shove.steps > 0 || twin?.resting === false) return false;
    return [q1, q2, w1, w2, byHand, torque].every((x) => x === 0);
  }

  /// Starts again from `state`, without forces or delayed torques.
  reset(state: State = HANGING): void {
    this.simulator.state = state;
    this.motor.clear();
    this.sensors.begin(state);
    this.reading = null;
    this.observation = null;
    this.identifies = false;
    this.forget();
    this.untilControl = 0;
    this.begun = this.steps;
    this.torque = 0;
    this.push = null;
    this.shoved = null;
    this.shove.steps = 0;
    this.uprightSince = null;
    this.judge();
    this.look();
    this.twin?.reset(state);
  }

  shoveTo(direction: -1 | 1): void {
    const before = this.shove.steps > 0 ? this.shove.force : 0;
    const force = before + SHOVE * direction;
    const limited = Math.min(Math.max(force, -STRONGEST_SHOVE), STRONGEST_SHOVE);
    this.shove = { force: limited, steps: SHOVE_STEPS };
    this.twin?.shoveTo(direction);
  }

  /// One physics step; every fourth begins with a decision of the agent. Returns false if the state
  /// blew up and the pendulum hangs again.
  advance(): boolean {
    if (this.untilControl === 0) {
      this.control();
      this.untilControl = PHYSICS_STEPS;
    }
    this.push = this.hand() ?? this.shoving();
    const valid = this.simulator.step(this.torque, this.push);
    this.shove.steps = Math.max(0, this.shove.steps - 1);
    ++this.steps;
    --this.untilControl;
    if (valid) this.advanceTwin();
    else this.reset();
    if (!this.resting) this.onChange();
    return valid;
  }

  private advanceTwin(): void {
    const { twin, agentOn, byHand, drag } = this;
    if (!twin) return;
    Object.assign(twin, { agentOn, byHand, drag });
    Object.assign(twin.disturbance, this.disturbance);
    twin.advance();
  }

  /// Steps to the agent's next decision.
  advanceToControl(): boolean {
    let valid = this.advance();
    while (valid && this.untilControl > 0) valid = this.advance();
    return valid;
  }

  /// Updates the agent's decision for the present state without acting, for a paused pendulum.
  look(): void {
    this.decision = this.policy?.act(this.observe()) ?? null;
    this.onChange();
  }

  /// The observation behind the last decision.
  get seen(): Float32Array {
    return this.observation ?? this.observe();
  }

  /// The agent's decision in another state, with its present memory.
  decisionAt(state: State): Decision | null {
    const { policy } = this;
    if (!policy) return null;
    const now = this.present(state);
    const observation = this.observation?.slice() ?? new Float32Array(policy.controller.inputs);
    observation.set(now);
    return policy.act(observation);
  }

  /// Counts the time in the goal.
  private judge(): void {
    if (!inverted(this.state, this.target)) this.uprightSince = null;
    else this.uprightSince ??= this.steps;
  }

  /// The observation of a measured state without memory. A policy that identifies the plant gets
  /// its estimate instead of the true plant.
  private present(measured: State): Float32Array {
    const { plant, policy, identifier, target } = this;
    if (!identifier && !target) return observe(plant, measured);
    const assumed = policy && identifier ? policy.plant : plant;
    const estimate = identifier?.observe(measured) ?? [];
    const goal = target ? goalNumbers(target) : [];
    return Float32Array.of(...observe(assumed, measured), ...estimate, ...goal);
  }

  /// The present observation. Encoders show their values of the last control step.
  private observe(measured = this.measured()): Float32Array {
    const { policy, observation: before, chosen } = this;
    const now = this.present(measured);
    if (!policy) return now;
    const observation = new Float32Array(policy.controller.inputs);
    observation.set(now);
    return before && policy.memory > 0
      ? remember(before, chosen, policy.memory, observation)
      : observation;
  }

  private measured(): State {
    const shown = exact(this.disturbance) ? null : this.reading;
    return blurred(shown?.state ?? this.state, this.disturbance.sensor_noise);
  }

  /// Updates the estimate of the plant with the last control period.
  private identify(measured: State, { torque, noise }: Reading): void {
    if (this.identifies) this.identifier?.update(measured, torque, noise);
    else this.identifier?.begin(measured);
    this.identifies = true;
  }

  private control(): void {
    const { plant, policy, state } = this;
    this.reading = this.sensors.measure(state, this.torque, this.disturbance);
    const measured = this.measured();
    this.identify(measured, this.reading);
    this.observation = this.observe(measured);
    this.decision = policy?.act(this.observation, this.memory) ?? null;
    this.chosen = this.agentOn ? (this.decision?.torque ?? 0) : this.byHand;
    const limit = plant.torque_limit;
    const arriving = this.motor.apply(this.chosen, this.disturbance.delay);
    this.torque = Math.min(Math.max(arriving, -limit), limit);

    this.judge();
    this.onMoment({
      t: this.time,
      state,
      torque: this.torque,
      energy: normalizedEnergy(plant, state),
      height: relativeHeight(plant, state),
    });
  }

  /// The force of a spring and a damper between the hand and its grip.
  private hand(): Push | null {
    if (!this.drag) return null;
    const { link, target } = this.drag;
    // The link may have become shorter since the hand took it.
    const along = Math.min(this.drag.along, link === 1 ? this.plant.length1 : this.plant.length2);
    const { position, velocity } = pointOn(this.plant, this.state, link, along);
    const x = SPRING * (target.x - position.x) - DAMPER * velocity.x;
    const z = SPRING * (target.z - position.z) - DAMPER * velocity.z;
    const scale = Math.min(1, STRONGEST / Math.hypot(x, z));
    return { link, along, force: { x: scale * x, z: scale * z } };
  }

  private shoving(): Push | null {
    if (this.shove.steps === 0) return null;
    const force = { x: this.shove.force, z: 0 };
    const push: Push = { link: 2, along: this.plant.length2, force };
    this.shoved = { push, at: this.time };
    return push;
  }
}

/// Position (m) and velocity (m/s) of the point `along` m from a link's hinge.
export function pointOn(plant: Plant, s: State, link: 1 | 2, along: number) {
  const swing = (angle: number, rate: number, length: number) => ({
    position: { x: -length * Math.sin(angle), z: -length * Math.cos(angle) },
    velocity: { x: -length * Math.cos(angle) * rate, z: length * Math.sin(angle) * rate },
  });
  const first = swing(s.q1, s.w1, link === 1 ? along : plant.length1);
  if (link === 1) return first;
  const second = swing(s.q1 + s.q2, s.w1 + s.w2, along);
  const sum = (a: Vec, b: Vec): Vec => ({ x: a.x + b.x, z: a.z + b.z });
  return {
    position: sum(first.position, second.position),
    velocity: sum(first.velocity, second.velocity),
  };
}
