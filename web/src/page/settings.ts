import { DISTURBANCE_LIMITS } from '../disturbance';
import type { Disturbance } from '../disturbance';
import { CONTROL_PERIOD, NOMINAL, PLANT_LIMITS, plantProblem } from '../pendulum';
import type { Parameter, Plant, Range } from '../pendulum';
import type { Policy } from '../policy';
import type { World } from '../world';
import { element } from './dom';
import { warn } from './message';
import { Slider } from './sliders';
import type { SliderSpec } from './sliders';

type Row = Omit<SliderSpec, 'name' | 'initial' | 'limits'> & { name: Parameter };

const PLANT: readonly Row[] = [
  { name: 'mass1', label: 'Mass of the upper link', unit: 'kg', min: 0.2, max: 3, step: 0.05 },
  { name: 'mass2', label: 'Mass of the lower link', unit: 'kg', min: 0.2, max: 3, step: 0.05 },
  { name: 'length1', label: 'Length of the upper link', unit: 'm', min: 0.2, max: 1, step: 0.01 },
  { name: 'length2', label: 'Length of the lower link', unit: 'm', min: 0.2, max: 1, step: 0.01 },
  {
    name: 'damping1',
    label: 'Damping of the upper joint',
    unit: 'N·m·s',
    min: 0,
    max: 1,
    step: 0.01,
  },
  {
    name: 'damping2',
    label: 'Damping of the lower joint',
    unit: 'N·m·s',
    min: 0,
    max: 1,
    step: 0.01,
  },
  { name: 'gravity', label: 'Gravity', unit: 'm/s²', min: 1, max: 25, step: 0.01 },
  { name: 'torque_limit', label: 'Limit of the motor', unit: 'N·m', min: 1, max: 10, step: 0.25 },
];

const milliseconds = (seconds: number) => `${Number((1000 * seconds).toPrecision(4))} ms`;

const DISTURBANCE: readonly (SliderSpec & { name: keyof Disturbance })[] = [
  {
    name: 'sensor_noise',
    label: 'Sensor noise (σ)',
    unit: 'rad, rad/s',
    min: 0,
    max: 0.2,
    limits: DISTURBANCE_LIMITS.sensor_noise,
    step: 0.005,
    initial: 0,
  },
  {
    name: 'delay',
    label: 'Delay of the motor',
    unit: 'ms',
    min: 0,
    max: 5,
    limits: DISTURBANCE_LIMITS.delay,
    step: 1,
    initial: 0,
    format: (periods) => `${1000 * CONTROL_PERIOD * periods} ms`,
  },
  {
    name: 'encoder_counts',
    label: 'Encoders',
    unit: 'counts',
    min: 0,
    max: 8192,
    limits: DISTURBANCE_LIMITS.encoder_counts,
    step: 256,
    initial: 0,
    format: (counts) => (counts === 0 ? 'exact' : `${counts} counts`),
  },
  {
    name: 'velocity_window',
    label: 'Velocities from angles over',
    unit: 'ms',
    min: 0,
    max: 0.05,
    limits: DISTURBANCE_LIMITS.velocity_window,
    step: 0.001,
    initial: 0,
    format: (seconds) => (seconds === 0 ? 'exact' : milliseconds(seconds)),
  },
  {
    name: 'velocity_filter',
    label: 'Low-pass of the velocities (τ)',
    unit: 'ms',
    min: 0,
    max: 0.05,
    limits: DISTURBANCE_LIMITS.velocity_filter,
    step: 0.001,
    initial: 0,
    format: milliseconds,
  },
  {
    name: 'sensor_latency',
    label: 'Latency of the sensors',
    unit: 'ms',
    min: 0,
    max: 0.05,
    limits: DISTURBANCE_LIMITS.sensor_latency,
    step: 0.001,
    initial: 0,
    format: milliseconds,
  },
];

/// Limits for links to this page. They may exceed a slider's range, which then grows.
export const RANGES: ReadonlyMap<string, Range> = new Map<string, Range>([
  ...Object.entries(PLANT_LIMITS),
  ...Object.entries(DISTURBANCE_LIMITS),
  ['speed', [0.1, 2]],
]);

/// The sliders of the plant, its sensors and its motor.
export class Settings {
  private readonly plant = new Map<Parameter, Slider>();
  private readonly world: World;
  private readonly disturbance = new Map<keyof Disturbance, Slider>();

  constructor(world: World, onChange: () => void) {
    this.world = world;
    for (const row of PLANT) {
      const spec = { ...row, limits: PLANT_LIMITS[row.name], initial: NOMINAL[row.name] };
      const slider = new Slider(spec, (value) => {
        const plant = { ...world.plant, [row.name]: value };
        const problem = plantProblem(plant);
        if (problem) {
          slider.value = world.plant[row.name];
          return warn(`${problem}.`);
        }
        world.plant = plant;
        onChange();
      });
      this.plant.set(row.name, slider);
      element('plant-sliders').append(slider.element);
    }
    for (const spec of DISTURBANCE) {
      const slider = new Slider(spec, (value) => {
        world.disturbance[spec.name] = value;
        onChange();
      });
      this.disturbance.set(spec.name, slider);
      element('disturbance-sliders').append(slider.element);
    }
  }

  setPlant(plant: Plant): void {
    this.world.plant = plant;
    for (const [name, slider] of this.plant) slider.value = plant[name];
  }

  setDisturbance(disturbance: Disturbance): void {
    Object.assign(this.world.disturbance, disturbance);
    for (const [name, slider] of this.disturbance) slider.value = disturbance[name];
  }

  /// Marks on each slider the policy's range in training.
  mark(policy: Policy): void {
    for (const [name, slider] of this.plant) slider.trained = policy.trainedRange(name);
    const { strongest } = policy.controller;
    this.plant.get('torque_limit')!.label = `Limit of the motor (agent: ±${strongest})`;
    element('trained-on').textContent = policy.isLearned ? 'range of the training' : 'design plant';
    for (const [name, slider] of this.disturbance) slider.trained = policy.trainedDisturbance(name);
  }
}
