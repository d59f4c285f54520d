import type { World } from '../world';
import { situation } from './dashboard';
import { element, write } from './dom';

/// The pendulum's state in words, over it and for screen readers.
export class Badge {
  private announced = '';

  /// Shows the state. True when the pendulum has just become balanced.
  draw(world: World, paused: boolean, scene: HTMLElement): boolean {
    const { state, text, said } = situation(world);
    const badge = element('badge');
    const moving = state === 'swinging' || state === 'free';
    write(badge, !paused ? text : moving ? 'paused' : `paused, ${text}`);
    badge.dataset.state = state;
    if (state === this.announced) return false;
    // Announced when the state changes, not at each tenth of a second.
    this.announced = state;
    element('live').textContent = said;
    scene.ariaLabel = `The pendulum: ${said}`;
    return state === 'balanced';
  }
}
