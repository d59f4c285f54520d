import type { State } from '../pendulum';
import type { World } from '../world';
import { element } from './dom';
import { Slider } from './sliders';

/// Degrees within ±180.
function degrees(angle: number): number {
  return (180 / Math.PI) * Math.atan2(Math.sin(angle), Math.cos(angle));
}

const ANGLE = {
  unit: '°',
  min: -180,
  max: 180,
  limits: [-180, 180],
  step: 1,
  initial: 0,
  format: (value: number) => `${Math.round(value)}°`,
} as const;

/// Sliders for the angles of a pendulum that is paused, for those who cannot drag it.
export class Pose {
  private readonly world: World;
  private readonly q1: Slider;
  private readonly q2: Slider;

  constructor(world: World, onPose: () => void) {
    this.world = world;
    const slider = (name: 'q1' | 'q2', label: string) => {
      const made = new Slider({ ...ANGLE, name: `pose-${name}`, label }, (value) => {
        const { q1, q2 } = world.state;
        world.reset({ q1, q2, w1: 0, w2: 0, [name]: (Math.PI / 180) * value });
        onPose();
      });
      element('pose').append(made.element);
      return made;
    };
    this.q1 = slider('q1', 'Angle of the upper link');
    this.q2 = slider('q2', 'Angle of the lower link to it');
  }

  /// Shows the sliders instead of the hint while the pendulum is paused.
  set shown(shown: boolean) {
    element('pose').hidden = !shown;
    element('hint').hidden = shown;
    if (shown) this.follow(this.world.state);
  }

  /// Shows the angles of a state. (180° and -180° are one place, at both ends of a slider.)
  follow({ q1, q2 }: State): void {
    for (const [slider, angle] of [
      [this.q1, q1],
      [this.q2, q2],
    ] as const) {
      const apart = degrees(angle - (Math.PI / 180) * slider.value);
      if (Math.abs(apart) > 1e-6) slider.value = degrees(angle);
    }
  }
}
