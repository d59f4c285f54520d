import { History } from '../history';
import { BadFile } from '../safetensors';
import { LearningCurve } from '../view/charts';
import { Scene } from '../view/scene';
import { pointOn, World } from '../world';
import type { Agent, Agents } from './agents';
import { Clock } from './clock';
import { Dashboard, situation } from './dashboard';
import { button, element } from './dom';
import { Hand } from './hand';
import { RANGES, Settings } from './settings';
import { decode, encode } from './share';

const REMEMBERED = 60; // s of history

/// What stands on the page, and what its buttons do.
export class Page {
  readonly world: World;
  readonly clock: Clock;
  readonly history = new History(REMEMBERED);
  readonly agents: Agents;
  private readonly settings: Settings;
  private readonly scene = new Scene();
  private readonly dashboard = new Dashboard();
  private readonly curve = new LearningCurve();
  private readonly still = matchMedia('(prefers-reduced-motion: reduce)');
  private agent: Agent | null = null;
  private paused = false;
  private told = ''; // the last situation that was read out

  constructor(world: World, agents: Agents) {
    this.world = world;
    this.agents = agents;
    this.clock = new Clock(world);
    this.settings = new Settings(world, () => this.remember());
    world.onMoment = (moment) => this.history.add(moment);
    new Hand(
      world,
      this.scene,
      () => this.paused,
      () => this.restarted(),
    );
    this.listen();
  }

  /// Begins with what the address says.
  async open(): Promise<void> {
    const { shared, problems } = decode(location.hash, RANGES);
    this.settings.setPlant(shared.plant);
    this.settings.setDisturbance(shared.sensor_noise, shared.delay);
    this.setSpeed(shared.speed);
    this.world.reset();
    if (shared.agent !== null && !this.agents.has(shared.agent)) {
      problems.push(`unknown agent "${shared.agent}"`);
      shared.agent = null;
    }
    await this.choose(shared.agent ?? this.agents.list[0]!.id);
    this.setAgentOn(shared.on && this.agent !== null);
    if (problems.length > 0) this.say(`The link was not understood: ${problems.join('; ')}.`);
  }

  /// Draws, and goes on by itself.
  run(): void {
    let before = performance.now();
    const frame = (now: number) => {
      const seconds = Math.max(0, now - before) / 1000;
      before = now;
      if (!this.paused && !this.clock.advance(seconds)) {
        this.restarted();
        this.say('The simulation blew up with these settings; the pendulum hangs again.');
      }
      this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  /// Takes another agent. One that cannot be had is told, and the old one stays.
  async choose(id: string): Promise<void> {
    await this.take(() => this.agents.get(id), `Agent "${id}"`);
  }

  /// Takes a visitor's own policy.
  async openFile(file: File): Promise<void> {
    await this.take(() => this.agents.open(file), file.name);
  }

  private async take(get: () => Promise<Agent>, name: string): Promise<void> {
    try {
      this.agent = await get();
      this.world.policy = this.agent.policy;
      this.settings.mark(this.agent.policy);
      this.say('');
    } catch (error) {
      if (!(error instanceof BadFile || error instanceof TypeError)) throw error;
      this.say(`${name} cannot be used: ${error.message}.`);
    }
    this.showAgent();
    this.remember();
  }

  private showAgent(): void {
    const options = this.agents.list.map(({ id, title }) => new Option(title, id));
    element<HTMLSelectElement>('agent').replaceChildren(...options);
    if (!this.agent) return;
    element<HTMLSelectElement>('agent').value = this.agent.id;
    element('agent-text').textContent = this.agent.text;
    element('agent-command').hidden = this.agent.command === null;
    element('agent-command').firstElementChild!.textContent = this.agent.command;
    const steps = this.agent.policy.metadata.get('step');
    element('curve-value').textContent = steps
      ? `best after ${Number(steps).toLocaleString('en')} steps`
      : '';
    this.curve.draw(this.agent.curve);
  }

  private listen(): void {
    button('agent-on', () => this.setAgentOn(!this.world.agentOn));
    button('pause', () => this.setPaused(!this.paused));
    button('step', () => this.step());
    button('reset', () => this.reset());
    button('shove-left', () => this.world.shoveTo(-1));
    button('shove-right', () => this.world.shoveTo(1));
    button('plant-reset', () => this.resetSettings());
    button('share', () => void this.share());
    button('save', () => this.save());
    button('theme', () => this.changeTheme());
    const speed = element<HTMLInputElement>('speed');
    speed.addEventListener('input', () => this.setSpeed(Number(speed.value)));
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
      const dropped = event.dataTransfer?.files[0];
      if (dropped) void this.openFile(dropped);
    });
    addEventListener('hashchange', () => void this.open());
    addEventListener('keydown', (event) => this.key(event));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.repaint());
    new ResizeObserver(() => this.curve.draw(this.agent?.curve ?? null)).observe(
      this.curve.canvas.element,
    );
  }

  private key(event: KeyboardEvent): void {
    const actions: Record<string, () => void> = {
      g: () => this.setAgentOn(!this.world.agentOn),
      ' ': () => this.setPaused(!this.paused),
      '.': () => this.step(),
      r: () => this.reset(),
      ArrowLeft: () => this.world.shoveTo(-1),
      ArrowRight: () => this.world.shoveTo(1),
    };
    // Keys that mean something where the focus is are left alone.
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (target.closest('input, select, textarea')) return;
    if (event.key === ' ' && target.closest('button, summary')) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private setAgentOn(on: boolean): void {
    this.world.agentOn = on;
    element('agent-on').ariaPressed = String(on);
    this.remember();
  }

  private setPaused(paused: boolean): void {
    this.paused = paused;
    this.world.drag = null;
    this.clock.settle();
    element('pause').ariaPressed = String(paused);
    element('pause').textContent = paused ? 'Go on' : 'Pause';
  }

  private setSpeed(speed: number): void {
    this.clock.speed = speed;
    element<HTMLInputElement>('speed').value = String(speed);
    element('speed-value').textContent = `${speed}×`;
    this.remember();
  }

  /// One control step, after which the page is paused.
  private step(): void {
    this.setPaused(true);
    this.world.advanceToControl();
    this.clock.settle();
  }

  private reset(): void {
    this.world.reset();
    this.restarted();
  }

  /// The pendulum begins anew: what was before is another story.
  private restarted(): void {
    this.clock.settle();
    this.history.clear();
    this.scene.clearTrail();
  }

  private resetSettings(): void {
    const { shared } = decode('', RANGES);
    this.settings.setPlant(shared.plant);
    this.settings.setDisturbance(shared.sensor_noise, shared.delay);
    this.remember();
  }

  /// Keeps the address up to date, so that it can be shared at any time.
  private remember(): void {
    const own = this.agent?.id === 'own';
    const hash = encode({
      agent: own ? null : (this.agent?.id ?? null),
      on: this.world.agentOn,
      speed: this.clock.speed,
      plant: this.world.plant,
      ...this.world.disturbance,
    });
    history.replaceState(null, '', `#${hash}`);
  }

  private async share(): Promise<void> {
    this.remember();
    try {
      await navigator.clipboard.writeText(location.href);
      this.say('The link is in the clipboard.');
    } catch {
      this.say(`The link is ${location.href}`);
    }
  }

  private save(): void {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([this.history.csv()], { type: 'text/csv' }));
    link.download = 'trajectory.csv';
    link.click();
    URL.revokeObjectURL(link.href);
  }

  private changeTheme(): void {
    const root = document.documentElement;
    const dark = getComputedStyle(root).getPropertyValue('--scheme').trim() === 'dark';
    root.dataset.theme = dark ? 'light' : 'dark';
    this.repaint();
  }

  private repaint(): void {
    for (const canvas of [this.scene.canvas, this.curve.canvas, ...this.dashboard.canvases]) {
      canvas.forgetColors();
    }
    this.curve.draw(this.agent?.curve ?? null);
  }

  private draw(): void {
    const { world } = this;
    if (!this.paused && !this.still.matches) {
      this.scene.addToTrail(pointOn(world.plant, world.state, 2, world.plant.length2).position);
    }
    this.scene.draw(world, this.clock.state);
    this.dashboard.draw(world, this.history);
    const { state, text } = situation(world);
    const badge = element('badge');
    badge.textContent = this.paused ? `paused, ${text}` : text;
    badge.dataset.state = state;
    if (state !== this.told) {
      // Read out when it changes, not at each tenth of a second.
      this.told = state;
      const words = state === 'balanced' ? 'balanced' : text;
      element('live').textContent = words;
      this.scene.canvas.element.ariaLabel = `The pendulum: ${words}`;
    }
  }

  private say(text: string): void {
    element('message').textContent = text;
    element('message').hidden = text === '';
  }
}
