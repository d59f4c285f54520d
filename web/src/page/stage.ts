import { History } from '../history';
import type { Mujoco } from '../mujoco';
import type { State } from '../pendulum';
import { Scene, TRAIL_SECONDS } from '../view/scene';
import type { World } from '../world';
import type { Agents } from './agents';
import { Badge } from './badge';
import { Clock } from './clock';
import { button, element } from './dom';
import { Hand } from './hand';
import { note, warn } from './message';
import { prefersStill } from './motion';
import { Pose } from './pose';
import { Twin } from './twin';

const REMEMBERED = 60; // s of history
const LAG = 2; // s left out until the visitor is told

/// Callbacks of the stage.
export interface StageListener {
  /// A setting has changed, which the address shows, too.
  changed(): void;
  /// The next frame shows a change.
  wake(): void;
}

/// The pendulum with its canvas, its time and the hand of the visitor, and the second pendulum.
export class PendulumStage {
  readonly world: World;
  readonly clock: Clock;
  readonly scene = new Scene('scene');
  readonly history = new History(REMEMBERED);
  readonly twin: Twin;
  private readonly pose: Pose;
  private readonly badge = new Badge();
  private readonly listener: StageListener;
  private paused_ = false;
  private mujoco = false;

  constructor(world: World, agents: Agents, listener: StageListener) {
    this.world = world;
    this.listener = listener;
    this.clock = new Clock(world);
    this.pose = new Pose(world, () => this.restarted());
    this.twin = new Twin(world, agents, () => {
      this.reset();
      this.changed();
    });
  }

  get paused(): boolean {
    return this.paused_;
  }

  /// Whether MuJoCo moves the pendulums.
  get inMujoco(): boolean {
    return this.mujoco;
  }

  get canvases() {
    return [this.scene.canvas, this.twin.scene.canvas];
  }

  /// Starts to handle input.
  listen(): void {
    new Hand(
      this.world,
      this.scene,
      () => this.paused,
      () => this.restarted(),
    );
    button('pause', () => this.togglePause());
    button('step', () => this.step());
    button('reset', () => this.reset());
    button('shove-left', () => this.world.shoveTo(-1));
    button('shove-right', () => this.world.shoveTo(1));
    const speed = element<HTMLInputElement>('speed');
    speed.addEventListener('input', () => this.setSpeed(Number(speed.value)));
  }

  /// Moves both pendulums to MuJoCo.
  continueIn(simulator: Mujoco): void {
    this.mujoco = true;
    this.world.continueIn(simulator);
    this.twin.continueIn(simulator.another());
  }

  /// Advances the pendulum by `seconds` of real time, unless it is paused.
  advance(seconds: number): void {
    if (this.paused) return;
    if (!this.clock.advance(seconds)) {
      this.restarted();
      warn('The pendulum spun too fast to be computed; it hangs again.');
    }
    if (this.clock.lag < LAG) return;
    this.clock.lag = -Infinity; // once
    note('Slowed down, because the agent takes longer than this pendulum gives it.');
  }

  setPaused(paused: boolean): void {
    this.paused_ = paused;
    this.world.drag = null;
    this.clock.settle();
    element('pause').textContent = paused ? 'Resume' : 'Pause';
    this.pose.shown = paused;
    this.listener.wake();
  }

  togglePause(): void {
    this.setPaused(!this.paused);
  }

  setSpeed(speed: number): void {
    this.clock.speed = speed;
    element<HTMLInputElement>('speed').value = String(speed);
    element('speed-value').textContent = `${speed}×`;
    this.changed();
  }

  /// One control step, then a pause.
  step(): void {
    this.setPaused(true);
    const valid = this.world.advanceToControl();
    if (!valid) this.restarted();
    this.world.look();
    this.clock.settle();
  }

  /// Hangs the pendulum.
  reset(): void {
    this.world.reset();
    this.restarted();
  }

  /// Starts from a state with these variables; the others keep their values.
  start(where: Partial<State>): void {
    this.world.reset({ ...this.world.state, ...where });
    this.restarted();
  }

  /// Drops the history after a new start.
  restarted(): void {
    this.clock.settle();
    this.history.clear();
    this.twin.restarted();
  }

  /// Call after a setting changed.
  changed(): void {
    if (this.paused) this.world.look();
    this.listener.changed();
  }

  /// Whether another drawing would show something new.
  get stirs(): boolean {
    const { clock, scene, twin, world } = this;
    return scene.stirs(world, clock.state) || twin.stirs(clock);
  }

  /// Draws both pendulums. `ring`: colours around the first one.
  draw(ring: readonly string[]): void {
    const { clock, history, scene, twin, world } = this;
    const still = prefersStill();
    scene.ring = ring;
    scene.draw(world, clock.state, still ? [] : history.from(world.time - TRAIL_SECONDS));
    twin.draw(clock, still);
    if (this.paused) this.pose.follow(world.state);
  }

  /// Shows whether the pendulum is balanced, with sparks when the visitor has caught it.
  drawBadge(): void {
    const { badge, scene, world } = this;
    const caught = badge.draw(world, this.paused, scene.canvas.element);
    // Only for the visitor's own catch.
    if (caught && !world.agentOn && !prefersStill()) scene.sparks.light();
  }
}
