import { CONTROL_PERIOD, PARAMETERS } from '../pendulum';
import { Recording } from '../learn/course';
import { Policy } from '../policy';
import { BadInput, largerThan, MAX_FILE_BYTES } from '../bad_input';
import { isCommand, printable, quoted } from '../text';
import { signed } from '../view/charts';
import type { Curve } from '../view/charts';
import { fetchBytes } from './fetch';
import { OWN } from './share';
import { forgetFile, recallFile, rememberFile } from './storage';
import type { KeptFile } from './storage';

/// The agents of the page and the visitor's own one.

const LIST = 'agents/agents.json';
const MAX_NAME = 200; // characters, of an ID, a file, an agent
const MAX_ROWS = 100_000; // of a learning curve
const MAX_CHECKPOINTS = 100;

/// An entry of the list, which `upswing export --page` writes.
interface Entry {
  id: string;
  file: string;
  agent: string;
  command: string | null;
  curve: Curve | null;
  checkpoints: CheckpointFile[]; // policies during its training, ending with its own
}

interface CheckpointFile {
  step: number;
  file: string;
}

export interface Agent {
  id: string;
  title: string;
  what: string; // description in plain words
  text: string; // description of its network
  command: string | null;
  curve: Curve | null;
  policy: Policy;
}

/// ID of the shipped policy for any pose.
const ANY_POSE = 'any-pose';

const TITLES = new Map([
  ['d3qn', 'Dueling Double DQN'],
  ['dqn', 'DQN'],
  ['double-dqn', 'Double DQN'],
  ['dueling-dqn', 'Dueling DQN'],
  ['fast', 'Fast: a small network'],
  ['d3qn-adaptive', 'Adaptive Dueling Double DQN'],
  ['d3qn-randomized', 'Randomised Dueling Double DQN'],
  ['sac', 'SAC: any torque'],
  ['sac-fast', 'SAC: a small network'],
  ['ppo', 'PPO: any torque'],
  [ANY_POSE, 'Any pose: you choose'],
]);

/// The agents that lists show first.
const MAIN = ['d3qn', 'fast', 'd3qn-adaptive', 'sac', ANY_POSE];

/// Descriptions of the page's agents, in plain words.
const CAN = 'It swings up and balances the pendulum that it learned with.';
const PLAIN: ReadonlyMap<string, string> = new Map([
  [
    'd3qn',
    `It learned by trial how much reward each of nine torques brings, and takes the best. ${CAN}`,
  ],
  [
    'dqn',
    `The plain method: it learned by trial how much reward each of nine torques brings. ${CAN}`,
  ],
  [
    'double-dqn',
    `DQN that learned with two networks, because a single one expects too much reward. ${CAN}`,
  ],
  [
    'dueling-dqn',
    `DQN that learned separately how good a state is and what each torque adds. ${CAN}`,
  ],
  ['fast', `The same method with a small network, which learns within seconds. ${CAN}`],
  [
    'd3qn-adaptive',
    'It learned on many pendulums and estimates which one it has: it balances other masses, lengths and gravity too.',
  ],
  [
    'd3qn-randomized',
    'It learned on many pendulums and remembers its last steps to tell them apart: it balances many others too.',
  ],
  ['sac', `It learned by trial, from all its past trials, and may use any torque. ${CAN}`],
  ['ppo', `It learned by trial, from its latest trials only, and may use any torque. ${CAN}`],
  [
    ANY_POSE,
    'One network that goes from any pose at rest to any other. Choose the pose under the pendulum.',
  ],
]);

/// Controllers computed from the equations of motion (docs/controllers.md): title and description.
const COMPUTED: ReadonlyMap<string, readonly [string, string]> = new Map([
  [
    'lqr',
    [
      'LQR: only holds',
      'A linear-quadratic regulator, which holds both links upright. It cannot swing them up: pause, and put them there.',
    ],
  ],
  ['energy', ['Energy shaping', 'A formula pumps energy until the regulator (LQR) catches.']],
  [
    'pfl',
    [
      'Partial feedback linearisation',
      'A formula swings the upper link until the regulator (LQR) catches.',
    ],
  ],
  [
    'tvlqr',
    ['TVLQR: a planned swing-up', 'It planned one swing-up and corrects deviations from it.'],
  ],
  [
    'mpc',
    [
      'MPC: always plans',
      'Model predictive control: 50 times a second it plans the next 2.5 s and takes the plan’s first torque.',
    ],
  ],
]);
const NOT_LEARNED =
  'Not learned, but computed from the equations of motion of the unchanged pendulum.';

/// An entry's title: its agent, and its ID if that differs.
function titleOf(entry: Entry): string {
  const { id, agent } = entry;
  const title = TITLES.get(agent) ?? printable(agent);
  return id === agent ? title : `${title}, ${printable(id)}`;
}

/// A description of any policy, in plain words.
function plainly({ controller, seeksAnyPose }: Policy, agent: string): string {
  const { strongest } = controller;
  const torques = `torques up to ${signed(strongest)} N·m`;
  return (
    PLAIN.get(agent) ??
    (seeksAnyPose
      ? `A policy for any pose, with ${torques}. Choose the pose under the pendulum.`
      : `A policy that chooses ${torques}. Run it to see what it can do.`)
  );
}

function describe(policy: Policy): string {
  const randomized = PARAMETERS.some((name) => {
    const [low, high] = policy.trainedRange(name);
    return low < high;
  });
  const { text } = policy.controller;
  return [
    text.charAt(0).toUpperCase() + text.slice(1),
    policy.memory > 0 ? `, remembers ${policy.memory} steps` : '',
    policy.identifies ? ', identifies its pendulum' : '',
    policy.seeksAnyPose ? ', observes the pose to reach' : '',
    Math.abs(policy.trainedPeriod - CONTROL_PERIOD) < 1e-9
      ? ''
      : `, decides every ${Number((1000 * policy.trainedPeriod).toPrecision(3))} ms`,
    randomized ? ', trained on random pendulums' : '',
    policy.isCarried
      ? `, trained on another pendulum of ${Number(policy.trainedSize.toPrecision(3))} m`
      : '',
    '.',
  ].join('');
}

function isNumbers(value: unknown): value is number[] {
  return Array.isArray(value) && value.length <= MAX_ROWS && value.every(Number.isFinite);
}

/// A training's evaluations; null if they are invalid.
export function parseCurve(value: unknown): Curve | null {
  const { step, success_rate, mean_return } = (value ?? {}) as Partial<Record<string, unknown>>;
  if (!isNumbers(step) || !isNumbers(success_rate) || !isNumbers(mean_return)) return null;
  const { length } = step;
  if (length === 0 || success_rate.length !== length || mean_return.length !== length) return null;
  const rises = step.every((n, i) => n > (step[i - 1] ?? 0));
  const shares = success_rate.every((share) => share >= 0 && share <= 1);
  return rises && shares ? { step, success_rate, mean_return } : null;
}

/// A training's checkpoints; none if they are invalid.
function parseCheckpoints(value: unknown): CheckpointFile[] {
  if (!Array.isArray(value) || value.length > MAX_CHECKPOINTS) return [];
  const list = value.map((one) => (one ?? {}) as Partial<Record<keyof CheckpointFile, unknown>>);
  const valid = list.every(
    ({ step, file }, i) =>
      Number.isSafeInteger(step) &&
      (step as number) > Number(list[i - 1]?.step ?? -1) &&
      isName(file),
  );
  return valid ? (list as CheckpointFile[]) : [];
}

function isName(text: unknown): text is string {
  return typeof text === 'string' && text !== '' && text.length <= MAX_NAME;
}

/// A list entry; null if ID, file or agent is missing. All others are optional.
export function parseEntry(value: unknown): Entry | null {
  const given = (value ?? {}) as Partial<Record<keyof Entry, unknown>>;
  const { id, file, agent, command } = given;
  if (!isName(id) || !isName(file) || !isName(agent) || id === OWN) return null;
  // Only a single command line is shown for pasting.
  const shown = typeof command === 'string' && isCommand(command) ? command : null;
  const curve = parseCurve(given.curve);
  return {
    id,
    file,
    agent,
    command: shown,
    curve,
    checkpoints: parseCheckpoints(given.checkpoints),
  };
}

export class Agents {
  private readonly entries: Map<string, Entry>;
  private readonly loaded = new Map<string, Agent>();
  private readonly underWay = new Map<string, Promise<Agent>>();
  private own: KeptFile | null; // the visitor's own policy, perhaps from an earlier visit

  private constructor(entries: Entry[], own: KeptFile | null) {
    this.entries = new Map(entries.map((entry) => [entry.id, entry]));
    this.own = own;
  }

  /// Reads the list of agents and the policy kept in this browser. Throws BadInput.
  static async fetch(): Promise<Agents> {
    const [bytes, own] = await Promise.all([fetchBytes(LIST, MAX_FILE_BYTES), recallFile(OWN)]);
    try {
      const { agents } = JSON.parse(new TextDecoder().decode(bytes)) as { agents: unknown[] };
      const entries = agents.map(parseEntry).filter((entry) => entry !== null);
      if (entries.length > 0) return new Agents(entries, own);
    } catch {
      // reported below
    }
    throw new BadInput(`${LIST} is not a list of agents`);
  }

  /// All agents, by id and title. `main`: whether lists show it before the others.
  get list(): { id: string; title: string; main: boolean }[] {
    const list = [...this.entries.values()].map((entry) => ({
      id: entry.id,
      title: titleOf(entry),
      main: MAIN.includes(entry.id) || !TITLES.has(entry.id), // also a run that the visitor serves
    }));
    for (const [id, [title]] of COMPUTED) {
      if (!this.entries.has(id)) list.push({ id, title, main: false });
    }
    return this.own ? [...list, { id: OWN, title: ownTitle(this.own), main: true }] : list;
  }

  /// Whether an agent has this ID.
  has(id: string): boolean {
    return this.entries.has(id) || COMPUTED.has(id) || (id === OWN && this.own !== null);
  }

  /// The name of the visitor's own file.
  get ownName(): string | null {
    return this.own && printable(this.own.name);
  }

  /// Fetches and checks a policy at its first use. Throws BadInput.
  async get(id: string): Promise<Agent> {
    const known = this.loaded.get(id);
    if (known) return known;
    if (id === OWN && this.own) return this.addOwn(this.own);
    const entry = this.entries.get(id);
    if (!entry) return this.make(id);
    // Requests at the same time share one fetch.
    const fetched = this.underWay.get(id) ?? this.fetchAgent(entry);
    this.underWay.set(id, fetched);
    return fetched.finally(() => this.underWay.delete(id));
  }

  private async fetchAgent(entry: Entry): Promise<Agent> {
    const policy = new Policy(await fetchPolicy(entry.file));
    const { id, command, curve } = entry;
    const what = plainly(policy, id === entry.agent ? id : OWN);
    return this.add({
      ...{ id, title: titleOf(entry), what, text: describe(policy) },
      ...{ command, curve, policy },
    });
  }

  /// Designs a controller. Throws BadInput.
  private make(id: string): Agent {
    const computed = COMPUTED.get(id);
    if (!computed) throw new BadInput(`there is no agent ${quoted(id)}`);
    const [title, how] = computed;
    const command = `./upswing simulate ${id}`;
    const what = `${how} ${NOT_LEARNED}`;
    const policy = new Policy(id);
    return this.add({ id, title, what, text: describe(policy), command, curve: null, policy });
  }

  /// The recorded training of a shipped agent; null if it has none.
  recording(id: string): Recording | null {
    const entry = this.entries.get(id);
    if (!entry?.curve || entry.checkpoints.length === 0) return null;
    return new Recording(titleOf(entry), entry.curve, entry.checkpoints, fetchPolicy);
  }

  /// Whether the visitor's own policy was learned in the page.
  get ownIsLearned(): boolean {
    return this.own?.learned ?? false;
  }

  /// The part of an address with which the visitor's own policy learns again; empty if it was not
  /// learned here, or by an earlier version of the page.
  get ownRecipe(): string {
    return this.own?.recipe ?? '';
  }

  /// Reads and checks a visitor's file, or a policy learned in the page by `recipe` (null: not learned
  /// here). Keeps it in this browser for the next visit, if allowed. Throws BadInput.
  async open(file: File, recipe: string | null = null): Promise<Agent> {
    if (file.size > MAX_FILE_BYTES) throw new BadInput(`it is ${largerThan(MAX_FILE_BYTES)}`);
    const bytes = await file.arrayBuffer().catch(() => {
      throw new BadInput('it cannot be read');
    });
    if (!isSafetensors(bytes)) throw new BadInput('not a valid safetensors file');
    const own: KeptFile = { name: file.name, bytes, learned: recipe !== null };
    if (recipe) own.recipe = recipe;
    const agent = this.addOwn(own);
    this.own = own;
    await rememberFile(OWN, own);
    return agent;
  }

  /// Removes the visitor's own policy, also from this browser.
  async forgetOwn(): Promise<void> {
    this.own = null;
    this.loaded.delete(OWN);
    await forgetFile(OWN);
  }

  private addOwn(own: KeptFile): Agent {
    const policy = new Policy(own.bytes);
    const [what, text] = [plainly(policy, OWN), describe(policy)];
    return this.add({
      id: OWN,
      title: ownTitle(own),
      what,
      text,
      command: null,
      curve: null,
      policy,
    });
  }

  private add(agent: Agent): Agent {
    this.loaded.set(agent.id, agent);
    return agent;
  }
}

/// Whether a file begins as a safetensors file: the length of a header that it can hold, then {.
function isSafetensors(bytes: ArrayBuffer): boolean {
  if (bytes.byteLength < 9) return false;
  const view = new DataView(bytes);
  return view.getBigUint64(0, true) <= bytes.byteLength - 8 && view.getUint8(8) === 0x7b;
}

async function fetchPolicy(file: string): Promise<ArrayBuffer> {
  return (await fetchBytes(`agents/${encodeURIComponent(file)}`, MAX_FILE_BYTES)).buffer;
}

function ownTitle({ name }: KeptFile): string {
  return `${printable(name)} (yours)`;
}
