const system = matchMedia('(prefers-color-scheme: dark)');
const listeners: (() => void)[] = [];

/// Dark for light, or the other way round; until then it is the system's choice.
export function changeTheme(): void {
  const { dataset } = document.documentElement;
  const now = dataset.theme ?? (system.matches ? 'dark' : 'light');
  dataset.theme = now === 'dark' ? 'light' : 'dark';
  for (const listener of listeners) listener();
}

export function onThemeChange(listener: () => void): void {
  listeners.push(listener);
  system.addEventListener('change', listener);
}
