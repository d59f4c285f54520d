import { note } from './message';

const DELAY = 300; // ms: browsers refuse an address that changes with each pixel of a slider

/// Keeps the address what the page shows, so that it can be shared at any time.
export class Address {
  private readonly hash: () => string;
  private timer = 0;

  /// `hash` tells what belongs behind the #.
  constructor(hash: () => string) {
    this.hash = hash;
  }

  /// After something changed that it tells.
  changed(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.write(), DELAY);
  }

  /// To the clipboard, or on the screen; `without` says what the link leaves out.
  async share(without: string): Promise<void> {
    this.write();
    try {
      await navigator.clipboard.writeText(location.href);
      note(`The link is in the clipboard${without}.`);
    } catch {
      note(`The link${without}: ${location.href}`);
    }
  }

  private write(): void {
    clearTimeout(this.timer);
    history.replaceState(null, '', `#${this.hash()}`);
  }
}
