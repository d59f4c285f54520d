import { forcedColors, systemDark } from '../view/night';
import { recall, remember } from './storage';

/// Dark or light: the system's choice until the visitor makes a choice, which is kept.

const KEY = 'theme';
const { dataset } = document.documentElement;
const listeners: (() => void)[] = [];

const kept = recall(KEY);
if (kept === 'dark' || kept === 'light') dataset.theme = kept;

export function changeTheme(): void {
  const now = dataset.theme ?? (systemDark.matches ? 'dark' : 'light');
  const theme = now === 'dark' ? 'light' : 'dark';
  dataset.theme = theme;
  remember(KEY, theme);
  for (const listener of listeners) listener();
}

/// Calls `listener` after the colours changed, by the button or by the system.
export function onThemeChange(listener: () => void): void {
  listeners.push(listener);
  systemDark.addEventListener('change', listener);
  forcedColors.addEventListener('change', listener);
}
