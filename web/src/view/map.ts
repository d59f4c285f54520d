import { shareOf } from '../map';
import type { Axis, Quantity, ValueMap } from '../map';
import type { State } from '../pendulum';
import type { Units } from '../size';
import { Canvas } from './canvas';
import { signed } from './charts';

export type Color = readonly [number, number, number];
type Names = [string, string, string]; // at the ends of an axis, and in its middle
type Widths = [number, number, number]; // pixels

// Colours of V, lightest at the largest value; colours of torques, from left over none to right.
export const COLORS: Readonly<Record<Quantity, readonly Color[]>> = {
  value: [
    [20, 14, 54],
    [83, 36, 122],
    [180, 54, 114],
    [241, 120, 70],
    [252, 233, 160],
  ],
  torque: [
    [190, 72, 8],
    [240, 190, 150],
    [246, 243, 235],
    [140, 208, 198],
    [4, 110, 100],
  ],
};
const EASE = 0.25; // share of the way to a new map, at each drawing
const SAME = 1 / 256; // share of the scale, an invisible difference
const APART = 8; // pixels, smallest gap of two names
const [LEFT, BOTTOM] = [16, 18]; // pixels, for the names of the axes

/// A map of V or torque as colours, with the pendulum's trajectory.
export class MapChart {
  readonly canvas = new Canvas('map');
  private readonly image: HTMLCanvasElement = document.createElement('canvas');
  private pixels: ImageData | null = null; // of the image
  private shown: Float32Array | null = null; // 0 to 1, eased towards the map
  private painted: unknown[] = []; // what the image shows once it has come to rest

  /// Drops the map, so that the next one appears at once.
  clear(): void {
    this.shown = null;
  }

  /// A place on the canvas (CSS pixels) as shares of both axes, in [0, 1]²; null outside of the
  /// map.
  toShares(px: number, py: number): [number, number] | null {
    const { width, height, zoom } = this.canvas;
    const [x, y] = [px / zoom, py / zoom];
    if (x < LEFT || y > height - BOTTOM) return null;
    return [Math.min((x - LEFT) / (width - LEFT), 1), Math.min(1 - y / (height - BOTTOM), 1)];
  }

  /// `low`, `high`: values at the ends of the colours. `way`: past states, oldest first. `mark`:
  /// shares of both axes.
  draw(
    map: ValueMap,
    low: number,
    high: number,
    way: readonly State[],
    now: State,
    mark: readonly [number, number] | null,
    units: Units,
  ): void {
    const { canvas } = this;
    canvas.clear();
    const { width, height } = canvas;
    this.nameAxes(map.x, map.y, units);
    if (!map.cells) return canvas.text('computing …', width / 2, height / 2, 'center');
    if (Number.isNaN(low)) return canvas.text('not estimated', width / 2, height / 2, 'center');
    // An even map gets the middle colour.
    const shareOf = (cell: number) => (high > low ? (cell - low) / (high - low) : 0.5);
    this.shown ??= map.cells.map(shareOf);
    const { shown } = this;
    const sight = [map.cells, low, high, shown];
    if (!sight.every((part, i) => part === this.painted[i])) {
      let furthest = 0;
      map.cells.forEach((cell, i) => {
        const away = shareOf(cell) - shown[i]!;
        shown[i]! += EASE * away;
        furthest = Math.max(furthest, Math.abs(away));
      });
      this.paint(map.columns, COLORS[map.quantity]);
      this.painted = furthest < SAME ? sight : [];
    }
    canvas.context.imageSmoothingQuality = 'high';
    canvas.context.drawImage(this.image, LEFT, 0, width - LEFT, height - BOTTOM);
    this.drawWay(map, way, now);
    if (mark) this.drawMark(...mark);
  }

  /// A cross with a dark rim.
  private drawMark(x: number, y: number): void {
    const { canvas } = this;
    const [px, py] = [LEFT + x * (canvas.width - LEFT), (1 - y) * (canvas.height - BOTTOM)];
    for (const [color, width] of [
      ['map-rim', 6],
      ['map-way', 3],
    ] as const) {
      for (const [dx, dy] of [
        [11, 0],
        [0, 11],
      ] as const) {
        const ends: [number, number][] = [
          [px - dx, py - dy],
          [px + dx, py + dy],
        ];
        canvas.line(ends, color, width);
      }
    }
  }

  private paint(size: number, colors: readonly Color[]): void {
    const { image, shown } = this;
    if (!this.pixels) image.width = image.height = size;
    const brush = image.getContext('2d')!;
    this.pixels ??= brush.createImageData(size, size);
    const { data } = this.pixels;
    shown!.forEach((share, i) => {
      const at = 4 * ((size - 1 - Math.floor(i / size)) * size + (i % size));
      [data[at], data[at + 1], data[at + 2]] = between(colors, share);
      data[at + 3] = 255;
    });
    brush.putImageData(this.pixels, 0, 0);
  }

  /// White with a dark rim, visible on every colour.
  private drawWay(map: ValueMap, way: readonly State[], now: State): void {
    const { canvas } = this;
    const place = (state: State): [number, number] => [
      LEFT + shareOf(map.x, state) * (canvas.width - LEFT),
      (1 - shareOf(map.y, state)) * (canvas.height - BOTTOM),
    ];
    const pieces: [number, number][][] = [[]];
    for (const state of [...way, now]) {
      const point = place(state);
      const before = pieces.at(-1)!.at(-1);
      // Over an edge: continues at the other side.
      const jumps =
        before &&
        (Math.abs(point[0] - before[0]) > canvas.width / 2 ||
          Math.abs(point[1] - before[1]) > canvas.height / 2);
      if (jumps) pieces.push([]);
      pieces.at(-1)!.push(point);
    }
    canvas.context.save();
    canvas.context.beginPath();
    canvas.context.rect(LEFT, 0, canvas.width - LEFT, canvas.height - BOTTOM);
    canvas.context.clip();
    canvas.context.lineJoin = 'round';
    for (const [color, line] of [
      ['map-rim', 4],
      ['map-way', 2],
    ] as const) {
      for (const piece of pieces) canvas.line(piece, color, line);
      canvas.circle(...place(now), 6, color, line);
    }
    canvas.context.restore();
  }

  private nameAxes(x: Axis, y: Axis, units: Units): void {
    const { canvas } = this;
    const { width, height } = canvas;
    const [from, middle, to] = this.fitting(ends(x, units), width - LEFT);
    canvas.text(from, LEFT, height - 8);
    canvas.text(middle, (LEFT + width) / 2, height - 8, 'center');
    canvas.text(to, width, height - 8, 'right');
    const [low, centre, high] = this.fitting(ends(y, units), height - BOTTOM);
    canvas.context.save();
    canvas.context.rotate(-Math.PI / 2);
    canvas.text(low, BOTTOM - height, 7);
    canvas.text(centre, (BOTTOM - height) / 2, 7, 'center');
    canvas.text(high, 0, 7, 'right');
    canvas.context.restore();
  }

  /// The names that fit an axis of this length: all, or only a shorter middle one.
  private fitting(names: Names, length: number): Names {
    const { context } = this.canvas;
    context.font = this.canvas.font('12px'); // font of Canvas.text()
    const [from, middle, to] = names.map((name) => context.measureText(name).width) as Widths;
    const half = length / 2 - middle / 2 - APART;
    return from < half && to < half ? names : ['', briefly(names[1]), ''];
  }
}

/// The colour at a share of a scale.
export function between(colors: readonly Color[], share: number): Color {
  const at = Math.min(Math.max(share, 0), 1) * (colors.length - 1) || 0;
  const i = Math.min(Math.floor(at), colors.length - 2);
  const [a, b] = [colors[i]!, colors[i + 1]!];
  const mix = (k: 0 | 1 | 2) => a[k] + (at - i) * (b[k] - a[k]);
  return [mix(0), mix(1), mix(2)];
}

/// A short name for a short axis.
function briefly(name: string): string {
  return name.replace(' link', '');
}

/// The names of an axis.
function ends({ name, reach }: Axis, units: Units): Names {
  if (name === 'q1') return ['hanging', 'upper link upright', 'hanging'];
  if (name === 'q2') return ['folded', 'lower link straight', 'folded'];
  const link = name === 'w1' ? 'upper' : 'lower';
  const fastest = units.velocity * reach;
  return [signed(-fastest), `velocity of the ${link} joint`, `${signed(fastest)} rad/s`];
}
