import { send } from './clipboard';

const DELAY = 300; // ms: browsers refuse an address that changes with each pixel of a slider

/// The page's address with `hash` after the #.
export function addressOf(hash: string): string {
  return new URL(`#${hash}`, location.href).href;
}

/// Updates the address as the page changes, so that it can be shared at any time.
export class Address {
  private readonly hash: () => string;
  private timer = 0;

  /// `hash` returns the part after the #.
  constructor(hash: () => string) {
    this.hash = hash;
  }

  /// Call after a change of that part.
  changed(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.write(), DELAY);
  }

  /// Shares a link with `hash` after the #. `without`: what the link leaves out, in
  /// words.
  share(hash: string, without: string): Promise<void> {
    return send('', addressOf(hash), `The link${without}`);
  }

  private write(): void {
    clearTimeout(this.timer);
    history.replaceState(null, '', `#${this.hash()}`);
  }
}
