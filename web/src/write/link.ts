/// A controller in an address: its text as base64url after #write=.

export const LONGEST_TEXT = 2000; // characters

// Unseen characters could hide a part of the code, also those of the writing direction.
const HIDDEN = /[\p{Cc}\p{Cf}\p{Cs}\p{Zl}\p{Zp}]/u;

/// The part of the address after #.
export function encodeText(text: string): string {
  const bytes = String.fromCharCode(...new TextEncoder().encode(text));
  const code = btoa(bytes).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
  return `write=${code}`;
}

/// The text of an address; null if it has none or an invalid one, with the reason in `problems`.
export function decodeText(hash: string): { text: string | null; problems: string[] } {
  const code = new URLSearchParams(hash.replace(/^#/, '')).get('write');
  if (!code) return { text: null, problems: [] };
  const refuse = (problem: string) => ({ text: null, problems: [`write: ${problem}`] });
  if (code.length > 6 * LONGEST_TEXT) return refuse(TOO_LONG);
  let text: string;
  try {
    const bytes = atob(code.replaceAll('-', '+').replaceAll('_', '/'));
    const codes = Uint8Array.from(bytes, (byte) => byte.charCodeAt(0));
    text = new TextDecoder('utf-8', { fatal: true }).decode(codes);
  } catch {
    return refuse('the controller is damaged');
  }
  if (text.length > LONGEST_TEXT) return refuse(TOO_LONG);
  if (HIDDEN.test(text.replace(/[\n\t]/g, ''))) {
    return refuse('the controller has characters that cannot be seen');
  }
  return { text, problems: [] };
}

const TOO_LONG = `expected a controller of at most ${LONGEST_TEXT} characters`;
