import type { Canvas } from './canvas';

/// A word beside something on the stage.
export interface Label {
  at: 'motor' | 'goal' | 'link2';
  text: string;
}

/// Writes a label at a place on the canvas, an edge of the background around its letters.
export function drawLabel(canvas: Canvas, text: string, x: number, y: number): void {
  const { context } = canvas;
  context.font = canvas.font('600 15px');
  const width = context.measureText(text).width;
  const left = Math.min(Math.max(x, 4), canvas.width - width - 12);
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  context.lineJoin = 'round';
  context.lineWidth = 5;
  context.strokeStyle = canvas.color('stage');
  context.strokeText(text, left, y);
  context.fillStyle = canvas.color('ink');
  context.fillText(text, left, y);
}
