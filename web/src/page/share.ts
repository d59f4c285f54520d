import { PERFECT } from '../disturbance';
import type { Disturbance } from '../disturbance';
import { GOALS, NOMINAL } from '../pendulum';
import type { GoalName, Parameter, Plant, Range } from '../pendulum';
import { quoted, sentence } from '../text';

/// Stands for a visitor's own policy, which no link can contain.
export const OWN = 'own';

const NOT_IN_IT = 'it does not contain its sender’s own policy';

/// The content of a link: the agent, whether it is on, and all changed settings.
export interface Shared extends Disturbance {
  agent: string | null;
  twin: string | null; // the second pendulum's agent
  on: boolean;
  goal: GoalName; // of an agent for any pose
  speed: number;
  plant: Plant;
}

/// The page's initial state.
export const BEGINNING: Readonly<Shared> = {
  agent: null,
  twin: null,
  on: false,
  goal: 'up-up',
  speed: 1,
  plant: NOMINAL,
  ...PERFECT,
};

/// A link's errors of sensors and motor.
export function disturbanceOf(shared: Shared): Disturbance {
  const { sensor_noise, delay, sensor_latency, encoder_counts } = shared;
  const { velocity_window, velocity_filter } = shared;
  return { sensor_noise, delay, sensor_latency, encoder_counts, velocity_window, velocity_filter };
}

/// A link's numbers, by their names in it.
function numbersOf(shared: Shared): Record<string, number> {
  return { speed: shared.speed, ...shared.plant, ...disturbanceOf(shared) };
}

/// The part of an address after #, with differences from the initial state.
export function encode(shared: Shared): string {
  const fields = new URLSearchParams();
  if (shared.agent) fields.set('agent', shared.agent);
  if (shared.twin) fields.set('twin', shared.twin);
  if (shared.on) fields.set('on', '1');
  if (shared.goal !== BEGINNING.goal) fields.set('goal', shared.goal);
  const beginning = numbersOf(BEGINNING);
  for (const [name, value] of Object.entries(numbersOf(shared))) {
    if (value !== beginning[name]) fields.set(name, String(value));
  }
  return fields.toString();
}

/// Reads such an address. `has`: whether an agent exists. Leaves invalid parts out and reports each
/// in a line of `problems`.
export function decode(
  hash: string,
  ranges: ReadonlyMap<string, Range>,
  has: (agent: string) => boolean,
): { shared: Shared; problems: string[] } {
  const shared: Shared = { ...BEGINNING, plant: { ...NOMINAL } };
  const problems: string[] = [];
  for (const [name, text] of new URLSearchParams(hash.replace(/^#/, ''))) {
    const range = ranges.get(name);
    const value = Number(text);
    if (name === 'agent' || name === 'twin') {
      if (has(text)) shared[name] = text;
      else problems.push(text === OWN ? NOT_IN_IT : `unknown agent ${quoted(text)}`);
    } else if (name === 'on') {
      shared.on = text === '1';
    } else if (name === 'goal') {
      if (Object.hasOwn(GOALS, text)) shared.goal = text as GoalName;
      else problems.push(`goal: expected ${Object.keys(GOALS).join(', ')}, got ${quoted(text)}`);
    } else if (name === 'everything' || name === 'learn') {
      // names the view, without a value
    } else if (!range) {
      problems.push(`unknown setting ${quoted(name)}`);
    } else if (text.trim() === '' || !(value >= range[0] && value <= range[1])) {
      problems.push(`${name}: expected ${range[0]} to ${range[1]}, got ${quoted(text)}`);
    } else if (name === 'delay') {
      shared.delay = Math.round(value);
    } else if (name === 'speed' || name in PERFECT) {
      shared[name as 'speed' | keyof Disturbance] = value;
    } else {
      shared.plant[name as Parameter] = value;
    }
  }
  return { shared, problems };
}

/// A message about problems.
export function problemText(problems: readonly string[]): string {
  const more = problems.length > 3 ? `; and ${problems.length - 3} more` : '';
  return sentence(`Not all of the link could be used: ${problems.slice(0, 3).join('; ')}${more}`);
}
