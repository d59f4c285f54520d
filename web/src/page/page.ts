import { core } from '../core';
import { LearnPanel } from '../learn/panel';
import type { Mujoco } from '../mujoco';
import type { GoalName, Parameter, Plant, State } from '../pendulum';
import type { World } from '../world';
import type { Agents } from './agents';
import { nameSendButtons } from './clipboard';
import { button } from './dom';
import { listenToFilms } from './film';
import { Frames } from './frames';
import { listenToKeys } from './keys';
import { Laboratory } from './laboratory';
import type { Learned } from './laboratory';
import { prefersStill } from './motion';
import { keepStageInSight } from './layout';
import { lightNouns } from './nouns';
import { Router } from './router';
import { save } from './save';
import type { Shared } from './share';
import { restoreOnScroll } from './sliders';
import type { Slider } from './sliders';
import { PendulumStage } from './stage';
import { changeTheme, onThemeChange } from './theme';
import { TRAIL_SECONDS } from '../view/scene';
import { Tour } from './tour';

const FADING = 250; // ms between two drawings of a trail that fades

/// The page: stage, laboratory, training and tour, connected with each other.
export class Page {
  readonly agents: Agents;
  readonly stage: PendulumStage;
  readonly laboratory: Laboratory;
  readonly learn: LearnPanel;
  readonly tour: Tour;
  readonly router: Router;
  private readonly frames = new Frames(this);
  private fadesUntil = 0; // s, in the world's time: the end of the trail that is in sight
  private restedAt = 0; // ms, of the last drawing of a page at rest

  constructor(world: World, agents: Agents) {
    this.agents = agents;
    this.stage = new PendulumStage(world, agents, {
      changed: () => this.changed(),
      wake: () => this.frames.wake(),
    });
    this.laboratory = new Laboratory(this.stage, agents, (where) => this.start(where));
    this.learn = new LearnPanel(this, agents.list[0]!.id);
    this.tour = new Tour(
      this,
      (id) => agents.has(id),
      () => {
        this.router.arranged();
        this.stage.setPaused(false);
        this.stage.changed();
      },
    );
    this.router = new Router(this, this);
    world.onMoment = (moment) => {
      this.stage.history.add(moment, this.stage.world.plant.size);
      this.tour.moment(moment);
    };
    world.onChange = () => this.frames.stir();
  }

  // What training, tour and editor need of the stage and the laboratory.

  get world() {
    return this.stage.world;
  }

  get clock() {
    return this.stage.clock;
  }

  get scene() {
    return this.stage.scene;
  }

  get twin() {
    return this.stage.twin;
  }

  get agentTitle(): string {
    return this.laboratory.agent?.title ?? '';
  }

  advance(seconds: number): void {
    this.stage.advance(seconds);
  }

  reset(): void {
    this.stage.reset();
  }

  setSpeed(speed: number): void {
    this.stage.setSpeed(speed);
  }

  take(shared: Partial<Shared>): Promise<boolean> {
    return this.laboratory.take(shared);
  }

  begin(shared: Partial<Shared>): Promise<boolean> {
    return this.laboratory.begin(shared);
  }

  choose(id: string): Promise<boolean> {
    return this.laboratory.choose(id);
  }

  keepLearned(learned: Learned, shown: boolean): Promise<boolean> {
    return this.laboratory.keepLearned(learned, shown);
  }

  plantSlider(name: Parameter | 'size', id: string): Slider {
    return this.laboratory.plantSlider(name, id);
  }

  setPlant(plant: Plant): void {
    this.laboratory.setPlant(plant);
  }

  setGoal(name: GoalName): void {
    this.laboratory.setGoal(name);
  }

  setAgentOn(on: boolean): void {
    this.laboratory.setAgentOn(on);
  }

  resetMap(): void {
    this.laboratory.resetMap();
  }

  /// Call when a training has begun: the address becomes its recipe.
  learned(): void {
    this.router.arranged();
    this.stage.changed();
  }

  // For the start of the page, and for tests.

  /// The core's memory (bytes), which never shrinks.
  get coreBytes(): number {
    return core().exports.memory.buffer.byteLength;
  }

  /// Whether the final agent and physics are loaded.
  get isComplete(): boolean {
    return this.stage.inMujoco && !this.laboratory.loading;
  }

  /// Shows the view of an address, with its settings.
  open(hash?: string): Promise<void> {
    return this.router.open(hash);
  }

  /// Moves both pendulums to MuJoCo.
  continueIn(simulator: Mujoco): void {
    this.stage.continueIn(simulator);
  }

  /// Starts to handle input, and to advance and draw at each frame.
  run(): void {
    this.listen();
    this.frames.start();
  }

  private listen(): void {
    const { laboratory, router, scene, stage, twin, world } = this;
    stage.listen();
    laboratory.listen();
    router.listen();
    const actions = {
      toggleAgent: () => laboratory.toggleAgent(),
      togglePause: () => stage.togglePause(),
      step: () => stage.step(),
      reset: () => stage.reset(),
      shoveLeft: () => world.shoveTo(-1),
      shoveRight: () => world.shoveTo(1),
    };
    listenToKeys(actions, () => router.keys);
    restoreOnScroll();
    keepStageInSight();
    button('save', () => save(stage.history));
    nameSendButtons();
    listenToFilms(
      () => (world.twin ? [scene, twin.scene] : [scene]),
      () => router.title,
    );
    button('theme', changeTheme);
    onThemeChange(() => this.repaint());
    const wake = () => this.frames.wake();
    for (const event of ['input', 'change', 'click', 'pointerdown', 'keydown'])
      addEventListener(event, wake);
    this.frames.watch(this.canvases.map((canvas) => canvas.element));
    lightNouns(scene, wake);
  }

  private changed(): void {
    this.router.changed();
    this.frames.wake();
  }

  /// Starts at a point of the map.
  private start(where: Partial<State>): void {
    this.stage.start(where);
    this.tour.started();
  }

  private get canvases() {
    return [...this.stage.canvases, ...this.laboratory.canvases];
  }

  private repaint(): void {
    for (const canvas of this.canvases) canvas.forgetColors();
    this.frames.wake();
  }

  // For the frames.

  get moving(): boolean {
    return !this.stage.paused && (!this.world.resting || this.learn.running);
  }

  get learning(): boolean {
    return this.learn.running;
  }

  get visible(): boolean {
    const { laboratory, stage, world } = this;
    if (stage.stirs) this.fadesUntil = world.time + TRAIL_SECONDS;
    return stage.stirs || laboratory.chartsInSight || this.learn.running;
  }

  get sudden(): boolean {
    return this.world.push !== null;
  }

  /// Words of a page at rest, and a trail that fades.
  rest(): void {
    const { tour, scene, stage, world } = this;
    const now = performance.now();
    const fades = world.time < this.fadesUntil && now - this.restedAt > FADING;
    if (!fades) {
      tour.follow(world, scene);
      return stage.drawBadge();
    }
    this.restedAt = now;
    this.draw();
  }

  draw(): void {
    const { laboratory, learn, router, scene, stage, tour, world } = this;
    const { step } = document.documentElement.dataset;
    const hasRing = (router.learning && learn.begun && step !== 'reward') || step === 'map';
    stage.draw(laboratory.ringColors(hasRing, learn.lastTest ?? world.policy));
    tour.follow(world, scene);
    learn.follow();
    if (router.learning && !prefersStill()) scene.ghosts = learn.ghosts;
    laboratory.draw(stage.history);
    stage.drawBadge();
    if (laboratory.computing) this.frames.wake();
  }
}
