export interface Actions {
  toggleAgent(): void;
  togglePause(): void;
  step(): void;
  reset(): void;
  shoveLeft(): void;
  shoveRight(): void;
}

/// The page by keyboard. Keys that mean something where the focus is are left alone.
export function listenToKeys(actions: Actions): void {
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
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (target.closest('input, select, textarea')) return;
    if (event.key === ' ' && target.closest('button, summary')) return;
    const action = keys.get(event.key.length === 1 ? event.key.toLowerCase() : event.key);
    if (!action) return;
    event.preventDefault();
    // Of a key that is held down, steps alone repeat.
    if (!event.repeat || event.key === '.') action();
  });
}
