import { copy } from './clipboard';

const DELAY = 300; // ms: browsers refuse an address that changes with each pixel of a slider

/// The page's address with this behind the #.
export function addressOf(hash: string): string {
  return new URL(`#${hash}`, location.href).href;
}

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

  /// A link with this behind the #, to the clipboard or on the screen; `without` says what it leaves out.
  share(hash: string, without: string): Promise<void> {
    return copy(addressOf(hash), `The link${without}`);
  }

  private write(): void {
    clearTimeout(this.timer);
    history.replaceState(null, '', `#${this.hash()}`);
  }
}
