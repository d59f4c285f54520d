import type { Range } from '../pendulum';
import { withMinus } from '../text';

/// Sliders with a label, a value, a reset button, and a mark for the agent's range in training.

export interface SliderSpec {
  name: string;
  label: string;
  unit: string;
  min: number;
  max: number;
  /// Limits for links and policies. A value beyond the slider's range extends it.
  limits: Range;
  step: number;
  initial: number;
  /// Text of a value; by default with its unit.
  format?: (value: number) => string;
}

const clamp = (value: number, [low, high]: Range) => Math.min(Math.max(value, low), high);

/// Restores a slider when a touch on it becomes a scroll.
export function restoreOnScroll(): void {
  let before = '';
  const ofSlider = (use: (input: HTMLInputElement) => void) => (event: PointerEvent) => {
    const { target } = event;
    if (target instanceof HTMLInputElement && target.type === 'range') use(target);
  };
  addEventListener(
    'pointerdown',
    ofSlider(({ value }) => (before = value)),
    { capture: true },
  );
  addEventListener(
    'pointercancel',
    ofSlider((input) => {
      if (input.value === before) return;
      input.value = before;
      input.dispatchEvent(new Event('input', { bubbles: true }));
    }),
  );
}

export class Slider {
  readonly element: HTMLElement;
  private readonly input: HTMLInputElement;
  private readonly output: HTMLOutputElement;
  private readonly back: HTMLButtonElement;
  private readonly mark: HTMLElement;
  private readonly spec: SliderSpec;
  private marked: Range | null = null; // the agent's range in training

  constructor(spec: SliderSpec, onInput: (value: number) => void) {
    this.spec = spec;
    const template = document.getElementById('slider') as HTMLTemplateElement;
    this.element = template.content.firstElementChild!.cloneNode(true) as HTMLElement;
    this.input = this.element.querySelector('input')!;
    this.output = this.element.querySelector('output')!;
    this.back = this.element.querySelector('button')!;
    this.mark = this.element.querySelector('.trained')!;
    const { input } = this;
    input.id = spec.name;
    this.element.querySelector('label')!.htmlFor = spec.name;
    this.label = spec.label;
    this.output.htmlFor.add(spec.name);
    this.back.ariaLabel = `Reset ${spec.label}`;
    input.addEventListener('input', () => {
      input.step = String(spec.step); // a link may have brought a value between two steps
      // A slider extended by whole steps may reach below its lower limit.
      if (clamp(this.value, spec.limits) !== this.value) {
        input.step = 'any';
        input.value = String(clamp(this.value, spec.limits));
      }
      this.show();
      onInput(this.value);
    });
    this.back.addEventListener('click', () => {
      this.value = spec.initial;
      this.input.focus(); // the button disables itself
      onInput(this.value);
    });
    this.value = spec.initial;
  }

  get value(): number {
    return Number(this.input.value);
  }

  /// Its value in words, such as "0.8 kg".
  get text(): string {
    return this.output.value;
  }

  /// Sets a value, which may lie between two steps or beyond the ends, as links and policies allow.
  set value(value: number) {
    const { step, min } = this.spec;
    const onStep = Math.abs((value - min) / step - Math.round((value - min) / step)) < 1e-6;
    this.reach(value);
    this.input.step = onStep ? String(step) : 'any';
    this.input.value = String(value);
    this.show();
  }

  set label(text: string) {
    this.element.querySelector('label')!.textContent = text;
  }

  /// Marks the agent's range in training.
  set trained(range: Range) {
    this.marked = range;
    this.mark.hidden = false;
    this.reach(this.value);
  }

  /// Extends the slider by whole steps to its value and its mark.
  private reach(value: number): void {
    const { input, spec, marked } = this;
    const wanted = [value, ...(marked ?? [])];
    const beyond = (distance: number) => spec.step * Math.max(0, Math.ceil(distance / spec.step));
    const low = spec.min - beyond(spec.min - Math.min(...wanted) - 1e-9);
    const high = spec.max + beyond(Math.max(...wanted) - spec.max - 1e-9);
    const kept = input.value;
    [input.min, input.max] = [low, high].map((end) => String(Number(end.toPrecision(12)))) as [
      string,
      string,
    ];
    if (kept !== '') input.value = kept; // the browser may have moved it to the old end
    const share = (at: number) => String(clamp((at - low) / (high - low), [0, 1]));
    if (!marked) return;
    this.mark.style.setProperty('--share-from', share(marked[0]));
    this.mark.style.setProperty('--share-to', share(marked[1]));
  }

  /// Shows its value. Call after the units of its text changed.
  show(): void {
    const { unit, format = (value) => `${Number(value.toPrecision(4))} ${unit}` } = this.spec;
    const text = withMinus(format(this.value));
    this.output.textContent = text;
    this.input.ariaValueText = text;
    this.back.disabled = this.value === this.spec.initial;
  }
}
