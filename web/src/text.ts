/// Text that strangers wrote (a policy file, the list of agents, an address) is shown as one line of
/// bounded length, and never as HTML.

const LONGEST = 60; // characters, of a name

/// `text` without control characters, characters that reorder text, and line breaks (each stands as
/// U+FFFD), and cut to at most `limit` characters.
export function printable(text: string, limit = LONGEST): string {
  // Cut twice: first in UTF-16 units, so that a huge text is not taken apart as a whole.
  const characters = [...text.slice(0, 2 * limit + 2).replace(/[\p{C}\p{Zl}\p{Zp}]/gu, '\u{fffd}')];
  if (characters.length <= limit) return characters.join('');
  return `${characters.slice(0, limit - 1).join('')}…`;
}

/// The same in quotation marks, for messages.
export function quoted(text: string): string {
  return `"${printable(text)}"`;
}

/// Whether `text` is one command line of `./upswing` in which each word is plain or quoted as the
/// program quotes it (ShellQuoted in src/base/text.h), so that a shell runs nothing else when somebody
/// pastes it.
export function isCommand(text: string): boolean {
  const word = /(?:[\w@%+=:,./-]|'[^'\p{C}\p{Zl}\p{Zp}]*'|\\')+/u.source;
  return text.length <= 2000 && new RegExp(`^\\./upswing train(?: ${word})*$`, 'u').test(text);
}

/// A number's text with a true minus sign, as wide as a digit, and none where only zeros are left.
export function withMinus(text: string): string {
  return text.replace(/^-(?=[^1-9]*[1-9])/, '−').replace(/^-/, '');
}
