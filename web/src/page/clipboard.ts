import { note, showText } from './message';

/// Copies a text and says what is `copied`; shows the text where the browser refuses.
export async function copy(text: string, copied: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    note(`${copied} is in the clipboard.`);
  } catch {
    showText(`${copied}, to copy by hand: ${text}`);
  }
}
