import { BadInput } from '../bad_input';
import { printable, quoted, sentence } from '../text';
import { LearningCurve } from '../view/charts';
import type { Agent, Agents } from './agents';
import { element } from './dom';
import { note, warn, withdraw } from './message';
import { onThemeChange } from './theme';

const NAME = 40; // characters of a refused file's name

/// Callbacks of the panel.
export interface AgentListener {
  /// Another agent has been loaded.
  took(agent: Agent): void;
  /// The list of agents may have changed.
  listed(): void;
  /// The visitor has brought a file.
  brought(file: File): void;
}

/// The choice of the agent on the stage, its description, and the visitor's own file.
export class AgentPanel {
  agent: Agent | null = null;
  private readonly agents: Agents;
  private readonly listener: AgentListener;
  private readonly curve = new LearningCurve();
  private requests = 0; // to drop late answers
  private said = ''; // the last message about an agent
  /// Whether an agent is loading.
  busy = false;

  constructor(agents: Agents, listener: AgentListener) {
    this.agents = agents;
    this.listener = listener;
  }

  /// Listens to the panel's controls and to dropped files.
  listen(): void {
    const select = element<HTMLSelectElement>('agent');
    select.addEventListener('change', () => void this.choose(select.value));
    const file = element<HTMLInputElement>('file');
    file.addEventListener('change', () => {
      if (file.files?.[0]) this.listener.brought(file.files[0]);
      file.value = '';
    });
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', (event) => {
      event.preventDefault();
      const files = [...(event.dataTransfer?.files ?? [])];
      const dropped = files.find(({ name }) => name.endsWith('.safetensors')) ?? files[0];
      if (dropped) this.listener.brought(dropped);
    });
    onThemeChange(() => {
      this.curve.canvas.forgetColors();
      this.drawCurve();
    });
    new ResizeObserver(() => this.drawCurve()).observe(this.curve.canvas.element);
  }

  /// Changes to another agent. If it cannot be loaded, shows the reason, keeps the old one and
  /// returns false.
  choose(id: string): Promise<boolean> {
    return this.load(() => this.agents.get(id), `Agent ${quoted(id)} cannot be used`);
  }

  /// The same with a visitor's own file, or a policy learned in the page by `recipe`.
  open(file: File, recipe: string | null): Promise<boolean> {
    const refusal = `"${printable(file.name, NAME)}" cannot be used as a policy`;
    return this.load(() => this.agents.open(file, recipe), refusal);
  }

  /// `refusal`: begins the message of a failure.
  private async load(get: () => Promise<Agent>, refusal: string): Promise<boolean> {
    const request = ++this.requests;
    element('agent-what').textContent = 'Loading …';
    this.busy = true;
    try {
      const agent = await get();
      if (request !== this.requests) return false; // a later request replaced it
      this.agent = agent;
      this.busy = false;
      withdraw(this.said);
      this.said = '';
    } catch (error) {
      if (!(error instanceof BadInput)) throw error;
      if (request !== this.requests) return false;
      this.busy = false;
      this.said = sentence(`${refusal}: ${error.message}`);
      warn(this.said);
      this.show();
      return false;
    }
    this.listener.took(this.agent);
    this.show();
    return true;
  }

  /// Shows a note about the agent on the stage, which ends with the next agent.
  announce(text: string): void {
    this.said = text;
    note(text);
  }

  /// Shows the list of agents, and the description of the one on the stage.
  show(): void {
    const { agent, agents } = this;
    const select = element<HTMLSelectElement>('agent');
    select.replaceChildren(...optionsOf(agents.list));
    this.listener.listed();
    element<HTMLButtonElement>('agent-on').disabled = agent === null;
    element('own').hidden = agents.ownName === null;
    document.documentElement.toggleAttribute('data-yours', agents.ownIsLearned);
    element('own-name').textContent = agents.ownName;
    element('agent-details').hidden = agent === null;
    if (!agent) {
      select.prepend(new Option('Choose an agent', '', true, true));
      element('agent-what').textContent = 'There is no agent: its policy could not be loaded.';
      return;
    }
    select.value = agent.id;
    element('first-name').textContent = agent.title;
    element('agent-what').textContent = agent.what;
    element('agent-text').textContent = agent.text;
    element('agent-command').hidden = agent.command === null;
    element('agent-command').firstElementChild!.textContent = agent.command;
    const step = Number(agent.policy.metadata.get('step') ?? NaN);
    element('curve-value').textContent = Number.isFinite(step)
      ? `best after ${step.toLocaleString('en')} steps`
      : '';
    this.drawCurve();
  }

  private drawCurve(): void {
    this.curve.draw(this.agent?.curve ?? null);
  }
}

/// Options of agents: the main ones, then a group of the others.
export function optionsOf(list: Agents['list']): HTMLElement[] {
  const option = ({ id, title }: { id: string; title: string }) => new Option(title, id);
  const others = list.filter(({ main }) => !main).map(option);
  const group = document.createElement('optgroup');
  group.label = 'more';
  group.append(...others);
  return [...list.filter(({ main }) => main).map(option), ...(others.length > 0 ? [group] : [])];
}
