import { printable } from '../text';
import { button, element } from './dom';

const NOTE_SECONDS = 6;
const LONGEST = 2000; // characters; more than any shared address
let timer = 0;

function show(text: string, kind: 'warning' | 'note'): void {
  clearTimeout(timer);
  element('message-text').textContent = printable(text, LONGEST);
  element('message').dataset.kind = kind;
  element('message').hidden = false;
}

/// Shows a failure until the visitor closes it.
export function warn(text: string): void {
  show(text, 'warning');
}

/// Shows a success for some seconds.
export function note(text: string): void {
  show(text, 'note');
  timer = window.setTimeout(hideMessage, 1000 * NOTE_SECONDS);
}

/// Shows a text for copying by hand until the visitor closes it.
export function showText(text: string): void {
  show(text, 'note');
}

function hideMessage(): void {
  clearTimeout(timer);
  element('message').hidden = true;
}

/// Hides the message if it still shows `text`.
export function withdraw(text: string): void {
  if (element('message-text').textContent === printable(text, LONGEST)) hideMessage();
}

button('message-close', hideMessage);
