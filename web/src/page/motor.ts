import type { World } from '../world';
import { button, element } from './dom';

/// The visitor as the motor: full torque while an arrow is held, on the keyboard or on the page.
export class MotorKeys {
  private readonly world: World;
  private on = false;

  constructor(world: World) {
    this.world = world;
    // A negative torque moves the hanging pendulum to the right.
    for (const [id, key, sign] of [
      ['motor-left', 'ArrowLeft', 1],
      ['motor-right', 'ArrowRight', -1],
    ] as const) {
      const held = button(id, () => {});
      held.addEventListener('pointerdown', (event) => {
        held.setPointerCapture(event.pointerId);
        held.dataset.held = '';
        this.turn(sign);
      });
      for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
        held.addEventListener(end, () => {
          delete held.dataset.held;
          this.turn(0);
        });
      }
      held.addEventListener('contextmenu', (event) => event.preventDefault()); // of a long touch
      const isHeld = ({ key: pressed, target }: KeyboardEvent) =>
        (pressed === key && element<HTMLInputElement>('keys').checked) ||
        (target === held && (pressed === ' ' || pressed === 'Enter'));
      const listen = (type: 'keydown' | 'keyup', turn: number) =>
        addEventListener(type, (event) => {
          if (!this.on || !isHeld(event) || event.ctrlKey || event.altKey || event.metaKey) return;
          event.preventDefault();
          this.turn(turn);
        });
      listen('keydown', sign);
      listen('keyup', 0);
    }
    addEventListener('blur', () => this.turn(0));
  }

  /// Whether the arrows turn the motor.
  set enabled(on: boolean) {
    this.on = on;
    this.world.byHand = 0;
  }

  private turn(sign: number): void {
    if (this.on) this.world.byHand = sign * this.world.plant.torque_limit;
  }
}
