import { core } from '../core';
import { History } from '../history';
import { LearnPanel } from '../learn/panel';
import { GOALS, plantProblem } from '../pendulum';
import type { GoalName, State } from '../pendulum';
import type { Mujoco } from '../mujoco';
import { Scene, TRAIL_SECONDS } from '../view/scene';
import { quoted } from '../text';
import type { World } from '../world';
import { Address } from './address';
import { AgentPanel } from './agent_panel';
import type { Agent, Agents } from './agents';
import { Clock } from './clock';
import { Badge } from './badge';
import { nameSendButtons } from './clipboard';
import { Dashboard } from './dashboard';
import { listenToFilms } from './film';
import { button, element } from './dom';
import { Frames } from './frames';
import { GoalButtons } from './goals';
import { Hand } from './hand';
import { listenToKeys } from './keys';
import { explain, listenToExamples, placeCharts } from './layout';
import { MapPanel } from './map';
import { note, warn } from './message';
import { prefersStill } from './motion';
import { lightNouns } from './nouns';
import { Pose } from './pose';
import { save } from './save';
import { Ring } from './ring';
import { RANGES, Settings } from './settings';
import { BEGINNING, decode, disturbanceOf, encode, OWN, problemText } from './share';
import type { Shared } from './share';
import { restoreOnScroll } from './sliders';
import { changeTheme, onThemeChange } from './theme';
import { Tour } from './tour';
import { Twin } from './twin';
import { showView, viewOf } from './views';
import type { WritePanel } from '../write/panel';

const REMEMBERED = 60; // s of history
const PANEL_KEYS = ['g', 'r', 'ArrowLeft', 'ArrowRight']; // pauses a training, not the pendulum

/// The parts of the page and the actions of its buttons.
export class Page {
  readonly world: World;
  readonly clock: Clock;
  readonly agents: Agents;
  readonly scene = new Scene('scene');
  private readonly history = new History(REMEMBERED);
  private readonly settings: Settings;
  private readonly pose: Pose;
  private readonly badge = new Badge();
  private readonly goals = new GoalButtons((name) => this.setGoal(name));
  private readonly dashboard = new Dashboard();
  private readonly map = new MapPanel((where) => this.start(where));
  private readonly ring = new Ring(document.querySelectorAll('.scale.of-ring'));
  readonly learn: LearnPanel;
  write: WritePanel | null = null; // loaded when it is needed first
  private readonly tour: Tour;
  readonly twin: Twin;
  private readonly address = new Address(() => this.hash());
  private readonly agentPanel: AgentPanel;
  private readonly frames = new Frames(
    (seconds) => this.frame(seconds),
    () => !this.paused && (!this.world.resting || this.learn.running),
    () => this.learn.running,
  );
  private view = viewOf(location.hash).name;
  laboratory = ''; // last address of Everything
  private takes = 0; // to drop late answers
  private paused = false;
  private learning = false; // whether view or step is a training
  private mujoco = false; // whether MuJoCo moves the pendulums

  constructor(world: World, agents: Agents) {
    this.world = world;
    this.agents = agents;
    this.clock = new Clock(world);
    this.settings = new Settings(world, () => this.changed());
    this.pose = new Pose(world, () => this.restarted());
    this.twin = new Twin(world, agents, () => {
      this.reset();
      this.changed();
    });
    this.agentPanel = new AgentPanel(agents, {
      took: ({ policy }) => {
        world.policy = policy;
        this.settings.mark(policy);
        this.changed();
      },
      listed: () => this.twin.list(),
      brought: (file) => void this.bring(file),
    });
    this.learn = new LearnPanel(this, agents.list[0]!.id);
    this.tour = new Tour(
      this,
      (id) => agents.has(id),
      () => {
        this.arranged();
        this.setPaused(false);
        this.changed();
      },
    );
    world.onMoment = (moment) => {
      this.history.add(moment);
      this.tour.moment(moment);
    };
    world.onChange = () => this.frames.wake();
  }

  /// The core's memory (bytes), which never shrinks.
  get coreBytes(): number {
    return core().exports.memory.buffer.byteLength;
  }

  get agentTitle(): string {
    return this.agent?.title ?? '';
  }

  private get agent(): Agent | null {
    return this.agentPanel.agent;
  }

  /// Shows the view of an address, with its settings.
  async open(hash = location.hash): Promise<void> {
    if (hash === '#how') {
      if (this.view !== 'everything' || !this.agent) await this.open('#everything');
      this.address.changed();
      return explain();
    }
    const view = viewOf(hash);
    const isOther = this.view !== view.name;
    if (isOther && this.view === 'everything' && this.agent) this.laboratory = this.hash();
    this.view = view.name;
    this.write?.leave();
    if (isOther) scrollTo(0, 0);
    const returns = isOther && hash === '#everything';
    showView(view);
    placeCharts();
    this.setPaused(false);
    if (view.name === 'tour') {
      return this.tour.go(view.step, false, new URLSearchParams(hash.slice(1)).get('ghost') ?? '');
    }
    const learns = view.name === 'learn';
    const writes = view.name === 'write';
    const { shared, problems }: { shared: Partial<Shared>; problems: string[] } =
      learns || writes
        ? { shared: {}, problems: [] }
        : decode(returns ? this.laboratory : hash, RANGES, (id) => this.agents.has(id));
    const unstable = shared.plant ? plantProblem(shared.plant) : '';
    if (unstable) {
      delete shared.plant;
      problems.push(unstable);
    }
    // A policy learned in the page stays on the stage.
    const isAsked = shared.agent && !returns;
    if ((learns || this.tour.number > 0) && this.learn.keeps && !isAsked) {
      Object.assign(shared, { agent: OWN, on: !prefersStill() });
    }
    this.tour.leave();
    this.arranged();
    this.world.agentOn = false;
    if (!(await this.begin(shared))) return;
    if (learns) {
      problems.push(...this.learn.open(hash));
      this.learn.show();
    }
    if (writes) problems.push(...(await this.openWriting(hash)));
    if (problems.length > 0) warn(problemText(problems));
  }

  /// Opens the editor of a controller. Returns the problems of the address.
  private async openWriting(hash: string): Promise<readonly string[]> {
    try {
      const { WritePanel } = await import('../write/panel');
      this.write ??= new WritePanel(this);
    } catch {
      return ['the editor cannot be loaded'];
    }
    return this.view === 'write' ? this.write.open(hash) : [];
  }

  /// Sets agent and settings; all others get their initial values. The pendulum moves on. False if
  /// a later request replaced this one.
  async take(shared: Partial<Shared>): Promise<boolean> {
    const all = { ...BEGINNING, ...shared };
    const taking = ++this.takes;
    await Promise.all([
      this.choose(all.agent ?? this.agents.list[0]!.id),
      this.twin.choose(all.twin),
    ]);
    if (taking !== this.takes) return false;
    this.apply(all);
    return true;
  }

  /// The same as take(), and hangs the pendulum.
  async begin(shared: Partial<Shared>): Promise<boolean> {
    const taken = await this.take(shared);
    if (taken) this.reset();
    return taken;
  }

  /// Whether the final agent and physics are loaded.
  get isComplete(): boolean {
    return this.mujoco && !this.agentPanel.busy;
  }

  /// Moves both pendulums to MuJoCo.
  continueIn(simulator: Mujoco): void {
    this.mujoco = true;
    this.world.continueIn(simulator);
    this.twin.continueIn(simulator.another());
  }

  /// Starts to handle input, and to advance and draw at each frame.
  run(): void {
    this.listen();
    this.frames.start();
  }

  private frame(seconds: number): void {
    this.advance(seconds);
    this.draw();
    if (this.map.busy || this.ring.busy) this.frames.wake();
  }

  /// Advances the pendulum by `seconds` of real time, unless it is paused.
  advance(seconds: number): void {
    if (this.paused || this.clock.advance(seconds)) return;
    this.restarted();
    warn('The pendulum spun too fast to be computed; it hangs again.');
  }

  /// Changes to another agent. If it cannot be loaded, shows the reason, keeps the old one and
  /// returns false.
  choose(id: string): Promise<boolean> {
    return this.agentPanel.choose(id);
  }

  /// Changes to a visitor's own policy and to its training plant. False if it cannot be loaded or a
  /// later request replaced it.
  async openFile(file: File, learned = false): Promise<boolean> {
    if (!(await this.agentPanel.open(file, learned))) return false;
    this.settings.setPlant(this.agent!.policy.plant);
    this.changed();
    return true;
  }

  /// Takes a file that the visitor opened or dropped, and says so.
  private async bring(file: File): Promise<void> {
    if (!(await this.openFile(file))) return;
    note(`${quoted(this.agents.ownName!)} is the agent now. It stays in this browser.`);
  }

  /// Call when a training has begun: the address becomes its recipe.
  learned(): void {
    this.arranged();
    this.changed();
  }

  /// Sets up the stage for the view, step or training.
  private arranged(): void {
    const { step } = document.documentElement.dataset;
    this.learning = this.view === 'learn' || step === 'learn';
    this.map.atRest = this.view !== 'everything';
    if (!this.learning) this.learn.leave();
  }

  /// Keeps a policy learned in the page as the visitor's own, also on the stage if `shown`. True if
  /// it is there now.
  async keepLearned(file: File, shown: boolean): Promise<boolean> {
    if (shown) return this.openFile(file, true);
    await this.agents.open(file, true);
    this.agentPanel.show();
    return false;
  }

  private listen(): void {
    new Hand(
      this.world,
      this.scene,
      () => this.paused,
      () => this.restarted(),
    );
    const toggleAgent = () => this.setAgentOn(!this.world.agentOn);
    const togglePause = () => this.setPaused(!this.paused);
    const step = () => this.step();
    const reset = () => this.reset();
    const shoveLeft = () => this.world.shoveTo(-1);
    const shoveRight = () => this.world.shoveTo(1);
    const actions = { toggleAgent, togglePause, step, reset, shoveLeft, shoveRight };
    listenToKeys(actions, () =>
      ['learn', 'write'].includes(this.view) ? PANEL_KEYS : this.tour.keys,
    );
    button('agent-on', toggleAgent);
    button('pause', togglePause);
    button('step', step);
    button('reset', reset);
    button('shove-left', shoveLeft);
    button('shove-right', shoveRight);
    button('plant-reset', () => this.resetSettings());
    restoreOnScroll();
    button('share', () => {
      const own = this.agent?.id === OWN ? ' (without your policy, which stays with you)' : '';
      void this.address.share(this.hash(true) || 'everything', own);
    });
    button('save', () => save(this.history));
    nameSendButtons();
    listenToFilms(
      () => (this.world.twin ? [this.scene, this.twin.scene] : [this.scene]),
      () => this.title,
    );
    button('own-remove', () => void this.forgetOwn());
    button('theme', changeTheme);
    const speed = element<HTMLInputElement>('speed');
    speed.addEventListener('input', () => this.setSpeed(Number(speed.value)));
    this.agentPanel.listen();
    // The event's address: the page may have written another one since.
    addEventListener('hashchange', ({ newURL }) => void this.open(new URL(newURL).hash));
    listenToExamples(() => void this.open());
    onThemeChange(() => this.repaint());
    const wake = () => this.frames.wake();
    for (const event of ['input', 'change', 'click', 'pointerdown', 'keydown'])
      addEventListener(event, wake);
    this.frames.watch(this.canvases.map((canvas) => canvas.element));
    lightNouns(this.scene, wake);
  }

  private async forgetOwn(): Promise<void> {
    await this.agents.forgetOwn();
    if (this.twin.id === OWN) await this.twin.choose(null);
    if (this.agent?.id === OWN) await this.choose(this.agents.list[0]!.id);
    else this.agentPanel.show();
    element('agent').focus(); // the button is gone
  }

  setAgentOn(on: boolean): void {
    if (!this.agent) return;
    this.world.agentOn = on;
    element('agent-on').ariaPressed = String(on);
    this.changed();
  }

  /// Sets the pose to reach, also during a motion.
  private setGoal(name: GoalName): void {
    this.world.goal = GOALS[name];
    this.changed();
  }

  private setPaused(paused: boolean): void {
    this.paused = paused;
    this.world.drag = null;
    this.clock.settle();
    element('pause').textContent = paused ? 'Resume' : 'Pause';
    this.pose.shown = paused;
    this.frames.wake();
  }

  setSpeed(speed: number): void {
    this.clock.speed = speed;
    element<HTMLInputElement>('speed').value = String(speed);
    element('speed-value').textContent = `${speed}×`;
    this.changed();
  }

  /// One control step, then a pause.
  private step(): void {
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

  /// Sets the map's first quantity.
  resetMap(): void {
    this.map.reset();
  }

  /// Starts from a state with these variables; the others keep their values.
  start(where: Partial<State>): void {
    this.world.reset({ ...this.world.state, ...where });
    this.restarted();
    this.tour.started();
  }

  /// Drops the history after a new start.
  private restarted(): void {
    this.clock.settle();
    this.history.clear();
    this.twin.restarted();
  }

  /// Resets plant, sensors and motor to their initial settings.
  private resetSettings(): void {
    const { agentOn: on, goal } = this.world;
    this.apply({ ...BEGINNING, on, goal: goal.name, speed: this.clock.speed });
  }

  private apply(shared: Shared): void {
    this.settings.setPlant(shared.plant);
    this.settings.setDisturbance(disturbanceOf(shared));
    this.setSpeed(shared.speed);
    this.setGoal(shared.goal);
    this.setAgentOn(shared.on);
  }

  /// The title of a film: what the stage shows.
  private get title(): readonly [string, string] {
    if (this.learning) return this.learn.title;
    if (this.view === 'write') return ['A controller of my own', ''];
    if (this.view === 'tour') return [this.tour.title, ''];
    return [this.agentTitle, this.world.twin ? `and ${element('twin-name').textContent}` : ''];
  }

  /// Call after a setting changed: updates the address.
  private changed(): void {
    if (this.paused) this.world.look();
    this.address.changed();
    this.frames.wake();
  }

  /// The page's state for the address, or for a link to others, who lack the visitor's own policy.
  private hash(forOthers = false): string {
    if (this.tour.number > 0) return this.tour.address;
    if (this.view === 'learn') return this.learn.address;
    if (this.view === 'write') return this.write?.address ?? 'write';
    return encode({
      agent: forOthers && this.agent?.id === OWN ? null : (this.agent?.id ?? null),
      twin: this.twin.id === OWN ? null : this.twin.id,
      on: this.world.agentOn,
      goal: (this.world.target ?? this.world.twin?.target ?? GOALS['up-up']).name,
      speed: this.clock.speed,
      plant: this.world.plant,
      ...this.world.disturbance,
    });
  }

  private get canvases() {
    const { scene, twin, map, dashboard } = this;
    return [scene.canvas, twin.scene.canvas, map.canvas, ...dashboard.canvases];
  }

  private repaint(): void {
    for (const canvas of this.canvases) canvas.forgetColors();
    this.frames.wake();
  }

  private draw(): void {
    const { world } = this;
    const { step } = document.documentElement.dataset;
    this.ring.shown = (this.learning && this.learn.begun) || step === 'map';
    this.ring.follow(world, this.map.valueRange, this.learn.lastTest ?? world.policy);
    this.scene.ring = this.ring.colors;
    const trail = prefersStill() ? [] : this.history.from(world.time - TRAIL_SECONDS);
    this.scene.draw(world, this.clock.state, trail);
    this.twin.draw(this.clock, prefersStill());
    this.tour.follow(world, this.scene);
    this.learn.follow();
    if (this.learning && !prefersStill()) this.scene.ghosts = this.learn.ghosts;
    if (this.paused) this.pose.follow(world.state);
    this.goals.follow(world);
    this.dashboard.draw(world, this.history);
    this.map.draw(world, this.history);
    const caught = this.badge.draw(world, this.paused, this.scene.canvas.element);
    if (caught && !prefersStill()) this.scene.sparks.light();
  }
}
