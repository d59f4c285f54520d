import { rangeOfValues, ValueMap } from '../map';
import { between, COLORS } from '../view/map';
import { Scale } from '../view/scale';
import type { World } from '../world';

const CELLS = 96;
const MILLISECONDS = 2; // per frame

/// The value of the straight pendulum at rest at each angle, as colours around the pendulum. So the
/// colour at the tip belongs to the pose there.
export class Ring {
  private readonly map = new ValueMap(CELLS, 1);
  private readonly scales: readonly Scale[];
  private version: object | null = null; // of the ring in progress, or of the last one
  private plant: World['plant'] | null = null;
  private goal: World['target'] = null;
  private complete = false;
  private painted: readonly [Float32Array | null, number, number] = [null, NaN, NaN];
  shown = false;
  /// Clockwise from below; empty: not shown or not estimated.
  colors: readonly string[] = [];

  /// `scales`: elements for the legend.
  constructor(scales: Iterable<HTMLElement>) {
    this.map.atRest = true;
    this.scales = Array.from(scales, (place) => new Scale(place));
  }

  /// Whether it still has to be computed.
  get busy(): boolean {
    return this.shown && !this.complete;
  }

  /// Call at each frame. `range`: values at the ends of the colours; null: the ring's own. Computes
  /// again when `version` changes, and keeps the colours before until the new ones are complete.
  follow(world: World, range: readonly [number, number] | null, version: object | null): void {
    const { policy, plant, target } = world;
    if (!this.shown || !policy?.isQuick) {
      this.version = null;
      this.complete = true;
      return this.paint([NaN, NaN], 1);
    }
    if (version !== this.version || plant !== this.plant || target !== this.goal) {
      [this.version, this.plant, this.goal, this.complete] = [version, plant, target, false];
      this.map.clear();
    }
    this.complete ||= this.map.work(world, MILLISECONDS) !== null;
    if (!this.complete) return;
    const own = rangeOfValues(this.map.cells!, policy.rewardScale);
    this.paint(range ?? own, policy.rewardScale);
  }

  private paint([low, high]: readonly [number, number], rewardScale: number): void {
    const { cells } = this.map;
    const now = [cells, low, high] as const;
    if (now.every((part, i) => Object.is(part, this.painted[i]))) return;
    this.painted = now;
    const known = Number.isFinite(high - low);
    const color = (cell: number) => between(COLORS.value, (cell - low) / (high - low));
    this.colors = known ? Array.from(cells!, (cell) => `rgb(${color(cell).join(' ')})`) : [];
    const ends = known ? ([low / rewardScale, high / rewardScale] as const) : null;
    for (const scale of this.scales) scale.show('value', ends);
  }
}
