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

/// Whether the system has a sheet of programs to share with.
const canShare = typeof navigator.share === 'function';

/// Opens the system's share sheet with a text and a link, or copies both and confirms them as
/// `copied`.
export async function send(text: string, link: string, copied: string): Promise<void> {
  try {
    if (canShare) return await navigator.share({ text, url: link });
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') return; // by the visitor
  }
  await copy(text ? `${text} ${link}` : link, copied);
}

/// Names the buttons of the class "send" by what they do here.
export function nameSendButtons(): void {
  if (!canShare) return;
  for (const button of document.querySelectorAll('button.send')) {
    button.textContent = button.textContent.replace(/^Copy/, 'Share');
  }
}
