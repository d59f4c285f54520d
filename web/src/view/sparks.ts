import type { Canvas } from './canvas';

const SECONDS = 1.4;
const COUNT = 36;

/// Sparks where the pendulum was caught.
export class Sparks {
  private begun = -Infinity; // ms

  light(): void {
    this.begun = performance.now();
  }

  get fly(): boolean {
    return performance.now() - this.begun < 1000 * SECONDS;
  }

  /// Around (x, y), thrown up to `reach` pixels.
  draw(canvas: Canvas, x: number, y: number, reach: number): void {
    const t = (performance.now() - this.begun) / 1000 / SECONDS;
    if (t >= 1) return;
    const { context } = canvas;
    const out = 1 - (1 - t) ** 3; // first fast, then slow
    for (let i = 0; i < COUNT; ++i) {
      // The golden angle spreads directions evenly.
      const angle = i * 2.39996;
      const far = reach * out * (0.4 + ((i * 13) % COUNT) / COUNT);
      const fall = 0.5 * reach * t * t;
      context.globalAlpha = (1 - t) ** 1.5;
      const color = ['spark', 'link1', 'link2', 'good'][i % 4]!;
      canvas.disc(x + far * Math.cos(angle), y + far * Math.sin(angle) + fall, 4 - 2 * t, color);
    }
    context.globalAlpha = 1;
  }
}
