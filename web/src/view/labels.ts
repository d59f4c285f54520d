import type { Canvas } from './canvas';

/// A word beside something on the stage.
export interface Label {
  at: 'motor' | 'goal' | 'link2';
  text: string;
}

/// Writes a label at a place on the canvas, its background kept free.
export function drawLabel(canvas: Canvas, text: string, x: number, y: number): void {
  const { context } = canvas;
  context.font = '600 14px system-ui, sans-serif';
  const width = context.measureText(text).width;
  const left = Math.min(Math.max(x, 4), canvas.width - width - 12);
  context.globalAlpha = 0.85;
  canvas.rectangle(left - 4, y - 11, width + 8, 22, 'stage');
  context.globalAlpha = 1;
  context.fillStyle = canvas.color('ink');
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  context.fillText(text, left, y);
}
