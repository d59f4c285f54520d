import { Canvas } from '../view/canvas';

const SETTLING = 1500; // ms after a change until bars, maps and sparks come to rest
const SETTLING_FRAMES = 60; // the same in frames, where frames are rare
const SLOW = 40; // ms of a frame that is slow
const COARSE_AFTER = 60; // slow frames without a break, after which canvases have fewer pixels
const REST = 2; // rest after a slow frame during a training, in durations of the frame
const LONGEST_REST = 80; // ms

/// Calls `frame` at each frame of the screen, but only while something moves or has just changed. A
/// page at rest takes no processor time. While a training runs, the page rests after slow frames, so
/// that drawing without a graphics card leaves the processor to learning.
export class Frames {
  private readonly frame: (seconds: number) => void;
  private readonly moving: () => boolean;
  private readonly learning: () => boolean;
  private begun = false;
  private asleep = true;
  private before = 0; // ms
  private slow = 0; // slow frames without a break
  private until = 0; // ms
  private left = 0; // frames

  /// `frame` gets the time since the frame before it, s. `learning`: whether a training runs.
  constructor(frame: (seconds: number) => void, moving: () => boolean, learning: () => boolean) {
    this.frame = frame;
    this.moving = moving;
    this.learning = learning;
  }

  start(): void {
    this.begun = true;
    this.wake();
  }

  /// Call after a change.
  wake(): void {
    this.until = performance.now() + SETTLING;
    this.left = SETTLING_FRAMES;
    if (!this.begun || !this.asleep) return;
    this.asleep = false;
    this.before = performance.now();
    requestAnimationFrame(this.draw);
  }

  /// Wakes when any of these elements comes into sight or changes its size.
  watch(elements: readonly Element[]): void {
    const wake = () => this.wake();
    const [sizes, sights] = [new ResizeObserver(wake), new IntersectionObserver(wake)];
    for (const element of elements) {
      sizes.observe(element);
      sights.observe(element);
    }
  }

  /// The screen has shown the last drawing.
  private readonly next = (now: number): void => {
    const took = now - this.before; // ms
    this.slow = took > SLOW ? this.slow + 1 : 0;
    if (this.slow === COARSE_AFTER) Canvas.coarse = true;
    if (this.slow === 0 || !this.learning()) return this.draw(now);
    setTimeout(() => requestAnimationFrame(this.draw), Math.min(REST * took, LONGEST_REST));
  };

  private readonly draw = (now: number): void => {
    const seconds = Math.max(0, now - this.before) / 1000;
    this.before = now;
    this.frame(seconds);
    this.asleep = !this.moving() && --this.left < 0 && now > this.until;
    if (!this.asleep) requestAnimationFrame(this.next);
  };
}
