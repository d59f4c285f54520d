import type { Decision } from './decision';
import type { Goal, Plant, State } from './pendulum';
import type { World } from './world';

/// A map of the agent's value or torque over two of the four state variables; the others keep their
/// present values, or are 0.

export type Variable = keyof State;
export type Quantity = 'value' | 'torque';

/// A variable along a side of the map, from `middle` - `reach` to `middle` + `reach`.
export interface Axis {
  name: Variable;
  middle: number; // rad, rad/s
  reach: number;
  turns: boolean; // an angle, which repeats
}

/// Upright at rest is in the middle. (q2 is relative: 0 is straight.)
export const AXES: Readonly<Record<Variable, Axis>> = {
  q1: { name: 'q1', middle: Math.PI, reach: Math.PI, turns: true },
  q2: { name: 'q2', middle: 0, reach: Math.PI, turns: true },
  w1: { name: 'w1', middle: 0, reach: 10, turns: false },
  w2: { name: 'w2', middle: 0, reach: 20, turns: false },
};

/// A state's place on an axis, 0 to 1; outside this range for a faster velocity.
export function shareOf({ name, middle, reach, turns }: Axis, state: State): number {
  const share = (state[name] - middle + reach) / (2 * reach);
  return turns ? share - Math.floor(share) : share;
}

export function valueAt({ middle, reach }: Axis, share: number): number {
  return middle + (2 * share - 1) * reach;
}

/// V of a decision; for a Q-network the largest Q-value. NaN if the policy estimates none.
export function valueOf(decision: Decision): number {
  return decision.kind === 'q' ? decision.q[decision.action]! : decision.value;
}

/// A grid that is computed in slices, one at each frame, so that the page stays smooth.
export class ValueMap {
  readonly columns: number;
  readonly rows: number; // 1: only the middle of y
  x = AXES.q1;
  y = AXES.q2;
  quantity: Quantity = 'value';
  atRest = false; // zero velocities instead of the present ones
  /// The last complete map (rows × columns), from below: V in units of the network, or torque (N·m).
  /// Null before there is one.
  cells: Float32Array | null = null;
  /// Whether `cells` is the first map, in blocks.
  isCoarse = false;
  private readonly coarse: number;
  private begun: Float32Array;
  private block: number; // cells along a side that get the same value
  private next = 0; // block to compute next
  private around: State | null = null; // values of the other variables
  private plant: Readonly<Plant> | null = null; // of the map in progress
  private goal: Goal | null = null; // the same

  /// `coarse`: cells along a side of a block of the first map, which is there sooner. It divides
  /// both numbers of cells.
  constructor(columns: number, rows = columns, coarse = 1) {
    this.columns = columns;
    this.rows = rows;
    this.coarse = this.block = coarse;
    this.begun = new Float32Array(rows * columns);
  }

  /// Drops the map: other axes, another quantity or another agent.
  clear(): void {
    this.cells = null;
    this.restart();
  }

  private restart(): void {
    this.around = null;
    this.next = 0;
    this.block = this.cells ? 1 : this.coarse;
  }

  /// Computes for up to `milliseconds`, at least one block. Returns the state at which a map was
  /// begun when that map is complete, else null. A change of the plant starts the map again.
  work(world: World, milliseconds: number): State | null {
    const end = performance.now() + milliseconds;
    if (this.plant !== world.plant || this.goal !== world.target) this.restart();
    this.plant = world.plant;
    this.goal = world.target;
    this.around ??= this.atRest ? { ...world.state, w1: 0, w2: 0 } : world.state;
    const { block } = this;
    const across = this.columns / block;
    const blocks = across * (this.rows / block);
    do {
      const [column, row] = [this.next % across, Math.floor(this.next / across)];
      const decision = world.decisionAt(this.stateAt(column, row, this.around));
      if (!decision) return null;
      this.fill(column, row, this.quantity === 'torque' ? decision.torque : valueOf(decision));
    } while (++this.next < blocks && performance.now() < end);
    if (this.next < blocks) return null;
    [this.cells, this.begun] = [this.begun, this.cells ?? new Float32Array(this.begun.length)];
    this.isCoarse = block > 1;
    const { around } = this;
    this.restart();
    return around;
  }

  private fill(column: number, row: number, value: number): void {
    const { block, columns } = this;
    for (let i = row * block; i < (row + 1) * block; ++i) {
      this.begun.fill(value, i * columns + column * block, i * columns + (column + 1) * block);
    }
  }

  /// The state in the middle of a block.
  private stateAt(column: number, row: number, around: State): State {
    const { block } = this;
    return {
      ...around,
      [this.x.name]: valueAt(this.x, (block * (column + 0.5)) / this.columns),
      [this.y.name]: valueAt(this.y, (block * (row + 0.5)) / this.rows),
    };
  }
}

/// The smallest and the largest value.
export function endsOf(cells: Float32Array): [number, number] {
  return [cells.reduce((a, b) => Math.min(a, b)), cells.reduce((a, b) => Math.max(a, b))];
}

/// Smallest range of values (V / reward scale) that uses all colours: the reward of a few balanced
/// steps, or a share of the values themselves.
const LEAST = 20; // reward
const LEAST_SHARE = 0.05;

function leastRange([low, high]: [number, number], rewardScale: number): number {
  return Math.max(LEAST * rewardScale, (LEAST_SHARE * Math.abs(low + high)) / 2);
}

/// Whether the values hardly differ.
export function isEven(cells: Float32Array, rewardScale: number): boolean {
  const ends = endsOf(cells);
  return ends[1] - ends[0] < leastRange(ends, rewardScale);
}

/// The values at the ends of the colours. A nearly even map gets a wider range, so that it looks
/// even.
export function rangeOfValues(cells: Float32Array, rewardScale: number): [number, number] {
  const ends = endsOf(cells);
  const wider = Math.max(0, leastRange(ends, rewardScale) - (ends[1] - ends[0])) / 2;
  return [ends[0] - wider, ends[1] + wider];
}
