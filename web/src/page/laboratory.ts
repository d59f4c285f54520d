import type { History } from '../history';
import { GOALS, PLANT_LIMITS } from '../pendulum';
import type { GoalName, Parameter, Plant, State } from '../pendulum';
import { quoted } from '../text';
import { AgentPanel } from './agent_panel';
import type { Agent, Agents } from './agents';
import { Dashboard } from './dashboard';
import { button, element } from './dom';
import { GoalButtons } from './goals';
import { MapPanel } from './map';
import { Ring } from './ring';
import { Settings } from './settings';
import { BEGINNING, disturbanceOf, OWN } from './share';
import type { Shared } from './share';
import type { Slider } from './sliders';
import type { PendulumStage } from './stage';

/// A policy that was learned in the page, and the part of an address with which it learns again.
export interface Learned {
  readonly file: File;
  readonly recipe: string;
}

/// The controls of the pendulum on the stage (agent, goal, plant, sensors, motor), and its charts.
export class Laboratory {
  private readonly stage: PendulumStage;
  private readonly agents: Agents;
  private readonly agentPanel: AgentPanel;
  private readonly settings: Settings;
  private readonly goals = new GoalButtons((name) => this.setGoal(name));
  private readonly dashboard = new Dashboard();
  private readonly map: MapPanel;
  private readonly ring = new Ring(document.querySelectorAll('.scale.of-ring'));
  private takes = 0; // to drop late answers

  /// `start`: starts from a point of the map.
  constructor(stage: PendulumStage, agents: Agents, start: (where: Partial<State>) => void) {
    this.stage = stage;
    this.agents = agents;
    this.map = new MapPanel(start);
    this.settings = new Settings(stage.world, () => stage.changed());
    this.agentPanel = new AgentPanel(agents, {
      took: ({ policy }) => {
        stage.world.policy = policy;
        this.settings.mark(policy);
        stage.changed();
      },
      listed: () => stage.twin.list(),
      brought: (file) => void this.bring(file),
    });
  }

  /// The agent on the stage.
  get agent(): Agent | null {
    return this.agentPanel.agent;
  }

  /// Whether an agent is loading.
  get loading(): boolean {
    return this.agentPanel.busy;
  }

  /// Whether a map is still to be computed.
  get computing(): boolean {
    return this.map.busy || this.ring.busy;
  }

  /// Whether a chart that changes all the time is in sight.
  get chartsInSight(): boolean {
    return this.map.canvas.shown || this.dashboard.inSight;
  }

  get canvases() {
    return [this.map.canvas, ...this.dashboard.canvases];
  }

  /// Starts to handle input.
  listen(): void {
    button('agent-on', () => this.toggleAgent());
    button('plant-reset', () => this.resetSettings());
    button('own-remove', () => void this.forgetOwn());
    this.agentPanel.listen();
  }

  /// Sets agent and settings; all others get their initial values. The pendulum moves on. False if
  /// a later request replaced this one.
  async take(shared: Partial<Shared>): Promise<boolean> {
    const all = { ...BEGINNING, ...shared };
    const taking = ++this.takes;
    await Promise.all([
      this.choose(all.agent ?? this.agents.list[0]!.id),
      this.stage.twin.choose(all.twin),
    ]);
    if (taking !== this.takes) return false;
    this.apply(all);
    return true;
  }

  /// The same as take(), and hangs the pendulum.
  async begin(shared: Partial<Shared>): Promise<boolean> {
    const taken = await this.take(shared);
    if (taken) this.stage.reset();
    return taken;
  }

  /// Changes to another agent. If it cannot be loaded, shows the reason, keeps the old one and
  /// returns false.
  choose(id: string): Promise<boolean> {
    return this.agentPanel.choose(id);
  }

  /// Changes to a visitor's own policy and to its training plant. False if it cannot be loaded or a
  /// later request replaced it.
  async openFile(file: File, recipe: string | null = null): Promise<boolean> {
    if (!(await this.agentPanel.open(file, recipe))) return false;
    const { plant, trainedSize } = this.agent!.policy;
    const [low, high] = PLANT_LIMITS.size;
    this.settings.setPlant({ ...plant, size: Math.min(Math.max(trainedSize, low), high) });
    this.stage.changed();
    return true;
  }

  /// Keeps a policy learned in the page as the visitor's own, also on the stage if `shown`. True if
  /// it is there now.
  async keepLearned({ file, recipe }: Learned, shown: boolean): Promise<boolean> {
    if (shown) return this.openFile(file, recipe);
    await this.agents.open(file, recipe);
    this.agentPanel.show();
    return false;
  }

  setAgentOn(on: boolean): void {
    if (!this.agent) return;
    this.stage.world.agentOn = on;
    element('agent-on').ariaPressed = String(on);
    this.stage.changed();
  }

  toggleAgent(): void {
    this.setAgentOn(!this.stage.world.agentOn);
  }

  /// Makes a slider of the plant with this ID.
  plantSlider(name: Parameter | 'size', id: string): Slider {
    return this.settings.plantSlider(name, id);
  }

  setPlant(plant: Plant): void {
    this.settings.setPlant(plant);
    this.stage.changed();
  }

  /// Sets the map's first quantity.
  resetMap(): void {
    this.map.reset();
  }

  /// Whether the map starts with states at rest.
  set mapAtRest(atRest: boolean) {
    this.map.atRest = atRest;
  }

  /// The stage's settings for the address, or for a link to others, who lack the visitor's own policy.
  shared(forOthers: boolean): Shared {
    const { clock, twin, world } = this.stage;
    return {
      agent: forOthers && this.agent?.id === OWN ? null : (this.agent?.id ?? null),
      twin: twin.id === OWN ? null : twin.id,
      on: world.agentOn,
      goal: (world.target ?? world.twin?.target ?? GOALS['up-up']).name,
      speed: clock.speed,
      plant: world.plant,
      ...world.disturbance,
    };
  }

  /// Colours of the value around the pendulum. They are computed again when `version` changes.
  ringColors(shown: boolean, version: object | null): readonly string[] {
    this.ring.shown = shown;
    this.ring.follow(this.stage.world, this.map.valueRange, version);
    return this.ring.colors;
  }

  /// Draws all charts.
  draw(history: History): void {
    const { world } = this.stage;
    this.goals.follow(world);
    this.dashboard.draw(world, history);
    this.map.draw(world, history);
  }

  /// Takes a file that the visitor opened or dropped, and says so.
  private async bring(file: File): Promise<void> {
    if (!(await this.openFile(file))) return;
    const { isCarried, trainedSize } = this.agent!.policy;
    const length = Number(trainedSize.toPrecision(2));
    const carried = isCarried
      ? ` It learned on another pendulum, ${length} m long. It moves the page’s at that size.`
      : '';
    const name = quoted(this.agents.ownName!);
    this.agentPanel.announce(`${name} is the agent now. It stays in this browser.${carried}`);
  }

  private async forgetOwn(): Promise<void> {
    const { twin } = this.stage;
    await this.agents.forgetOwn();
    if (twin.id === OWN) await twin.choose(null);
    if (this.agent?.id === OWN) await this.choose(this.agents.list[0]!.id);
    else this.agentPanel.show();
    element('agent').focus(); // the button is gone
  }

  /// Sets the pose to reach, also during a motion.
  setGoal(name: GoalName): void {
    this.stage.world.goal = GOALS[name];
    this.stage.changed();
  }

  /// Resets plant, sensors and motor to their initial settings.
  private resetSettings(): void {
    const { clock, world } = this.stage;
    const { agentOn: on, goal } = world;
    this.apply({ ...BEGINNING, on, goal: goal.name, speed: clock.speed });
  }

  private apply(shared: Shared): void {
    this.settings.setPlant(shared.plant);
    this.settings.setDisturbance(disturbanceOf(shared));
    this.stage.setSpeed(shared.speed);
    this.setGoal(shared.goal);
    this.setAgentOn(shared.on);
  }
}
