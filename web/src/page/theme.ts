/// Dark or light: the system's choice, until the visitor makes another, which is kept.

const KEY = 'upswing-theme';
const system = matchMedia('(prefers-color-scheme: dark)');
const { dataset } = document.documentElement;
const listeners: (() => void)[] = [];

/// Browsers may forbid a page to keep anything.
function storage<T>(use: (store: Storage) => T): T | null {
  try {
    return use(localStorage);
  } catch {
    return null;
  }
}

const kept = storage((store) => store.getItem(KEY));
if (kept === 'dark' || kept === 'light') dataset.theme = kept;

export function changeTheme(): void {
  const now = dataset.theme ?? (system.matches ? 'dark' : 'light');
  const theme = now === 'dark' ? 'light' : 'dark';
  dataset.theme = theme;
  storage((store) => store.setItem(KEY, theme));
  for (const listener of listeners) listener();
}

export function onThemeChange(listener: () => void): void {
  listeners.push(listener);
  system.addEventListener('change', listener);
}
