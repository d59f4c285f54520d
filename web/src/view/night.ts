/// The system's preferences for colours.

export const systemDark = matchMedia('(prefers-color-scheme: dark)');
export const forcedColors = matchMedia('(forced-colors: active)');

/// Whether the page is dark, by the visitor's choice or the system's. Never with forced colours.
export function isNight(): boolean {
  const { theme } = document.documentElement.dataset;
  return !forcedColors.matches && (theme ? theme === 'dark' : systemDark.matches);
}
