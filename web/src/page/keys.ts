import { element } from './dom';
import { recall, remember } from './storage';

const KEY = 'keys';

export interface Actions {
  toggleAgent(): void;
  togglePause(): void;
  step(): void;
  reset(): void;
  shoveLeft(): void;
  shoveRight(): void;
}

/// The page's keys. A focused control keeps its own keys. Visitors can switch all keys off, because
/// speech input and stray touches press them by accident. `named` returns the only active keys;
/// null: all.
export function listenToKeys(actions: Actions, named: () => readonly string[] | null): void {
  const on = element<HTMLInputElement>('keys');
  on.checked = recall(KEY) !== 'off';
  on.addEventListener('change', () => remember(KEY, on.checked ? 'on' : 'off'));
  const keys = new Map<string, () => void>([
    ['g', actions.toggleAgent],
    [' ', actions.togglePause],
    ['.', actions.step],
    ['r', actions.reset],
    ['ArrowLeft', actions.shoveLeft],
    ['ArrowRight', actions.shoveRight],
  ]);
  addEventListener('keydown', (event) => {
    const target = event.target as HTMLElement;
    if (!on.checked || event.ctrlKey || event.altKey || event.metaKey) return;
    if (target.closest('input, select, textarea, math')) return; // a formula scrolls
    if (event.key === ' ' && target.closest('button, summary')) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const action = keys.get(key);
    if (!action || named()?.includes(key) === false) return;
    event.preventDefault();
    // A held key repeats only steps.
    if (!event.repeat || event.key === '.') action();
  });
}
