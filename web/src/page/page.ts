import { core } from '../core';
import { History } from '../history';
import { LearnPanel } from '../learn/panel';
import type { State } from '../pendulum';
import { BadInput } from '../bad_input';
import { quoted } from '../text';
import { LearningCurve } from '../view/charts';
import { Scene, TRAIL_SECONDS } from '../view/scene';
import type { World } from '../world';
import { Address } from './address';
import type { Agent, Agents } from './agents';
import { Clock } from './clock';
import { Dashboard, situation } from './dashboard';
import { button, element, write } from './dom';
import { Hand } from './hand';
import { listenToKeys } from './keys';
import { placeCharts, showStage } from './layout';
import { MapPanel } from './map';
import { hideMessage, warn } from './message';
import { Pose } from './pose';
import { save } from './save';
import { RANGES, Settings } from './settings';
import { BEGINNING, decode, encode, OWN } from './share';
import type { Shared } from './share';
import { changeTheme, onThemeChange } from './theme';
import { Tour } from './tour';
import { Twin } from './twin';
import { showView, viewOf } from './views';

const REMEMBERED = 60; // s of history

/// The parts of the page and what its buttons do.
export class Page {
  readonly world: World;
  readonly clock: Clock;
  readonly agents: Agents;
  readonly scene = new Scene('scene');
  private readonly history = new History(REMEMBERED);
  private readonly settings: Settings;
  private readonly pose: Pose;
  private readonly dashboard = new Dashboard();
  private readonly curve = new LearningCurve();
  private readonly map = new MapPanel((where) => this.start(where));
  readonly learn: LearnPanel;
  private readonly tour: Tour;
  readonly twin: Twin;
  private readonly address = new Address(() => this.hash());
  private readonly still = matchMedia('(prefers-reduced-motion: reduce)');
  private agent: Agent | null = null;
  private requests = 0; // for agents; the last one counts
  private takes = 0; // likewise
  private paused = false;
  private announced = ''; // the last situation that was read out

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
    this.learn = new LearnPanel(this, agents.list[0]!.id);
    this.tour = new Tour(
      this,
      (id) => agents.has(id),
      () => this.changed(),
    );
    world.onMoment = (moment) => this.history.add(moment);
  }

  /// Memory that the core has taken (bytes), which it never gives back.
  get coreBytes(): number {
    return core().exports.memory.buffer.byteLength;
  }

  /// Starts again with the view and the settings of the address.
  async open(hash = location.hash): Promise<void> {
    const view = viewOf(hash);
    showView(view);
    placeCharts();
    this.setPaused(false);
    if (view.name === 'tour') {
      this.learn.pause();
      return this.tour.go(view.step);
    }
    this.tour.leave();
    const { shared, problems } = decode(hash, RANGES);
    if (shared.agent !== null && !this.agents.has(shared.agent)) {
      problems.push(
        shared.agent === OWN
          ? "it was made with somebody's own policy, which is not in it"
          : `unknown agent ${quoted(shared.agent)}`,
      );
      shared.agent = null;
    }
    if (shared.twin !== null && !this.agents.has(shared.twin)) {
      problems.push(`unknown agent ${quoted(shared.twin)}`);
      shared.twin = null;
    }
    this.world.agentOn = false;
    await this.take(shared);
    this.reset();
    if (problems.length === 0) return;
    const more = problems.length > 3 ? `; and ${problems.length - 3} more` : '';
    warn(`Not all of the link could be used: ${problems.slice(0, 3).join('; ')}${more}.`);
  }

  /// Takes agent and settings, all others as at the beginning; the pendulum moves on.
  async take(shared: Partial<Shared>): Promise<void> {
    const all = { ...BEGINNING, ...shared };
    const taking = ++this.takes;
    await Promise.all([
      this.choose(all.agent ?? this.agents.list[0]!.id),
      this.twin.choose(all.twin),
    ]);
    if (taking === this.takes) this.apply(all);
  }

  /// Handles input, then advances and draws at every frame.
  run(): void {
    this.listen();
    let before = performance.now();
    const frame = (now: number) => {
      const seconds = Math.max(0, now - before) / 1000;
      before = now;
      if (!this.paused && !this.clock.advance(seconds)) {
        this.restarted();
        warn('The pendulum spun too fast to be computed; it hangs again.');
      }
      this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  /// Changes to another agent; if it cannot be loaded, says why, keeps the old one and returns false.
  choose(id: string): Promise<boolean> {
    return this.load(() => this.agents.get(id), `Agent ${quoted(id)}`);
  }

  /// Changes to a visitor's own policy and to the plant that it was trained on.
  async openFile(file: File, learned = false): Promise<void> {
    if (!(await this.load(() => this.agents.open(file, learned), quoted(file.name)))) return;
    this.settings.setPlant(this.agent!.policy.plant);
    this.changed();
  }

  /// Keeps a policy that was learned here as the visitor's own.
  keepLearned(file: File): Promise<void> {
    return this.openFile(file, true);
  }

  private async load(get: () => Promise<Agent>, name: string): Promise<boolean> {
    const request = ++this.requests;
    element('agent-text').textContent = 'Loading …';
    try {
      const agent = await get();
      if (request !== this.requests) return false; // another was asked for meanwhile
      this.agent = agent;
      this.world.policy = agent.policy;
      this.settings.mark(agent.policy);
      hideMessage();
    } catch (error) {
      if (!(error instanceof BadInput)) throw error;
      if (request !== this.requests) return false;
      warn(`${name} cannot be used: ${error.message}.`);
      this.showAgent();
      return false;
    }
    this.showAgent();
    this.changed();
    return true;
  }

  private showAgent(): void {
    const options = this.agents.list.map(({ id, title }) => new Option(title, id));
    const select = element<HTMLSelectElement>('agent');
    select.replaceChildren(...options);
    this.twin.list();
    element<HTMLButtonElement>('agent-on').disabled = this.agent === null;
    element('own').hidden = this.agents.ownName === null;
    element('own-name').textContent = this.agents.ownName;
    if (!this.agent) {
      select.prepend(new Option('Choose an agent', '', true, true));
      element('agent-text').textContent = 'There is no agent: its policy could not be loaded.';
      return;
    }
    select.value = this.agent.id;
    element('first-name').textContent = this.agent.title;
    element('agent-text').textContent = this.agent.text;
    element('agent-command').hidden = this.agent.command === null;
    element('agent-command').firstElementChild!.textContent = this.agent.command;
    const step = Number(this.agent.policy.metadata.get('step') ?? NaN);
    element('curve-value').textContent = Number.isFinite(step)
      ? `best after ${step.toLocaleString('en')} steps`
      : '';
    this.drawCurve();
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
    listenToKeys({ toggleAgent, togglePause, step, reset, shoveLeft, shoveRight });
    button('agent-on', toggleAgent);
    button('pause', togglePause);
    button('step', step);
    button('reset', reset);
    button('shove-left', shoveLeft);
    button('shove-right', shoveRight);
    button('plant-reset', () => this.resetSettings());
    button('share', () => {
      const own = this.agent?.id === OWN ? ' (without your policy, which stays with you)' : '';
      void this.address.share(own);
    });
    button('save', () => save(this.history));
    button('own-remove', () => void this.forgetOwn());
    button('theme', changeTheme);
    const speed = element<HTMLInputElement>('speed');
    speed.addEventListener('input', () => this.setSpeed(Number(speed.value)));
    this.listenToAgents();
    // By its own address: meanwhile that of the settings before may have been written.
    addEventListener('hashchange', ({ newURL }) => void this.open(new URL(newURL).hash));
    this.listenToExamples();
    onThemeChange(() => this.repaint());
    new ResizeObserver(() => this.drawCurve()).observe(this.curve.canvas.element);
  }

  private listenToAgents(): void {
    const agent = element<HTMLSelectElement>('agent');
    agent.addEventListener('change', () => void this.choose(agent.value));
    const file = element<HTMLInputElement>('file');
    file.addEventListener('change', () => {
      if (file.files?.[0]) void this.openFile(file.files[0]);
      file.value = '';
    });
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', (event) => {
      event.preventDefault();
      const files = [...(event.dataTransfer?.files ?? [])];
      const dropped = files.find(({ name }) => name.endsWith('.safetensors')) ?? files[0];
      if (dropped) void this.openFile(dropped);
    });
  }

  /// A link to an example scrolls back to the pendulum; the same link again restarts the example.
  private listenToExamples(): void {
    element('explain').addEventListener('click', (event) => {
      const link = (event.target as HTMLElement).closest<HTMLAnchorElement>('a[href^="#"]');
      if (!link) return;
      showStage();
      if (link.hash === location.hash) void this.open();
    });
  }

  private async forgetOwn(): Promise<void> {
    await this.agents.forgetOwn();
    if (this.twin.id === OWN) await this.twin.choose(null);
    if (this.agent?.id === OWN) await this.choose(this.agents.list[0]!.id);
    else this.showAgent();
    element('agent').focus(); // the button is gone
  }

  setAgentOn(on: boolean): void {
    if (!this.agent) return;
    this.world.agentOn = on;
    element('agent-on').ariaPressed = String(on);
    this.changed();
  }

  private setPaused(paused: boolean): void {
    this.paused = paused;
    this.world.drag = null;
    this.clock.settle();
    element('pause').textContent = paused ? 'Resume' : 'Pause';
    this.pose.shown = paused;
  }

  setSpeed(speed: number): void {
    this.clock.speed = speed;
    element<HTMLInputElement>('speed').value = String(speed);
    element('speed-value').textContent = `${speed}×`;
    this.changed();
  }

  /// One control step, after which the page is paused.
  private step(): void {
    this.setPaused(true);
    const valid = this.world.advanceToControl();
    if (!valid) this.restarted();
    this.world.look();
    this.clock.settle();
  }

  /// Of the lower link (kg).
  setMass(mass2: number): void {
    this.settings.setPlant({ ...this.world.plant, mass2 });
    this.changed();
  }

  /// From hanging.
  reset(): void {
    this.world.reset();
    this.restarted();
  }

  /// What the map shows at first.
  resetMap(): void {
    this.map.reset();
  }

  /// From a state with these variables, the others as they are.
  start(where: Partial<State>): void {
    this.world.reset({ ...this.world.state, ...where });
    this.restarted();
  }

  /// After a new start: what happened before is dropped.
  private restarted(): void {
    this.clock.settle();
    this.history.clear();
    this.twin.restarted();
  }

  /// Pendulum, sensors and motor with their initial settings.
  private resetSettings(): void {
    const { agentOn: on } = this.world;
    this.apply({ ...BEGINNING, on, speed: this.clock.speed });
  }

  private apply(shared: Shared): void {
    this.settings.setPlant(shared.plant);
    this.settings.setDisturbance(shared.sensor_noise, shared.delay);
    this.setSpeed(shared.speed);
    this.setAgentOn(shared.on);
  }

  /// After a setting changed: updates the address, so that it can be shared at any time.
  private changed(): void {
    if (this.paused) this.world.look();
    this.address.changed();
  }

  /// What belongs into the address.
  private hash(): string {
    if (this.tour.number > 0) return `tour=${this.tour.number}`;
    if (document.documentElement.dataset.view === 'learn') return 'learn';
    return encode({
      agent: this.agent?.id ?? null,
      twin: this.twin.id === OWN ? null : this.twin.id,
      on: this.world.agentOn,
      speed: this.clock.speed,
      plant: this.world.plant,
      ...this.world.disturbance,
    });
  }

  private repaint(): void {
    const scenes = [this.scene.canvas, this.twin.scene.canvas];
    for (const canvas of [...scenes, this.curve.canvas, ...this.dashboard.canvases]) {
      canvas.forgetColors();
    }
    this.map.canvas.forgetColors();
    this.drawCurve();
  }

  private drawCurve(): void {
    this.curve.draw(this.agent?.curve ?? null);
  }

  private draw(): void {
    const { world } = this;
    const trail = this.still.matches ? [] : this.history.from(world.time - TRAIL_SECONDS);
    this.scene.draw(world, this.clock.state, trail);
    this.twin.draw(this.clock, this.still.matches);
    this.tour.follow(world, this.scene);
    this.learn.follow();
    if (this.paused) this.pose.follow(world.state);
    this.dashboard.draw(world, this.history);
    this.map.draw(world, this.history);
    const { state, text } = situation(world);
    const badge = element('badge');
    write(badge, this.paused ? `paused, ${text}` : text);
    badge.dataset.state = state;
    if (state === this.announced) return;
    if (state === 'balanced' && !this.still.matches) this.scene.sparks.light();
    // Read out when it changes, not at each tenth of a second.
    this.announced = state;
    const words = state === 'balanced' ? 'balanced' : text;
    element('live').textContent = words;
    this.scene.canvas.element.ariaLabel = `The pendulum: ${words}`;
  }
}
