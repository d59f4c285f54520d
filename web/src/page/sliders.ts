/// Sliders with a label, a value, a way back, and a mark for what the agent was trained on.

export interface SliderSpec {
  name: string;
  label: string;
  unit: string;
  min: number;
  max: number;
  step: number;
  initial: number;
  /// How the value is shown; by default with its unit.
  format?: (value: number) => string;
}

export class Slider {
  readonly element: HTMLElement;
  private readonly input: HTMLInputElement;
  private readonly output: HTMLOutputElement;
  private readonly back: HTMLButtonElement;
  private readonly spec: SliderSpec;

  constructor(spec: SliderSpec, onInput: (value: number) => void) {
    this.spec = spec;
    const template = document.getElementById('slider') as HTMLTemplateElement;
    this.element = template.content.firstElementChild!.cloneNode(true) as HTMLElement;
    this.input = this.element.querySelector('input')!;
    this.output = this.element.querySelector('output')!;
    this.back = this.element.querySelector('button')!;
    const { input } = this;
    input.id = spec.name;
    [input.min, input.max, input.step] = [spec.min, spec.max, spec.step].map(String) as [
      string,
      string,
      string,
    ];
    this.element.querySelector('label')!.htmlFor = spec.name;
    this.label = spec.label;
    this.output.htmlFor.add(spec.name);
    this.back.ariaLabel = `Reset ${spec.label}`;
    input.addEventListener('input', () => {
      input.step = String(spec.step); // a link may have brought a value between two steps
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

  /// Also one between two steps of the slider, as a link may bring it.
  set value(value: number) {
    const { step, min } = this.spec;
    const onStep = Math.abs((value - min) / step - Math.round((value - min) / step)) < 1e-6;
    this.input.step = onStep ? String(step) : 'any';
    this.input.value = String(value);
    this.show();
  }

  set label(text: string) {
    this.element.querySelector('label')!.textContent = text;
  }

  /// Marks what the agent was trained on.
  set trained([low, high]: [number, number]) {
    const { min, max } = this.spec;
    const share = (value: number) => String(Math.min(Math.max((value - min) / (max - min), 0), 1));
    const mark = this.element.querySelector<HTMLElement>('.trained')!;
    mark.style.setProperty('--share-from', share(low));
    mark.style.setProperty('--share-to', share(high));
  }

  private show(): void {
    const { unit, format = (value) => `${Number(value.toPrecision(4))} ${unit}` } = this.spec;
    const text = format(this.value);
    this.output.textContent = text;
    this.input.ariaValueText = text;
    this.back.disabled = this.value === this.spec.initial;
  }
}
