import { note, showText } from './message';

/// Copies a text and confirms it as `copied`. Shows the text where the browser refuses.
export async function copy(text: string, copied: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    note(`${copied} is in the clipboard.`);
  } catch {
    showText(`${copied}, to copy by hand: ${text}`);
  }
}
