import { Policy } from '../policy';
import { BadFile, MAX_FILE_BYTES } from '../safetensors';
import type { Curve } from '../view/charts';

/// The agents that the page comes with, and those that a visitor brings.

/// An entry of agents/agents.json, which `upswing export --page` writes.
interface Entry {
  id: string;
  file: string;
  agent: string;
  command: string;
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

const TITLES: Record<string, string> = {
  d3qn: 'Dueling Double DQN',
  dqn: 'DQN',
  'double-dqn': 'Double DQN',
  'dueling-dqn': 'Dueling DQN',
  fast: 'The fast one: a small network',
  'd3qn-randomized': 'Randomised: trained on many pendulums',
};

/// Reads at most so many bytes as a policy can have; `onProgress` hears how many there are.
export async function readBytes(
  response: Response,
  limit: number,
  onProgress: (bytes: number) => void = () => {},
): Promise<Uint8Array<ArrayBuffer>> {
  if (!response.ok) throw new BadFile(`the server says ${response.status}`);
  const pieces: Uint8Array[] = [];
  let bytes = 0;
  const reader = response.body!.getReader();
  for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
    pieces.push(piece.value);
    bytes += piece.value.length;
    onProgress(bytes);
    if (bytes > limit) {
      await reader.cancel();
      throw new BadFile(`it is larger than ${limit / 1024 / 1024} MB`);
    }
  }
  const all = new Uint8Array(bytes);
  let at = 0;
  for (const piece of pieces) {
    all.set(piece, at);
    at += piece.length;
  }
  return all;
}

function describe(policy: Policy): string {
  const { hidden, dueling, head, layer_norm } = policy.network.shape;
  const range = policy.trainedRange('mass1');
  return [
    `${dueling ? 'Dueling' : 'Plain'} network ${[policy.network.shape.inputs, ...hidden].join('-')}`,
    dueling ? ` with heads of ${head}` : '',
    layer_norm ? ', layer normalisation' : '',
    `, ${policy.torques.length} torques`,
    policy.memory > 0 ? `, remembers ${policy.memory} steps` : '',
    range[0] < range[1] ? ', trained on random pendulums' : '',
    '.',
  ].join('');
}

export class Agents {
  private readonly entries: Map<string, Entry>;
  private readonly loaded = new Map<string, Agent>();

  private constructor(entries: Entry[]) {
    this.entries = new Map(entries.map((entry) => [entry.id, entry]));
  }

  /// Reads the list of agents. Throws BadFile.
  static async fetch(): Promise<Agents> {
    const bytes = await readBytes(await fetch('agents/agents.json'), MAX_FILE_BYTES);
    try {
      const { agents } = JSON.parse(new TextDecoder().decode(bytes)) as { agents: Entry[] };
      if (agents.length > 0) return new Agents(agents);
    } catch {
      // told below
    }
    throw new BadFile('agents/agents.json is not a list of agents');
  }

  /// All that there are, by id and title.
  get list(): { id: string; title: string }[] {
    const ids = new Set([...this.entries.keys(), ...this.loaded.keys()]);
    return [...ids].map((id) => ({ id, title: this.loaded.get(id)?.title ?? TITLES[id] ?? id }));
  }

  has(id: string): boolean {
    return this.entries.has(id) || this.loaded.has(id);
  }

  /// Fetches and checks the policy when it is asked for the first time. Throws BadFile.
  async get(id: string): Promise<Agent> {
    const known = this.loaded.get(id);
    if (known) return known;
    const entry = this.entries.get(id);
    if (!entry) throw new BadFile(`there is no agent "${id}"`);
    const response = await fetch(`agents/${encodeURIComponent(entry.file)}`);
    const policy = new Policy((await readBytes(response, MAX_FILE_BYTES)).buffer);
    const { command, curve = null } = entry;
    return this.add({
      id,
      title: TITLES[id] ?? id,
      text: describe(policy),
      command,
      curve,
      policy,
    });
  }

  /// Reads and checks a visitor's file. Throws BadFile.
  async open(file: File): Promise<Agent> {
    if (file.size > MAX_FILE_BYTES) throw new BadFile('it is larger than 16 MB');
    const policy = new Policy(await file.arrayBuffer());
    const title = `${file.name} (yours)`;
    const text = describe(policy);
    return this.add({ id: 'own', title, text, command: null, curve: null, policy });
  }

  private add(agent: Agent): Agent {
    this.loaded.set(agent.id, agent);
    return agent;
  }
}
