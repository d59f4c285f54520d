import type { LearnSettings } from './learner';

/// The agents to race against, and the names of contenders.

/// An agent to race against.
export interface Rival {
  readonly id: string; // in addresses
  readonly name: string;
  readonly agent: string; // named agent that learns in the page
  readonly settings: LearnSettings;
}

export const RIVALS: readonly Rival[] = [
  {
    id: 'dqn',
    name: 'DQN',
    agent: 'fast',
    settings: { double: 'false', dueling: 'false' },
  },
  { id: 'double', name: 'Double DQN', agent: 'fast', settings: { dueling: 'false' } },
  { id: 'dueling', name: 'Dueling DQN', agent: 'fast', settings: { double: 'false' } },
  { id: 'd3qn', name: 'Dueling Double DQN', agent: 'fast', settings: {} },
  { id: 'sac', name: 'SAC', agent: 'sac-fast', settings: {} },
];

/// A contender's name: a rival's name if it has the same settings, otherwise the agent's name and
/// the changed settings.
export function nameOf(agent: string, settings: LearnSettings): string {
  const own = RIVALS.filter((rival) => rival.agent === agent);
  const same = own.find((rival) => sameSettings(rival.settings, settings));
  if (same) return same.name;
  const whole = own.find((rival) => Object.keys(rival.settings).length === 0)!;
  const changes = Object.entries(settings).map(([name, value]) =>
    name === 'reward' ? 'own reward' : `${name} ${value}`,
  );
  return `${whole.name} (${changes.join(', ').replaceAll('_', ' ')})`;
}

function sameSettings(a: LearnSettings, b: LearnSettings): boolean {
  const names = Object.keys({ ...a, ...b });
  return names.every((name) => a[name] === b[name]);
}
