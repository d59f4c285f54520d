import type { Canvas } from './canvas';
import { forcedColors, isNight } from './night';

/// The machine on the stage: motor, links, the light of the goal, and the trace of the tip. Places and
/// sizes are in pixels of the canvas. With forced colours everything is flat.

type Place = readonly [number, number];

const UPRIGHT = Math.PI / 6; // a link is upright within this angle
const SOFT = 0.09; // rad, over which the light fades at its sides
/// Angle from the top (rad) and strength of the light.
const BEAM = [
  [-UPRIGHT - SOFT, 0],
  [-UPRIGHT + SOFT, 1],
  [UPRIGHT - SOFT, 1],
  [UPRIGHT + SOFT, 0],
] as const;
const RING = 0.07; // width of the coloured band, in lengths of the pendulum
const FAR = 1.15; // end of the light, in lengths of the pendulum
const SHADES = 16; // steps of the trace from new to old
const FRESH = 1.6; // s, time in which the trace loses most of its light

/// A colour made translucent. `color` is rgb(…), as computed colours of a style sheet are.
function faded(color: string, alpha: number): string {
  const [r, g, b] = color.match(/[\d.]+/g)!;
  return `rgb(${r} ${g} ${b} / ${alpha})`;
}

/// The circle within the tip's reach.
export function drawReach(canvas: Canvas, [x, y]: Place, reach: number): void {
  const { context } = canvas;
  context.beginPath();
  context.arc(x, y, reach, 0, 2 * Math.PI);
  context.strokeStyle = canvas.color('grid');
  context.lineWidth = 1;
  context.globalAlpha = 0.35;
  context.stroke();
  context.globalAlpha = 1;
}

/// The light from a joint to the goal, upwards or downwards. `strength`: 0 to 1.
export function drawLight(
  canvas: Canvas,
  [x, y]: Place,
  reach: number,
  strength: number,
  up: boolean,
): void {
  const { context } = canvas;
  const middle = up ? -Math.PI / 2 : Math.PI / 2;
  const color = canvas.color('cone-edge');
  if (forcedColors.matches) {
    context.beginPath();
    context.arc(x, y, reach, middle - UPRIGHT, middle + UPRIGHT);
    context.strokeStyle = color;
    context.lineWidth = 4;
    return context.stroke();
  }
  context.globalAlpha = strength;
  const beam = beamOf(canvas, color, Math.ceil(FAR * reach));
  context.save();
  context.translate(x, y);
  if (!up) context.rotate(Math.PI);
  context.drawImage(beam, -beam.width / 2, -beam.height / 2);
  context.restore();
  context.beginPath();
  context.arc(x, y, reach, middle - UPRIGHT, middle + UPRIGHT);
  context.strokeStyle = color;
  context.lineWidth = 3;
  context.stroke();
  context.globalAlpha = 1;
}

/// The last light of each canvas, so that stages of different sizes do not redraw it in turn.
const beams = new WeakMap<Canvas, { color: string; radius: number; beam: HTMLCanvasElement }>();

/// The light on its own canvas of this radius; the last one is kept.
function beamOf(owner: Canvas, color: string, radius: number): HTMLCanvasElement {
  const kept = beams.get(owner);
  if (kept?.color === color && kept.radius === radius) return kept.beam;
  const beam = document.createElement('canvas');
  beam.width = beam.height = 2 * radius;
  const context = beam.getContext('2d')!;
  // Angles from below, once round: dark, light about the top, dark.
  const light = context.createConicGradient(Math.PI / 2, radius, radius);
  const at = (angle: number) => 0.5 + angle / (2 * Math.PI);
  light.addColorStop(0, faded(color, 0));
  for (const [angle, alpha] of BEAM) light.addColorStop(at(angle), faded(color, alpha));
  light.addColorStop(1, faded(color, 0));
  context.fillStyle = light;
  context.fillRect(0, 0, 2 * radius, 2 * radius);
  // Fainter with the distance.
  const lamp = context.createRadialGradient(radius, radius, 0, radius, radius, radius);
  for (const [share, alpha] of [
    [0, 0.85],
    [0.35, 0.45],
    [0.85, 0.16],
    [1, 0],
  ] as const) {
    lamp.addColorStop(share, `rgb(0 0 0 / ${alpha})`);
  }
  context.globalCompositeOperation = 'destination-in';
  context.fillStyle = lamp;
  context.fillRect(0, 0, 2 * radius, 2 * radius);
  beams.set(owner, { color, radius, beam });
  return beam;
}

/// A band of colours outside the circle within the tip's reach, clockwise from below.
export function drawRing(
  canvas: Canvas,
  [x, y]: Place,
  reach: number,
  colors: readonly string[],
): void {
  if (colors.length === 0) return;
  const { context } = canvas;
  const band = context.createConicGradient(Math.PI / 2, x, y);
  colors.forEach((color, i) => band.addColorStop((i + 0.5) / colors.length, color));
  const width = RING * reach;
  context.beginPath();
  context.arc(x, y, reach + width, 0, 2 * Math.PI);
  context.strokeStyle = band;
  context.lineWidth = width;
  context.stroke();
}

/// The path of the tip like a long exposure. `points`: oldest first, with their `ages` (s).
/// `reach`: radius of the circle (px).
export function drawTrace(
  canvas: Canvas,
  points: readonly Place[],
  ages: readonly number[],
  seconds: number,
  reach: number,
): void {
  const { context } = canvas;
  const fine = Math.min(1, reach / 200); // smaller lines in a small picture
  const shadeOf = (age: number) => {
    const light = 0.3 * Math.max(0, 1 - age / seconds) + 0.7 * Math.max(0, 1 - age / FRESH);
    return Math.ceil(SHADES * light);
  };
  context.save();
  context.lineJoin = 'round';
  context.globalCompositeOperation = isNight() ? 'lighter' : 'source-over'; // by night light adds up
  for (let begin = 0; begin < points.length - 1;) {
    const shade = shadeOf(ages[begin]!);
    let end = begin + 1;
    while (end < points.length - 1 && shadeOf(ages[end]!) === shade) ++end;
    const light = shade / SHADES;
    const last = end === points.length - 1;
    smooth(context, points.slice(Math.max(0, begin - 1), end + 1), begin === 0, last);
    for (const [width, alpha, color] of [
      [11, 0.1, 'link2'],
      [5, 0.22, 'link2'],
      [1.8, 1, 'trace'],
    ] as const) {
      context.globalAlpha = alpha * light;
      context.strokeStyle = canvas.color(color);
      context.lineWidth = fine * width;
      context.stroke();
    }
    begin = end;
  }
  context.restore();
}

/// A path from middle to middle between points, rounded at the points. `first` and `last`: whether
/// it includes these ends of the trace.
function smooth(
  context: CanvasRenderingContext2D,
  points: readonly Place[],
  first: boolean,
  last: boolean,
): void {
  const middle = (a: Place, b: Place): Place => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  context.beginPath();
  if (first) context.moveTo(...points[0]!);
  else context.moveTo(...middle(points[0]!, points[1]!));
  for (let i = 1; i < points.length - 1; ++i) {
    context.quadraticCurveTo(...points[i]!, ...middle(points[i]!, points[i + 1]!));
  }
  const end = points.at(-1)!;
  context.lineTo(...(last ? end : middle(points.at(-2) ?? end, end)));
}

/// A link: a rod with a shadow, round edges and a highlight.
export function drawRod(
  canvas: Canvas,
  from: Place,
  to: Place,
  color: string,
  thickness: number,
  glows: boolean,
): void {
  const { context } = canvas;
  const stroke = (style: string | CanvasGradient, width: number, [dx, dy]: Place = [0, 0]) => {
    context.beginPath();
    context.moveTo(from[0] + dx, from[1] + dy);
    context.lineTo(to[0] + dx, to[1] + dy);
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  };
  context.lineCap = 'round';
  const base = canvas.color(color);
  if (glows) for (const more of [0.5, 1, 1.6]) stroke(faded(base, 0.25), thickness * (1 + more));
  if (!forcedColors.matches) {
    const below: Place = [0.18 * thickness, 0.3 * thickness];
    for (const more of [0.4, 0.2, 0]) stroke('rgb(0 0 0 / 0.09)', thickness * (1 + more), below);
  }
  if (forcedColors.matches) stroke(canvas.color('stage'), thickness + 6); // an edge against the map
  stroke(base, thickness);
  if (!forcedColors.matches) {
    // Lit from above: the upper side is bright, whichever way the link turns.
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
    let [nx, ny] = [(from[1] - to[1]) / length, (to[0] - from[0]) / length];
    if (ny > 0 || (ny === 0 && nx > 0)) [nx, ny] = [-nx, -ny];
    const half = thickness / 2;
    const shade = context.createLinearGradient(
      from[0] + half * nx,
      from[1] + half * ny,
      from[0] - half * nx,
      from[1] - half * ny,
    );
    shade.addColorStop(0, 'rgb(255 255 255 / 0.1)');
    shade.addColorStop(0.25, 'rgb(255 255 255 / 0.5)');
    shade.addColorStop(0.45, 'rgb(255 255 255 / 0)');
    shade.addColorStop(0.6, 'rgb(0 0 0 / 0)');
    shade.addColorStop(1, 'rgb(0 0 0 / 0.42)');
    stroke(shade, thickness);
  }
  context.lineCap = 'butt';
}

/// A round piece of metal, lit from above.
function metal(canvas: Canvas, [x, y]: Place, radius: number, dark: string, bright: string): void {
  const { context } = canvas;
  const shine = context.createRadialGradient(
    x - 0.35 * radius,
    y - 0.45 * radius,
    0.1 * radius,
    x,
    y,
    1.05 * radius,
  );
  shine.addColorStop(0, bright);
  shine.addColorStop(1, dark);
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = forcedColors.matches ? canvas.color('ink') : shine;
  context.fill();
}

/// The motor behind the upper link, screwed to the wall.
export function drawHousing(canvas: Canvas, place: Place, radius: number, glows: boolean): void {
  const { context } = canvas;
  const [x, y] = place;
  if (glows) canvas.disc(x, y, 1.35 * radius, 'spread');
  if (!forcedColors.matches) {
    context.fillStyle = 'rgb(0 0 0 / 0.1)';
    for (const more of [1.18, 1.1, 1.02]) {
      context.beginPath();
      context.arc(x + 0.1 * radius, y + 0.2 * radius, more * radius, 0, 2 * Math.PI);
      context.fill();
    }
  }
  metal(canvas, place, radius, '#232936', '#6f7b90');
  metal(canvas, place, 0.86 * radius, '#3a4355', '#8e9ab0');
  for (let screw = 0; screw < 6; ++screw) {
    const angle = ((screw + 0.5) * Math.PI) / 3;
    const at: Place = [x + 0.7 * radius * Math.cos(angle), y + 0.7 * radius * Math.sin(angle)];
    metal(canvas, at, 0.08 * radius, '#0d1119', '#59647a');
  }
}

/// The motor's shaft, which turns with the upper link by `q1` (rad). Its flat side shows the angle.
export function drawHub(canvas: Canvas, place: Place, radius: number, q1: number): void {
  const { context } = canvas;
  metal(canvas, place, radius, '#4a5468', '#f3f6fb');
  context.save();
  context.translate(...place);
  context.rotate(q1);
  context.beginPath();
  context.arc(0, 0, 0.55 * radius, 0.25 * Math.PI, 0.75 * Math.PI, true);
  context.closePath();
  context.fillStyle = forcedColors.matches ? canvas.color('stage') : '#1b2130';
  context.fill();
  context.restore();
}

/// The bearing between the links.
export function drawJoint(canvas: Canvas, place: Place, radius: number): void {
  metal(canvas, place, 1.25 * radius, '#2b3243', '#a9b4c8');
  metal(canvas, place, 0.7 * radius, '#8b96ab', '#ffffff');
}
