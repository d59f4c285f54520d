const NEAR = '100px'; // from the edge of the screen
const SHARPEST = 2; // pixels of the screen per CSS pixel; 1 on a slow device

/// A canvas as sharp as the screen, in CSS pixels, with colours from the style sheet. If that sets
/// --zoom, letters and lines grow with it.
export class Canvas {
  /// Whether this device draws slowly. Then each canvas has fewer pixels from its next drawing on.
  static coarse = false;
  readonly element: HTMLCanvasElement;
  readonly context: CanvasRenderingContext2D;
  zoom = 1; // CSS pixels per pixel
  width = 0; // pixels
  height = 0;
  letters = 0; // size of the text around it, in CSS pixels
  private seen = true; // on the screen, or near it
  private colors = new Map<string, string>();
  private family: string | null = null;
  private coarse = false; // whether it has fewer pixels

  constructor(id: string) {
    this.element = document.getElementById(id) as HTMLCanvasElement;
    this.context = this.element.getContext('2d')!;
    new ResizeObserver(() => this.resize()).observe(this.element);
    const look = ([entry]: IntersectionObserverEntry[]) => (this.seen = entry!.isIntersecting);
    new IntersectionObserver(look, { rootMargin: NEAR }).observe(this.element);
    this.resize();
  }

  /// Whether a drawing would be visible now.
  get shown(): boolean {
    return this.seen && this.width > 0;
  }

  /// The colour with this name in the style sheet.
  color(name: string): string {
    let color = this.colors.get(name);
    if (color === undefined) {
      // Set as the canvas's own CSS colour, which resolves light-dark(). The canvas has no other
      // use for it.
      this.element.style.color = `var(--${name})`;
      color = getComputedStyle(this.element).color;
      this.colors.set(name, color);
    }
    return color;
  }

  /// The page's text face at a size, such as '600 14px'.
  font(size: string): string {
    this.family ??= getComputedStyle(this.element).fontFamily;
    return `${size} ${this.family}`;
  }

  /// Call when the theme changed.
  forgetColors(): void {
    this.colors.clear();
  }

  /// Call before each drawing.
  clear(): void {
    if (this.coarse !== Canvas.coarse) this.resize();
    this.context.clearRect(0, 0, this.width, this.height);
  }

  text(text: string, x: number, y: number, align: CanvasTextAlign = 'left', color = 'quiet'): void {
    this.context.font = this.font('12px');
    this.context.fillStyle = this.color(color);
    this.context.textAlign = align;
    this.context.textBaseline = 'middle';
    this.context.fillText(text, x, y);
  }

  line(points: readonly (readonly [number, number])[], color: string, width = 1.5): void {
    const { context } = this;
    context.beginPath();
    for (const [x, y] of points) context.lineTo(x, y);
    context.strokeStyle = this.color(color);
    context.lineWidth = width;
    context.stroke();
  }

  /// Fills the area between a line and the height `bottom`.
  area(points: readonly (readonly [number, number])[], bottom: number, color: string): void {
    this.fill([[points[0]![0], bottom], ...points, [points.at(-1)![0], bottom]], color);
  }

  fill(points: readonly (readonly [number, number])[], color: string): void {
    const { context } = this;
    context.beginPath();
    for (const [x, y] of points) context.lineTo(x, y);
    context.fillStyle = this.color(color);
    context.fill();
  }

  rectangle(x: number, y: number, width: number, height: number, color: string): void {
    this.context.fillStyle = this.color(color);
    this.context.fillRect(x, y, width, height);
  }

  disc(x: number, y: number, radius: number, color: string): void {
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.context.fillStyle = this.color(color);
    this.context.fill();
  }

  circle(x: number, y: number, radius: number, color: string, width: number): void {
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.context.strokeStyle = this.color(color);
    this.context.lineWidth = width;
    this.context.stroke();
  }

  private resize(): void {
    const style = getComputedStyle(this.element);
    this.zoom = Number(style.getPropertyValue('--zoom')) || 1;
    this.letters = parseFloat(style.fontSize);
    this.coarse = Canvas.coarse;
    const ratio = this.zoom * Math.min(window.devicePixelRatio || 1, this.coarse ? 1 : SHARPEST);
    this.width = this.element.clientWidth / this.zoom;
    this.height = this.element.clientHeight / this.zoom;
    const [width, height] = [this.width, this.height].map((side) => Math.round(side * ratio));
    // Resizing clears a canvas, even to the same size.
    if (this.element.width !== width!) this.element.width = width!;
    if (this.element.height !== height!) this.element.height = height!;
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }
}
