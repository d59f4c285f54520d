/// Text from strangers (a policy file, the list of agents, an address) is shown as one line of
/// bounded length, and never as HTML.

const LONGEST = 60; // characters, of a name

/// `text` in at most `limit` characters. U+FFFD replaces control characters, line breaks and
/// characters that reorder text.
export function printable(text: string, limit = LONGEST): string {
  // Cut twice, first in UTF-16 units, so that a huge text is not split into characters.
  const characters = [...text.slice(0, 2 * limit + 2).replace(/[\p{C}\p{Zl}\p{Zp}]/gu, '\u{fffd}')];
  if (characters.length <= limit) return characters.join('');
  return `${characters.slice(0, limit - 1).join('')}…`;
}

/// printable() in quotation marks, for messages.
export function quoted(text: string): string {
  return `"${printable(text)}"`;
}

/// Whether `text` is a single command line of `./upswing`. Each word is plain or quoted as by the
/// program (ShellQuoted in src/base/text.h), so that a shell runs nothing else when it is pasted.
export function isCommand(text: string): boolean {
  const word = /(?:[\w@%+=:,./-]|'[^'\p{C}\p{Zl}\p{Zp}]*'|\\')+/u.source;
  return text.length <= 2000 && new RegExp(`^\\./upswing train(?: ${word})*$`, 'u').test(text);
}

/// A number's text with a true minus sign, as wide as a digit; no sign if only zeros are left.
export function withMinus(text: string): string {
  return text.replace(/^-(?=[^1-9]*[1-9])/, '−').replace(/^-/, '');
}

/// A message with a full stop, unless it ends with a mark of its own.
export function sentence(text: string): string {
  return /[.?!…]$/.test(text) ? text : `${text}.`;
}
