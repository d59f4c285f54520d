import { Canvas } from '../view/canvas';

const SETTLING = 1500; // ms after a change until bars, maps and sparks come to rest
const SETTLING_FRAMES = 60; // the same in frames, where frames are rare
const SLOW = 40; // ms of a frame that is slow
const COARSE_AFTER = 60; // slow frames without a break, after which canvases have fewer pixels
const REST = 2; // rest after a slow frame during a training, in durations of the frame
const LONGEST_REST = 80; // ms
const STILL_AFTER = 12; // frames without a visible motion, after which the page looks less often
const TICK = 50; // ms between two looks of a page without a visible motion
const STREAK = 3; // ticks with a motion without a break, after which each frame is drawn again

/// What the frames advance and draw.
export interface Moving {
  /// Advances time by `seconds`.
  advance(seconds: number): void;
  draw(): void;
  /// Whether time goes on.
  readonly moving: boolean;
  /// Whether a drawing would show something new.
  readonly visible: boolean;
  /// Whether that is a sudden change, such as a shove.
  readonly sudden: boolean;
  /// Call in place of draw() while there is nothing new to see: words and slow changes.
  rest(): void;
  /// Whether a training runs.
  readonly learning: boolean;
}

/// Draws at each frame of the screen, but only while something visible moves or has just changed. A
/// balanced pendulum is advanced and not drawn; a page at rest takes no processor time. While a
/// training runs, the page rests after slow frames, so that drawing without a graphics card leaves
/// the processor to learning.
export class Frames {
  private readonly page: Moving;
  private begun = false;
  private asleep = true;
  private before = 0; // ms
  private slow = 0; // slow frames without a break
  private until = 0; // ms
  private left = 0; // frames
  private still = 0; // frames without a visible motion
  private streak = 0; // ticks with a visible motion
  private timer = 0; // of the next tick; 0: none
  private advancing = false;

  constructor(page: Moving) {
    this.page = page;
  }

  start(): void {
    this.begun = true;
    this.wake();
  }

  /// Call after a change.
  wake(): void {
    this.until = performance.now() + SETTLING;
    this.left = SETTLING_FRAMES;
    if (!this.begun) return;
    if (this.timer !== 0) return this.quicken();
    if (!this.asleep) return;
    this.asleep = false;
    this.before = performance.now();
    requestAnimationFrame(this.draw);
  }

  /// Call after each change of the world. Its own steps wake the page only by what they show.
  stir(): void {
    if (this.asleep || !this.advancing) this.wake();
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
    if (this.slow === 0 || !this.page.learning) return this.draw(now);
    setTimeout(() => requestAnimationFrame(this.draw), Math.min(REST * took, LONGEST_REST));
  };

  private readonly draw = (now: number): void => {
    const { page } = this;
    this.advance(now);
    this.still = page.visible ? 0 : this.still + 1;
    page.draw();
    const settled = --this.left < 0 && now > this.until;
    this.asleep = settled && !page.moving;
    if (this.asleep) return;
    if (settled && this.still > STILL_AFTER) return this.later();
    requestAnimationFrame(this.next);
  };

  private advance(now: number): void {
    const seconds = Math.max(0, now - this.before) / 1000;
    this.before = now;
    this.advancing = true;
    this.page.advance(seconds);
    this.advancing = false;
  }

  private later(): void {
    this.timer = window.setTimeout(this.tick, TICK);
  }

  /// Draws each frame again.
  private quicken(): void {
    clearTimeout(this.timer);
    this.timer = this.streak = this.still = 0;
    this.before = performance.now();
    requestAnimationFrame(this.draw);
  }

  /// Advances a page without a visible motion.
  private readonly tick = (): void => {
    const { page } = this;
    this.advance(performance.now());
    this.streak = page.visible ? this.streak + 1 : 0;
    if (page.sudden || this.streak >= STREAK || !page.moving) return this.quicken();
    if (this.streak > 0) page.draw();
    else page.rest();
    this.later();
  };
}
