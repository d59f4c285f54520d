import { core } from '../core';
import { warn } from '../page/message';
import { agentSettings } from './learner';
import type { LearnSettings, Setting } from './learner';
import { isSwitch } from './recipe';

/// Inputs for settings of a training, with the program's names, ranges and help.

const REWARD = [
  'energy_weight',
  'height_weight',
  'balance_weight',
  'velocity_weight',
  'torque_weight',
];
const KNOBS: Readonly<Record<string, readonly string[]>> = {
  fast: [
    ...['learning_rate', 'gamma', 'n_step', 'epsilon_start', 'epsilon_decay', 'epsilon_end'],
    ...['double', 'dueling', 'layer_norm', 'prioritized', 'mirror', 'any_pose'],
    ...REWARD,
  ],
  'sac-fast': [
    ...['learning_rate', 'gamma', 'n_step', 'updates_per_step'],
    ...['layer_norm', 'twin', 'mirror', 'any_pose'],
    ...REWARD,
  ],
};
/// The named agents that learn in the page.
export const LEARNERS = Object.keys(KNOBS);

export class Knobs {
  private readonly place: HTMLElement;
  private inputs: { input: HTMLInputElement; setting: Setting }[] = [];

  constructor(place: HTMLElement) {
    this.place = place;
  }

  /// The settings that a visitor can change for one of the `LEARNERS`.
  settingsOf(agent: string): readonly Setting[] {
    const settings = agentSettings(core(), agent);
    return [...KNOBS[agent]!, 'reward'].flatMap((name) => settings.get(name) ?? []);
  }

  /// Sets some of the shown settings; the others get the agent's own values.
  set(settings: LearnSettings): void {
    this.reset();
    for (const { input, setting } of this.inputs) {
      const value = settings[setting.name];
      if (value === undefined) continue;
      if (input.type === 'checkbox') input.checked = value === 'true';
      else input.value = value;
    }
  }

  /// Shows the settings of a named agent at its own values.
  show(agent: string): void {
    const numbers = this.settingsOf(agent).filter(({ name }) => name !== 'reward');
    this.inputs = numbers.map((setting) => ({ setting, input: inputOf(setting) }));
    this.place.replaceChildren(
      ...this.inputs.map(({ input, setting }) => {
        const label = document.createElement('label');
        label.title = setting.help;
        label.append(`${setting.name.replaceAll('_', ' ')} `, input);
        return label;
      }),
    );
  }

  /// Back to the agent's own values.
  reset(): void {
    for (const { input } of this.inputs) {
      input.checked = input.defaultChecked;
      input.value = input.defaultValue;
    }
  }

  /// Whether all values are valid. Shows the reason for the first invalid one.
  check(): boolean {
    const wrong = this.inputs.find(({ input }) => !input.checkValidity())?.input;
    if (!wrong) return true;
    wrong.closest('details')!.open = true;
    if (wrong.offsetParent) wrong.reportValidity();
    else warn(`Training settings, ${wrong.name}: ${wrong.validationMessage}`); // in the tour
    return false;
  }

  /// The settings that differ from the agent's own values.
  get changed(): LearnSettings {
    const values = this.inputs.map(({ input, setting }) => {
      const value = input.type === 'checkbox' ? String(input.checked) : input.value;
      return [setting, value] as const;
    });
    const differ = ([{ value: usual }, value]: readonly [Setting, string]) =>
      value !== usual && (isSwitch(usual) || Number(value) !== Number(usual));
    return Object.fromEntries(values.filter(differ).map(([{ name }, value]) => [name, value]));
  }
}

function inputOf({ name, value, low, high, whole }: Setting): HTMLInputElement {
  const input = document.createElement('input');
  input.name = name;
  if (isSwitch(value)) {
    input.type = 'checkbox';
    input.defaultChecked = value === 'true';
    return input;
  }
  input.type = 'number';
  input.required = true;
  input.step = whole ? '1' : 'any';
  if (low !== null) input.min = String(low);
  if (high !== null) input.max = String(high);
  input.defaultValue = value;
  return input;
}
