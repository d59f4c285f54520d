import type { World } from '../world';
import { situation } from './dashboard';
import { element, write } from './dom';

/// What the pendulum does, in words: over it, and read out when it changes.
export class Badge {
  private announced = '';

  /// True when it has become balanced.
  draw(world: World, paused: boolean, scene: HTMLElement): boolean {
    const { state, text } = situation(world);
    const badge = element('badge');
    const moving = state === 'swinging' || state === 'free';
    write(badge, !paused ? text : moving ? 'paused' : `paused, ${text}`);
    badge.dataset.state = state;
    if (state === this.announced) return false;
    // Not at each tenth of a second.
    this.announced = state;
    const words = state === 'balanced' ? 'balanced' : text;
    element('live').textContent = words;
    scene.ariaLabel = `The pendulum: ${words}`;
    return state === 'balanced';
  }
}
