import { quoted } from '../text';
import type { LearnSettings, Setting } from './learner';
import { RIVALS } from './rivals';

/// A recipe gives the same agent, bit for bit, in any browser.
export interface Recipe {
  agent: string;
  seed: number;
  settings: LearnSettings; // only changes of the agent's own settings
  rival?: string | undefined; // ID of an agent to race against
}

export const LARGEST_SEED = 1e9;

/// The part of an address after #, such as learn=fast&seed=42&balance_weight=0.
export function encodeRecipe({ agent, seed, settings, rival }: Recipe): string {
  const fields = { learn: agent, seed: String(seed), ...settings, ...(rival ? { rival } : {}) };
  return new URLSearchParams(fields).toString();
}

/// Reads such an address. Null if it names none of the `agents` that can learn here. `settingsOf`
/// returns the settings of an agent that a recipe may change. Reports invalid parts in `problems`
/// and leaves them out.
export function decodeRecipe(
  hash: string,
  agents: readonly string[],
  settingsOf: (agent: string) => readonly Setting[],
): { recipe: Recipe | null; problems: string[] } {
  const fields = new URLSearchParams(hash.replace(/^#/, ''));
  const agent = fields.get('learn');
  if (!agent) return { recipe: null, problems: [] };
  if (!agents.includes(agent)) {
    const problem = `learn: expected ${agents.join(' or ')}, got ${quoted(agent)}`;
    return { recipe: null, problems: [problem] };
  }
  const known = settingsOf(agent);
  const problems: string[] = [];
  const settings: Record<string, string> = {};
  let seed = 1;
  let rival: string | undefined;
  for (const [name, text] of fields) {
    if (name === 'learn') continue;
    if (name === 'rival' && RIVALS.some(({ id }) => id === text)) {
      rival = text;
      continue;
    }
    const range = name === 'seed' ? SEED : known.find((one) => one.name === name);
    const problem = range
      ? problemOf(range, text)
      : name === 'rival'
        ? `rival: expected ${RIVALS.map(({ id }) => id).join(', ')}, got ${quoted(text)}`
        : `unknown setting ${quoted(name)}`;
    if (problem) problems.push(problem);
    else if (name === 'seed') seed = Number(text);
    else settings[name] = text;
  }
  return { recipe: { agent, seed, settings, ...(rival ? { rival } : {}) }, problems };
}

const LONGEST_REWARD = 1000; // characters, as in the program

const SEED = { name: 'seed', value: '1', low: 0, high: LARGEST_SEED, whole: true };

/// Why a setting refuses a value; empty if it accepts it.
function problemOf(
  setting: Pick<Setting, 'name' | 'value' | 'low' | 'high' | 'whole'>,
  text: string,
): string {
  const { name, value, low, high, whole } = setting;
  if (name === 'reward') {
    const fits = text.length <= LONGEST_REWARD && /^[ -~]+$/.test(text);
    return fits ? '' : `reward: expected 1 to ${LONGEST_REWARD} characters of an expression`;
  }
  if (isSwitch(value)) {
    return isSwitch(text) ? '' : `${name}: expected true or false, got ${quoted(text)}`;
  }
  const number = text.trim() === '' ? NaN : Number(text);
  const within = number >= (low ?? -Infinity) && number <= (high ?? Infinity);
  if (within && Number.isFinite(number) && (!whole || Number.isInteger(number))) return '';
  const range = low !== null && high !== null ? ` from ${low} to ${high}` : '';
  return `${name}: expected a ${whole ? 'whole ' : ''}number${range}, got ${quoted(text)}`;
}

/// Whether a setting is true or false instead of a number.
export function isSwitch(value: string): boolean {
  return value === 'true' || value === 'false';
}
