import { quantity, roundBelow } from '../quantity';
import type { Canvas } from './canvas';

/// Signs of how large the pendulum is: a bar with its length, and a matchbox or a person.

const MARGIN = 14; // px to the edges of the box
const LONGEST = 0.26; // length of the bar, in widths of the box
const TICK = 4; // px
const PERSON = 1.75; // m
const NAMED = 70; // px, width with room for its name
const MATCHBOX = { width: 0.053, height: 0.036 } as const; // m

/// A box on the canvas (px).
export interface Box {
  left: number;
  right: number;
  bottom: number;
}

/// Draws both at the bottom of the box. `metre`: length of a metre (px). `large`: whether the
/// pendulum is larger than usual.
export function drawSize(canvas: Canvas, box: Box, metre: number, large: boolean): void {
  const y = box.bottom - MARGIN;
  const length = roundBelow((LONGEST * (box.right - box.left)) / metre);
  const [from, to] = [box.left + MARGIN, box.left + MARGIN + length * metre];
  const bar = [
    [from, y - TICK],
    [from, y],
    [to, y],
    [to, y - TICK],
  ] as const;
  canvas.line(bar, 'quiet', 1.5);
  canvas.text(lengthText(length), (from + to) / 2, y - 10, 'center');
  const right = box.right - MARGIN;
  if (large) drawPerson(canvas, right, y, PERSON * metre);
  else drawMatchbox(canvas, right, y, MATCHBOX.width * metre, MATCHBOX.height * metre);
}

function lengthText(length: number): string {
  if (length >= 1) return quantity(length, 1, 'm');
  return length < 0.01 ? quantity(1000 * length, 1, 'mm') : quantity(100 * length, 1, 'cm');
}

/// A person of this height, whose right side is at x and whose feet are at y.
function drawPerson(canvas: Canvas, x: number, y: number, height: number): void {
  const { context } = canvas;
  const middle = x - 0.14 * height;
  const stroke = (points: readonly (readonly [number, number])[], width: number) => {
    const places = points.map(
      ([across, up]) => [middle + across * height, y - up * height] as const,
    );
    canvas.line(places, 'quiet', width * height);
  };
  context.lineCap = 'round';
  for (const side of [-1, 1]) {
    stroke(
      [
        [side * 0.075, 0.04],
        [side * 0.045, 0.48],
      ],
      0.075,
    ); // a leg
    stroke(
      [
        [side * 0.125, 0.42],
        [side * 0.1, 0.76],
      ],
      0.055,
    ); // an arm
  }
  stroke(
    [
      [0, 0.5],
      [0, 0.74],
    ],
    0.19,
  );
  stroke(
    [
      [0, 0.92],
      [0, 0.92],
    ],
    0.16,
  ); // the head
  context.lineCap = 'butt';
}

/// A matchbox, whose lower right corner is at (x, y), with its name if there is room.
function drawMatchbox(canvas: Canvas, x: number, y: number, width: number, height: number): void {
  const { context } = canvas;
  const [left, top] = [x - width, y - height];
  canvas.rectangle(left, top, width, height, 'faint');
  canvas.rectangle(left, top + 0.8 * height, width, 0.2 * height, 'grid'); // the striking surface
  context.strokeStyle = canvas.color('grid');
  context.lineWidth = 1;
  context.strokeRect(left, top, width, height);
  if (width > NAMED) canvas.text('matchbox', left + width / 2, top + 0.4 * height, 'center');
}
