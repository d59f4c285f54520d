import { NOMINAL } from '../pendulum';
import type { Parameter } from '../pendulum';
import { Policy } from '../policy';
import { BadInput, MAX_FILE_BYTES } from '../safetensors';
import type { Curve } from '../view/charts';
import { OWN } from './share';

/// The agents that the page comes with, and those that a visitor brings.

/// An entry of agents/agents.json, which `upswing export --page` writes.
interface Entry {
  id: string;
  file: string;
  agent: string;
  command?: string;
  curve?: Curve;
}

export interface Agent {
  id: string;
  title: string;
  text: string;
  command: string | null;
  curve: Curve | null;
  policy: Policy;
}

const TITLES = new Map([
  ['d3qn', 'Dueling Double DQN'],
  ['dqn', 'DQN'],
  ['double-dqn', 'Double DQN'],
  ['dueling-dqn', 'Dueling DQN'],
  ['fast', 'Fast: a small network'],
  ['d3qn-randomized', 'Randomised Dueling Double DQN'],
]);

/// Throws BadInput if nobody answers.
export async function fetchFrom(address: string): Promise<Response> {
  try {
    return await fetch(address);
  } catch {
    throw new BadInput(`${address} cannot be fetched`);
  }
}

/// Reads at most `limit` bytes; `onProgress` hears how many there are. Throws BadInput.
export async function readBytes(
  response: Response,
  limit: number,
  onProgress: (bytes: number) => void = () => {},
): Promise<Uint8Array<ArrayBuffer>> {
  if (!response.ok) throw new BadInput(`${response.url}: the server says ${response.status}`);
  const pieces: Uint8Array<ArrayBuffer>[] = [];
  let bytes = 0;
  const reader = response.body!.getReader();
  const next = () =>
    reader.read().catch(() => {
      throw new BadInput('the connection broke off');
    });
  for (let piece = await next(); !piece.done; piece = await next()) {
    pieces.push(piece.value);
    bytes += piece.value.length;
    onProgress(bytes);
    if (bytes > limit) {
      await reader.cancel();
      throw new BadInput(`it is larger than ${limit / 1024 / 1024} MB`);
    }
  }
  return new Uint8Array(await new Blob(pieces).arrayBuffer());
}

/// A title for an entry: that of its agent, and its ID if that says more.
function titleOf({ id, agent }: Entry): string {
  const title = TITLES.get(agent) ?? agent;
  return id === agent ? title : `${title}, ${id}`;
}

function describe(policy: Policy): string {
  const { inputs, hidden, dueling, head, layer_norm } = policy.network.shape;
  const randomized = (Object.keys(NOMINAL) as Parameter[]).some((name) => {
    const [low, high] = policy.trainedRange(name);
    return low < high;
  });
  return [
    `${dueling ? 'Dueling' : 'Plain'} network ${[inputs, ...hidden].join('-')}`,
    dueling ? ` with heads of ${head}` : '',
    layer_norm ? ', layer normalisation' : '',
    `, ${policy.torques.length} torques`,
    policy.memory > 0 ? `, remembers ${policy.memory} steps` : '',
    randomized ? ', trained on random pendulums' : '',
    '.',
  ].join('');
}

/// What cannot be fetched is told like what is broken.
async function fetchBytes(address: string): Promise<Uint8Array<ArrayBuffer>> {
  return readBytes(await fetchFrom(address), MAX_FILE_BYTES);
}

export class Agents {
  private readonly entries: Map<string, Entry>;
  private readonly loaded = new Map<string, Agent>();

  private constructor(entries: Entry[]) {
    const others = entries.filter(({ id }) => id !== OWN);
    this.entries = new Map(others.map((entry) => [entry.id, entry]));
  }

  /// Reads the list of agents. Throws BadInput.
  static async fetch(): Promise<Agents> {
    const bytes = await fetchBytes('agents/agents.json');
    try {
      const { agents } = JSON.parse(new TextDecoder().decode(bytes)) as { agents: Entry[] };
      if (agents.length > 0) return new Agents(agents);
    } catch {
      // told below
    }
    throw new BadInput('agents/agents.json is not a list of agents');
  }

  /// All that there are, by id and title.
  get list(): { id: string; title: string }[] {
    const list = [...this.entries.values()].map((entry) => ({
      id: entry.id,
      title: titleOf(entry),
    }));
    const own = this.loaded.get(OWN);
    return own ? [...list, { id: OWN, title: own.title }] : list;
  }

  /// Of an agent that a link may name.
  has(id: string): boolean {
    return this.entries.has(id);
  }

  /// Fetches and checks the policy when it is asked for the first time. Throws BadInput.
  async get(id: string): Promise<Agent> {
    const known = this.loaded.get(id);
    if (known) return known;
    const entry = this.entries.get(id);
    if (!entry) throw new BadInput(`there is no agent "${id}"`);
    const { buffer } = await fetchBytes(`agents/${encodeURIComponent(entry.file)}`);
    const policy = new Policy(buffer);
    const { command = null, curve = null } = entry;
    const title = titleOf(entry);
    return this.add({ id, title, text: describe(policy), command, curve, policy });
  }

  /// Reads and checks a visitor's file. Throws BadInput.
  async open(file: File): Promise<Agent> {
    if (file.size > MAX_FILE_BYTES) throw new BadInput('it is larger than 16 MB');
    const bytes = await file.arrayBuffer().catch(() => {
      throw new BadInput('it cannot be read');
    });
    const policy = new Policy(bytes);
    const title = `${file.name} (yours)`;
    const text = describe(policy);
    return this.add({ id: OWN, title, text, command: null, curve: null, policy });
  }

  private add(agent: Agent): Agent {
    this.loaded.set(agent.id, agent);
    return agent;
  }
}
