import type { History } from '../history';
import { AXES, endsOf, isEven, rangeOfValues, ValueMap, valueAt } from '../map';
import type { Axis, Quantity, Variable } from '../map';
import type { State } from '../pendulum';
import type { Policy } from '../policy';
import { Units } from '../size';
import { signed } from '../view/charts';
import { MapChart } from '../view/map';
import { Scale } from '../view/scale';
import type { World } from '../world';
import { torqueIn } from './dashboard';
import { element } from './dom';

const CELLS = 72; // along a side
const MILLISECONDS = 3; // per frame
const FIRST = 24; // the same while there is no map yet, or one in blocks
const COARSE = 4; // cells along a side of a block
const FRAMES = 3; // drawn at each third frame, computed at the others
const WAY = 4; // s of the trajectory to draw
const MARKS = 24; // steps of the mark along a side
const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/// The panel of the map: its choices, and clicks on it.
export class MapPanel {
  private readonly map = new ValueMap(CELLS, CELLS, COARSE);
  private readonly chart = new MapChart();
  private readonly select = {
    quantity: element<HTMLSelectElement>('map-quantity'),
    x: element<HTMLSelectElement>('map-x'),
    y: element<HTMLSelectElement>('map-y'),
  };
  private policy: Policy | null = null; // of the map
  private units = new Units(1); // of the pendulum
  private key = ''; // state and plant of the complete map
  private seen = false; // on the screen
  /// Whether the map still has to be computed for the present state.
  busy = false;
  private range: [number, number] = [0, 1];
  private frame = 0;
  private mark: [number, number] | null = null; // shares of both axes, moved by keys
  private readonly scales = [...document.querySelectorAll<HTMLElement>('.scale:not(.of-ring)')].map(
    (place) => new Scale(place),
  );

  /// `start` gets the variables of a clicked place.
  constructor(start: (where: Partial<State>) => void) {
    const { element: canvas } = this.chart.canvas;
    for (const list of Object.values(this.select)) {
      list.addEventListener('change', () => this.choose(list));
    }
    canvas.addEventListener('click', ({ offsetX, offsetY }) => {
      const shares = this.chart.toShares(offsetX, offsetY);
      if (shares) start(this.stateAt(shares));
    });
    canvas.addEventListener('keydown', (event) => {
      const { mark } = this;
      if (event.key === 'Enter' && mark) start(this.stateAt(mark));
      else if (!this.moveMark(event.key)) return;
      event.preventDefault();
      event.stopPropagation(); // or the page's own keys would shove
    });
    canvas.addEventListener('blur', () => (this.mark = null));
    new IntersectionObserver(([entry]) => (this.seen = entry!.isIntersecting)).observe(canvas);
  }

  private stateAt([x, y]: [number, number]): Partial<State> {
    const { map } = this;
    const rest = map.atRest ? { w1: 0, w2: 0 } : {};
    return { ...rest, [map.x.name]: valueAt(map.x, x), [map.y.name]: valueAt(map.y, y) };
  }

  /// Moves the mark by 15° or a share of a velocity, at first from the middle. False for keys other
  /// than arrows.
  private moveMark(key: string): boolean {
    const [dx, dy] = ARROWS[key] ?? [0, 0];
    if (dx === 0 && dy === 0) return false;
    const [x, y] = this.mark ?? [0.5, 0.5];
    const within = (share: number) => Math.min(Math.max(share, 0), 1);
    this.mark = [within(x + dx / MARKS), within(y + dy / MARKS)];
    const { map } = this;
    const place = [map.x, map.y].map((axis, i) =>
      placeText(axis, valueAt(axis, this.mark![i]!), this.units),
    );
    element('map-mark').textContent = place.join(', ');
    return true;
  }

  get canvas() {
    return this.chart.canvas;
  }

  /// Shows poses at rest, or with the present velocities.
  set atRest(rest: boolean) {
    if (rest === this.map.atRest) return;
    this.map.atRest = rest;
    this.reset();
  }

  /// Values at the ends of the colours; null: no map of the value is on the screen.
  get valueRange(): [number, number] | null {
    const { map } = this;
    return this.seen && map.cells && map.quantity === 'value' ? this.range : null;
  }

  /// Call at each frame.
  draw(world: World, history: History): void {
    this.busy = false;
    if (!this.seen || !world.policy) return;
    if (this.policy !== world.policy) this.clear();
    this.policy = world.policy;
    this.units = world.units;
    if (!world.policy.isQuick) {
      element('map-value').textContent = 'not for one that plans';
      return;
    }
    if (++this.frame % FRAMES !== 0) return this.work(world);
    const way = history.from(world.time - WAY).map(({ state }) => state);
    this.chart.draw(this.map, ...this.range, way, world.state, this.mark, world.units);
  }

  /// Computes, unless the map belongs to the present state already.
  private work(world: World): void {
    const { map } = this;
    const { plant, target } = world;
    this.busy = true;
    const keyOf = (state: State) => {
      const rest = map.atRest ? { w1: 0, w2: 0 } : {};
      return JSON.stringify([
        { ...state, ...rest, [map.x.name]: 0, [map.y.name]: 0 },
        plant,
        target,
      ]);
    };
    if (map.cells && keyOf(world.state) === this.key) {
      this.busy = false;
      return;
    }
    const begunIn = map.work(world, map.cells && !map.isCoarse ? MILLISECONDS : FIRST);
    if (!begunIn) return;
    this.key = map.isCoarse ? '' : keyOf(begunIn);
    const [low, high] = (this.range = this.rangeOf(map.cells!, world));
    const known = Number.isFinite(high - low);
    element('map-value').textContent = known ? this.said(world) : 'not estimated';
    const torque = torqueIn(world);
    const factor = map.quantity === 'torque' ? torque.factor : 1 / (world.policy?.rewardScale ?? 1);
    for (const scale of this.scales)
      scale.show(map.quantity, known ? [low * factor, high * factor] : null, torque.unit);
  }

  /// The range of the colours, in words.
  private said(world: World): string {
    const { plant, policy } = world;
    const { cells, quantity } = this.map;
    if (quantity === 'torque') {
      const { factor, unit } = torqueIn(world);
      const limit = factor * plant.torque_limit;
      return `${signed(-limit)} to ${signed(limit)} ${unit}`;
    }
    const [low, high] = endsOf(cells!).map((end) => signed(end / (policy?.rewardScale ?? 1)));
    return isEven(cells!, policy?.rewardScale ?? 1)
      ? `${low} to ${high}: nearly even`
      : `${low} to ${high}`;
  }

  /// The values at the ends of the colours.
  private rangeOf(cells: Float32Array, { plant, policy }: World): [number, number] {
    if (this.map.quantity === 'torque') return [-plant.torque_limit, plant.torque_limit];
    return rangeOfValues(cells, policy?.rewardScale ?? 1);
  }

  /// Both axes show different variables: choosing one twice swaps them.
  private choose(changed: HTMLSelectElement): void {
    const { x, y, quantity } = this.select;
    if (x.value === y.value)
      (changed === x ? y : x).value = this.map[changed === x ? 'x' : 'y'].name;
    this.map.x = AXES[x.value as Variable];
    this.map.y = AXES[y.value as Variable];
    this.map.quantity = quantity.value as Quantity;
    this.clear();
  }

  /// V over both angles.
  reset(): void {
    Object.assign(this.select.quantity, { value: 'value' });
    Object.assign(this.select.x, { value: 'q1' });
    Object.assign(this.select.y, { value: 'q2' });
    this.choose(this.select.x);
  }

  private clear(): void {
    this.map.clear();
    this.chart.clear();
    element('map-value').textContent = '';
    for (const scale of this.scales) scale.show(this.map.quantity, null);
  }
}

/// A place on an axis, in words.
function placeText({ name, turns }: Axis, value: number, units: Units): string {
  const link = name === 'q1' || name === 'w1' ? 'upper' : 'lower';
  return turns
    ? `${link} angle ${signed(Math.round((180 / Math.PI) * value))}°`
    : `${link} velocity ${signed(units.velocity * value)} rad/s`;
}
