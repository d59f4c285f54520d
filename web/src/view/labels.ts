import type { Canvas } from './canvas';

/// A word next to a thing on the stage.
export interface Label {
  at: 'motor' | 'goal' | 'link2' | 'ghost' | 'ring';
  text: string;
}

/// A label's place: `gap` pixels from (x, y) in the direction (nx, ny).
export interface Anchor {
  x: number;
  y: number;
  nx: number;
  ny: number;
  gap: number;
}

/// Writes a label on its own background, so that a link behind it does not cross its letters. A
/// label that would leave the box goes to the other side of its anchor.
export function drawLabel(
  canvas: Canvas,
  text: string,
  size: number,
  { x, y, nx, ny, gap }: Anchor,
  box: { left: number; right: number; top: number },
): void {
  const { context } = canvas;
  context.font = canvas.font(`600 ${size}px`);
  const [width, height] = [context.measureText(text).width + size, 1.5 * size];
  const far = gap + (Math.abs(nx) * width + Math.abs(ny) * height) / 2;
  const [low, high] = [box.left + width / 2 + 4, box.right - width / 2 - 4];
  const fits = (at: number) => at >= low && at <= high;
  const side = fits(x + far * nx) || !fits(x - far * nx) ? far : -far;
  const middle = Math.max(low, Math.min(x + side * nx, high));
  const top = Math.max(box.top, y + side * ny - height / 2);
  context.beginPath();
  context.roundRect(middle - width / 2, top, width, height, height / 2);
  context.globalAlpha = 0.88;
  context.fillStyle = canvas.color('panel');
  context.fill();
  context.globalAlpha = 1;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillStyle = canvas.color('ink');
  context.fillText(text, middle, top + height / 2);
}
