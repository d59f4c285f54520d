import { History } from '../history';
import { BadInput } from '../bad_input';
import type { Policy } from '../policy';
import { quoted, sentence } from '../text';
import { Scene, TRAIL_SECONDS } from '../view/scene';
import type { Simulator } from '../simulator';
import { World } from '../world';
import { optionsOf } from './agent_panel';
import type { Agents } from './agents';
import type { Clock } from './clock';
import { situation } from './dashboard';
import { element, write } from './dom';
import { warn } from './message';

/// A second pendulum next to the first, with its own agent and the same start, shoves and sliders.
export class Twin {
  id: string | null = null; // of its agent; null: no second pendulum
  readonly scene = new Scene('twin-scene');
  private readonly first: World;
  private readonly agents: Agents;
  private readonly world: World;
  private readonly history = new History(TRAIL_SECONDS);
  private readonly select = element<HTMLSelectElement>('twin');
  private requests = 0; // to drop late answers

  /// `onChange`: called when the visitor has chosen its agent.
  constructor(first: World, agents: Agents, onChange: () => void) {
    this.first = first;
    this.agents = agents;
    this.world = new World(first.simulator.another());
    this.world.onMoment = (moment) => this.history.add(moment);
    this.select.addEventListener('change', () => {
      void this.choose(this.select.value || null).then(onChange);
    });
    this.list();
  }

  get policy(): Policy | null {
    return this.world.policy;
  }

  /// Lists the agents for the choice.
  list(): void {
    this.select.replaceChildren(new Option('none', ''), ...optionsOf(this.agents.list));
    this.select.value = this.id ?? '';
  }

  /// Takes an agent, or none. If it cannot be loaded, shows the reason.
  async choose(id: string | null): Promise<void> {
    const request = ++this.requests;
    try {
      const agent = id === null ? null : await this.agents.get(id);
      if (request !== this.requests) return;
      this.id = id;
      this.world.policy = agent?.policy ?? null;
    } catch (error) {
      if (!(error instanceof BadInput)) throw error;
      if (request !== this.requests) return;
      warn(sentence(`Agent ${quoted(id!)} cannot be used: ${error.message}`));
    }
    this.select.value = this.id ?? '';
    this.place(this.agents.list.find((one) => one.id === this.id)?.title ?? '');
  }

  /// Takes a policy outside the list of agents, or none.
  show(policy: Policy | null, name: string): void {
    ++this.requests;
    this.id = null;
    this.select.value = '';
    this.world.policy = policy;
    this.place(name);
  }

  /// Gives it another policy outside the list while it moves on.
  change(policy: Policy, name: string): void {
    if (!this.world.policy) return this.show(policy, name);
    this.world.policy = policy;
    write(element('twin-name'), name);
  }

  /// Begins in the state of the first one, if there is a policy.
  private place(name: string): void {
    const absent = this.world.policy === null;
    this.first.twin = absent ? null : this.world;
    this.world.plant = this.first.plant;
    this.world.goal = this.first.goal;
    this.world.reset(this.first.state);
    this.restarted();
    element('twin-box').hidden = absent;
    element('twin-name').textContent = name;
  }

  /// Continues in another engine.
  continueIn(simulator: Simulator): void {
    this.world.continueIn(simulator);
  }

  /// Drops the history after a new start.
  restarted(): void {
    this.history.clear();
  }

  /// Whether another drawing would show something new.
  stirs(clock: Clock): boolean {
    const state = clock.twinState;
    return state !== null && this.scene.stirs(this.world, state);
  }

  draw(clock: Clock, still: boolean): void {
    const state = clock.twinState;
    if (!state) return;
    const { world, history, scene } = this;
    scene.draw(world, state, still ? [] : history.from(world.time - TRAIL_SECONDS));
    const { state: what, text, said } = situation(world);
    const badge = element('twin-badge');
    write(badge, text);
    badge.dataset.state = what;
    scene.canvas.element.ariaLabel = `The other pendulum: ${said}`;
  }
}
