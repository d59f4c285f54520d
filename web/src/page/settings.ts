import { DISTURBANCE_LIMITS } from '../disturbance';
import type { Disturbance } from '../disturbance';
import { NOMINAL, PLANT_LIMITS, plantProblem } from '../pendulum';
import type { Parameter, Plant, Range } from '../pendulum';
import type { Policy } from '../policy';
import { quantity, sizeText } from '../quantity';
import { sentence } from '../text';
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
const digits = (value: number) => Number(value.toPrecision(4));

/// `format` gets the world, whose size gives the units.
type DisturbanceRow = Omit<SliderSpec, 'format'> & {
  name: keyof Disturbance;
  format: (value: number, world: World) => string;
};

const DISTURBANCE: readonly DisturbanceRow[] = [
  {
    name: 'sensor_noise',
    label: 'Sensor noise (σ)',
    unit: 'rad, rad/s',
    min: 0,
    max: 0.2,
    limits: DISTURBANCE_LIMITS.sensor_noise,
    step: 0.005,
    initial: 0,
    format: (sigma, { units: { velocity } }) =>
      velocity === 1
        ? `${digits(sigma)} rad, rad/s`
        : `${digits(sigma)} rad, ${digits(sigma * velocity)} rad/s`,
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
    format: (periods, { period, units }) => milliseconds(units.time * period * periods),
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
    format: (seconds, { units }) => (seconds === 0 ? 'exact' : milliseconds(units.time * seconds)),
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
    format: (seconds, { units }) => milliseconds(units.time * seconds),
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
    format: (seconds, { units }) => milliseconds(units.time * seconds),
  },
];

/// Limits for links to this page. They may exceed a slider's range, which then grows.
export const RANGES: ReadonlyMap<string, Range> = new Map<string, Range>([
  ...Object.entries(PLANT_LIMITS),
  ...Object.entries(DISTURBANCE_LIMITS),
  ['speed', [0.1, 2]],
]);

/// The slider of the size moves along its logarithm, over sizes with two digits.
const SIZE = { step: 0.05, min: -1.3, max: 1 } as const; // log10 of the size
const sizeAt = (place: number) => Number((10 ** place).toPrecision(2));
function placeOf(size: number): number {
  const onStep = SIZE.step * Math.round(Math.log10(size) / SIZE.step);
  return sizeAt(onStep) === size ? onStep : Math.log10(size);
}

/// The sliders of the plant, its sensors and its motor. Their values are in units of size 1; their
/// texts are in SI units.
export class Settings {
  private readonly sizes: Slider[] = []; // sliders of the size, which show the same value
  private readonly plant = new Map<Parameter, Slider[]>();
  private readonly world: World;
  private readonly onChange: () => void;
  private readonly disturbance = new Map<keyof Disturbance, Slider>();
  private strongest = 0; // N·m, of the agent

  constructor(world: World, onChange: () => void) {
    this.world = world;
    this.onChange = onChange;
    for (const name of ['size', ...PLANT.map(({ name }) => name)] as const) {
      element('plant-sliders').append(this.plantSlider(name, name).element);
    }
    for (const row of DISTURBANCE) {
      const spec = { ...row, format: (value: number) => row.format(value, world) };
      const slider = new Slider(spec, (value) => {
        world.disturbance[row.name] = value;
        onChange();
      });
      this.disturbance.set(row.name, slider);
      element('disturbance-sliders').append(slider.element);
    }
  }

  /// Makes a slider of the plant with this ID. All sliders of the same quantity show the same value.
  plantSlider(name: Parameter | 'size', id: string): Slider {
    if (name === 'size') return this.makeSize(id);
    const { world } = this;
    const row = PLANT.find((one) => one.name === name)!;
    const format = (value: number) => quantity(value, world.units.of(name), row.unit);
    const spec = { ...row, name: id, format, limits: PLANT_LIMITS[name], initial: NOMINAL[name] };
    const slider = new Slider(spec, (value) => {
      const plant = { ...world.plant, [name]: value };
      const problem = plantProblem(plant);
      if (problem) {
        slider.value = world.plant[name];
        return warn(sentence(problem));
      }
      world.plant = plant;
      for (const other of this.plant.get(name)!) if (other !== slider) other.value = value;
      this.onChange();
    });
    this.plant.set(name, [...(this.plant.get(name) ?? []), slider]);
    return slider;
  }

  private makeSize(id: string): Slider {
    const { world } = this;
    const [low, high] = PLANT_LIMITS.size;
    const limits = [Math.log10(low), Math.log10(high)] as const;
    const format = (place: number) => sizeText(sizeAt(place));
    const spec = { ...SIZE, name: id, label: 'Size', unit: 'm', limits, initial: 0, format };
    const slider = new Slider(spec, (place) => {
      world.plant = { ...world.plant, size: sizeAt(place) };
      for (const other of this.sizes) if (other !== slider) other.value = place;
      this.show();
      this.onChange();
    });
    this.sizes.push(slider);
    return slider;
  }

  setPlant(plant: Plant): void {
    this.world.plant = plant;
    for (const slider of this.sizes) slider.value = placeOf(plant.size);
    for (const [name, sliders] of this.plant) {
      for (const slider of sliders) slider.value = plant[name];
    }
    this.show();
  }

  setDisturbance(disturbance: Disturbance): void {
    Object.assign(this.world.disturbance, disturbance);
    for (const [name, slider] of this.disturbance) slider.value = disturbance[name];
  }

  /// Marks on each slider the policy's range in training.
  mark(policy: Policy): void {
    for (const [name, sliders] of this.plant) {
      for (const slider of sliders) slider.trained = policy.trainedRange(name);
    }
    this.strongest = policy.controller.strongest;
    element('trained-on').textContent = policy.isLearned ? 'range of the training' : 'design plant';
    for (const [name, slider] of this.disturbance) slider.trained = policy.trainedDisturbance(name);
    this.show();
  }

  /// Shows all values in the units of the size.
  private show(): void {
    const { torque } = this.world.units;
    const strongest =
      torque === 1 ? String(digits(this.strongest)) : quantity(this.strongest, torque, 'N·m');
    for (const slider of this.plant.get('torque_limit')!) {
      slider.label = `Limit of the motor (agent: ±${strongest})`;
    }
    for (const slider of [...this.plant.values(), ...this.disturbance.values()].flat()) {
      slider.show();
    }
  }
}
