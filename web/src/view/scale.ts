import type { Quantity } from '../map';
import { signed } from './charts';
import { COLORS } from './map';

/// The legend of the map: a bar of its colours between two numbers.
export class Scale {
  private readonly place: HTMLElement;
  private readonly parts = ['span', 'span', 'i', 'span'].map((tag) => document.createElement(tag));

  constructor(place: HTMLElement) {
    this.place = place;
    place.replaceChildren(...this.parts);
    this.show('value', null);
  }

  /// `ends`: smallest and largest value; null: unknown, and the legend is hidden. `unit`: of torques.
  show(quantity: Quantity, ends: readonly [number, number] | null, unit = 'N·m'): void {
    const [name, low, bar, high] = this.parts as [
      HTMLElement,
      HTMLElement,
      HTMLElement,
      HTMLElement,
    ];
    const colors = COLORS[quantity].map((color) => `rgb(${color.join(' ')})`);
    bar.style.background = `linear-gradient(to right, ${colors.join()})`;
    name.textContent = quantity === 'value' ? 'expected reward' : `torque, ${unit}`;
    [low.textContent, high.textContent] = (ends ?? [0, 0]).map(signed) as [string, string];
    this.place.style.visibility = ends ? '' : 'hidden';
  }
}
