import type { Range, State } from '../pendulum';
import { quantity } from '../quantity';
import type { Units } from '../size';
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

/// At size 1; shown in SI units.
const velocity = (fastest: number) => {
  const limits: Range = [-150, 150];
  return { unit: 'rad/s', min: -fastest, max: fastest, limits, step: 0.1, initial: 0 };
};

const VELOCITY = { w1: velocity(10), w2: velocity(20) } as const;

type Variable = keyof State;

/// Sliders for the state of a paused pendulum, for visitors who cannot drag it or click on the map.
export class Pose {
  private readonly world: World;
  private units: Units; // of the shown values
  private readonly sliders: readonly (readonly [Variable, Slider])[];

  constructor(world: World, onPose: () => void) {
    this.world = world;
    this.units = world.units;
    const format = (w: number) => quantity(w, world.units.velocity, 'rad/s');
    const slider = (name: Variable, label: string) => {
      const spec = name === 'q1' || name === 'q2' ? ANGLE : { ...VELOCITY[name], format };
      const made = new Slider({ ...spec, name: `pose-${name}`, label }, (value) => {
        const scale = spec === ANGLE ? Math.PI / 180 : 1;
        world.reset({ ...world.state, [name]: scale * value });
        onPose();
      });
      element('pose').append(made.element);
      return [name, made] as const;
    };
    this.sliders = [
      slider('q1', 'Angle of the upper link'),
      slider('q2', 'Angle of the lower link to it'),
      slider('w1', 'Velocity of the upper joint'),
      slider('w2', 'Velocity of the lower joint'),
    ];
  }

  /// Shows the sliders while the pendulum is paused, else the hint.
  set shown(shown: boolean) {
    element('pose').hidden = !shown;
    element('hint').hidden = shown;
    if (shown) this.follow(this.world.state);
  }

  /// Shows a state. (180° and -180° are the same angle, at both ends of a slider.)
  follow(state: State): void {
    if (this.units !== this.world.units) {
      this.units = this.world.units;
      for (const [, slider] of this.sliders) slider.show();
    }
    for (const [name, slider] of this.sliders) {
      if (name === 'q1' || name === 'q2') {
        const apart = degrees(state[name] - (Math.PI / 180) * slider.value);
        if (Math.abs(apart) > 1e-6) slider.value = degrees(state[name]);
      } else if (Math.abs(state[name] - slider.value) > 0.05) {
        slider.value = Math.round(10 * state[name]) / 10;
      }
    }
  }
}
