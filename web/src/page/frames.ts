const SETTLING = 1500; // ms after a change until bars, maps and sparks come to rest
const SETTLING_FRAMES = 60; // the same in frames, where frames are rare

/// Calls `frame` at each frame of the screen, but only while something moves or has just changed. A
/// page at rest takes no processor time.
export class Frames {
  private readonly frame: (seconds: number) => void;
  private readonly moving: () => boolean;
  private begun = false;
  private asleep = true;
  private before = 0; // ms
  private until = 0; // ms
  private left = 0; // frames

  /// `frame` gets the time since the frame before it, s.
  constructor(frame: (seconds: number) => void, moving: () => boolean) {
    this.frame = frame;
    this.moving = moving;
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
    requestAnimationFrame(this.next);
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

  private readonly next = (now: number): void => {
    const seconds = Math.max(0, now - this.before) / 1000;
    this.before = now;
    this.frame(seconds);
    this.asleep = !this.moving() && --this.left < 0 && now > this.until;
    if (!this.asleep) requestAnimationFrame(this.next);
  };
}
