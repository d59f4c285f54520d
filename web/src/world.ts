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
  PARAMETERS,
  physicsSteps,
  relativeHeight,
  remember,
} from './pendulum';
import type { Goal, Plant, State } from './pendulum';
import type { Decision, Memory } from './decision';
import type { Policy } from './policy';
import { Sensors } from './sensors';
import type { Reading } from './sensors';
import type { Push, Simulator, Vec } from './simulator';
import { Units } from './size';

const SPRING = 60; // N/m, of the hand that drags
const DAMPER = 5; // N·s/m
const STRONGEST = 15; // N
const SHOVE = 0.4; // N, sideways at the tip; repeated shoves add up
const STRONGEST_SHOVE = 6; // N
const SHOVE_SECONDS = 0.1;
const ROUNDING = 1e-9; // s, of sums of times

/// One moment, at each control step.
export interface Moment {
  t: number; // s
  state: State;
  torque: number; // N·m, held by the motor from then on
  energy: number; // 0 hanging, 1 upright
  height: number; // of the tip over l1 + l2
}

/// A control period: its length (s) and the number of its physics steps.
interface Rate {
  period: number;
  steps: number;
}

/// The pendulum with its motor, its agent, and the hand that disturbs it. Independent of the page.
/// All numbers are in units of size 1 (size.ts).
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
  private _units = new Units(1);
  private _policy: Policy | null = null;
  private _goal: Goal = GOALS['up-up'];
  private observation: Float32Array | null = null; // at the last control step; null at the start
  private chosen = 0; // N·m, chosen at that step
  private memory: Memory | null = null; // the policy's, since the start
  /// Estimate of the plant, if the policy identifies it, and whether it has begun.
  private identifier: Identifier | null = null;
  private identifies = false;
  private readonly motor = new DelayLine();
  private sensors = new Sensors(CONTROL_PERIOD);
  private reading: Reading | null = null; // at the last control step; null at the start
  private rate: Rate = { period: CONTROL_PERIOD, steps: 4 }; // of this control period
  private nextRate = this.rate; // of the next one
  private rateSince = 0; // s, the time at which this rate began
  private steps = 0; // physics steps since then
  private uprightSince: number | null = null; // s; null if the links are not in the goal
  private untilControl = 0; // steps until the agent chooses again
  private begun = 0; // s, time of the start
  private before: State = HANGING; // before the last step
  private behind = 0; // s, of a twin's time behind the first one's
  private shove = { force: 0, seconds: 0 };

  constructor(simulator: Simulator) {
    this.simulator = simulator;
    this.reset();
  }

  get plant(): Readonly<Plant> {
    return this._plant;
  }
  set plant(plant: Plant) {
    const isOther = PARAMETERS.some((name) => plant[name] !== this._plant[name]);
    this._plant = { ...plant };
    this._units = new Units(plant.size);
    this.simulator.plant = plant;
    if (isOther) this.identifies = false;
    this.findRate();
    if (this.twin) this.twin.plant = plant;
    this.onChange();
  }

  /// The units of its size, for numbers that are shown.
  get units(): Units {
    return this._units;
  }

  get policy(): Policy | null {
    return this._policy;
  }
  set policy(policy: Policy | null) {
    const { period: before } = this;
    this._policy = policy;
    this.observation = null;
    const { period } = this;
    this.identifier = policy?.identifies ? new Identifier(policy.plant, period) : null;
    this.identifies = false;
    if (period !== before) {
      this.sensors = new Sensors(period);
      this.sensors.begin(this.state);
      this.reading = null;
      this.findRate();
    }
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

  /// Time (s) between two decisions of its policy; also of the visitor's torques.
  get period(): number {
    return this._policy?.period ?? CONTROL_PERIOD;
  }

  /// Number of physics steps in a second, now.
  private get stepsPerSecond(): number {
    return this.rate.steps / this.rate.period;
  }

  /// Duration (s) of the next physics step.
  get timestep(): number {
    const { period, steps } = this.isAtControl ? this.nextRate : this.rate;
    return period / steps;
  }

  private findRate(): void {
    const { _plant: plant, period } = this;
    this.nextRate = { period, steps: physicsSteps(plant, period) };
  }

  /// Time (s) since the page was opened; a reset does not set it back.
  get time(): number {
    return this.rateSince + this.steps / this.stepsPerSecond;
  }

  /// Time (s) since the start.
  get elapsed(): number {
    return rounded(this.time - this.begun);
  }

  /// The state `seconds` ago, within the last physics step.
  stateAgo(seconds: number): State {
    const { before, state, stepsPerSecond } = this;
    const share = Math.min(Math.max(1 - seconds * stepsPerSecond, 0), 1);
    const between = (a: number, b: number) => a + share * (b - a);
    return {
      q1: between(before.q1, state.q1),
      q2: between(before.q2, state.q2),
      w1: between(before.w1, state.w1),
      w2: between(before.w2, state.w2),
    };
  }

  /// The twin's state `seconds` ago; null without a twin.
  twinStateAgo(seconds: number): State | null {
    const { twin } = this;
    return twin && twin.stateAgo(seconds - twin.behind);
  }

  /// Forgets the last step, after the state was set or advanced step by step.
  settle(): void {
    this.before = this.state;
    this.twin?.settle();
  }

  /// Whether the next physics step begins with a new torque.
  get isAtControl(): boolean {
    return this.untilControl === 0;
  }

  /// How long (s) both links have been in the goal, usually upright, without a break; null if they
  /// are not. Rounded, so that 1 s is exact.
  get uprightFor(): number | null {
    return this.uprightSince === null ? null : rounded(this.time - this.uprightSince);
  }

  /// Whether it hangs still, and nothing will move it.
  get resting(): boolean {
    const { state, agentOn, byHand, torque, drag, shove, twin } = this;
    const { q1, q2, w1, w2 } = state;
    if (agentOn || drag || shove.seconds > 0 || twin?.resting === false) return false;
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
    this.begun = this.time;
    this.before = state;
    this.behind = 0;
    this.torque = 0;
    this.push = null;
    this.shoved = null;
    this.shove.seconds = 0;
    this.uprightSince = null;
    this.judge();
    this.look();
    this.twin?.reset(state);
  }

  shoveTo(direction: -1 | 1): void {
    const before = this.shove.seconds > 0 ? this.shove.force : 0;
    const force = before + SHOVE * direction;
    const limited = Math.min(Math.max(force, -STRONGEST_SHOVE), STRONGEST_SHOVE);
    this.shove = { force: limited, seconds: SHOVE_SECONDS };
    this.twin?.shoveTo(direction);
  }

  /// One physics step; the first one of a control period begins with a decision of the agent.
  /// Returns false if the state blew up and the pendulum hangs again.
  advance(): boolean {
    if (this.untilControl === 0) {
      this.takeRate();
      this.control();
      this.untilControl = this.rate.steps;
    }
    const { timestep } = this;
    this.push = this.hand() ?? this.shoving();
    this.before = this.state;
    const valid = this.simulator.step(this.torque, this.push, timestep);
    this.shove.seconds = Math.max(0, rounded(this.shove.seconds - timestep));
    ++this.steps;
    --this.untilControl;
    if (valid) this.advanceTwin(timestep);
    else this.reset();
    if (!this.resting) this.onChange();
    return valid;
  }

  /// Begins a control period at the rate of policy and plant.
  private takeRate(): void {
    const { rate, nextRate } = this;
    if (rate.period === nextRate.period && rate.steps === nextRate.steps) return;
    this.rateSince = this.time;
    this.steps = 0;
    this.rate = nextRate;
  }

  /// The twin's steps may have another length.
  private advanceTwin(seconds: number): void {
    const { twin, agentOn, byHand, drag } = this;
    if (!twin) return;
    Object.assign(twin, { agentOn, byHand, drag });
    Object.assign(twin.disturbance, this.disturbance);
    twin.behind += seconds;
    for (let step = twin.timestep; twin.behind >= step - ROUNDING; step = twin.timestep) {
      twin.behind = rounded(twin.behind - step);
      if (!twin.advance()) break;
    }
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
    else this.uprightSince ??= this.time;
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
    if (this.shove.seconds === 0) return null;
    const force = { x: this.shove.force, z: 0 };
    const push: Push = { link: 2, along: this.plant.length2, force };
    this.shoved = { push, at: this.time };
    return push;
  }
}

function rounded(seconds: number): number {
  return Math.round(seconds / ROUNDING) / Math.round(1 / ROUNDING);
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
