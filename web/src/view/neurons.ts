import type { Neurons } from '../neurons';
import { Canvas } from './canvas';

const LEFT = 84; // px, for the names of the rows
const NARROW = 360; // px, width below which counts have two lines
const NARROW_LEFT = 58; // px, for those
/// Names of the inputs, each over a number of them.
const INPUTS = [
  ['upper', 3],
  ['lower', 3],
  ['energy, height', 2],
] as const;
const NAMED = 8; // inputs with these names
const NAMES = 16; // px, above the inputs
const GAP = 4; // px, between rows
const LINE = 11; // px, lowest row with its own name, and a line of it
const EASE = 0.3; // share of the way to a new brightness, at each drawing
const FADE = 0.98; // factor of a row's reference brightness per drawing

/// The neurons of a layer, or the inputs.
interface Row {
  shown: Float32Array; // brightness, eased; negative for a negative input
  most: number; // largest recent size, drawn brightest
}

/// An agent's inputs, and below them its neurons layer by layer, each as bright as it is active.
/// Negative inputs have another colour.
export class NeuronChart {
  readonly canvas = new Canvas('neurons');
  private neurons: Neurons | null = null; // of the rows
  private rows: Row[] = [];

  draw(neurons: Neurons | null, observation: Float32Array): void {
    const { canvas } = this;
    canvas.clear();
    if (!neurons) return;
    const layers = [observation, ...neurons.active(observation)];
    if (this.neurons !== neurons) {
      this.rows = layers.map(({ length }) => ({ shown: new Float32Array(length), most: 0 }));
    }
    this.neurons = neurons;
    const named = observation.length === NAMED ? NAMES : 0;
    if (named > 0) this.nameInputs();
    const height = (canvas.height - named - GAP * (layers.length - 1)) / layers.length;
    layers.forEach((layer, i) => {
      const y = named + i * (height + GAP);
      const name = [`${layer.length}`, i === 0 ? 'inputs' : 'neurons'];
      if (height >= LINE || i === 0) this.nameRow(name, y, height);
      this.drawRow(layer, this.rows[i]!, y, height);
    });
    if (height >= LINE) return;
    const middle = (named + height + canvas.height) / 2;
    canvas.text('neurons', this.left - 8, middle, 'right');
  }

  private get left(): number {
    return this.canvas.width < NARROW ? NARROW_LEFT : LEFT;
  }

  /// A count and a noun next to a row: on one line, or on two lines, or the count.
  private nameRow([count, noun]: string[], y: number, height: number): void {
    const isNarrow = this.left < LEFT && noun === 'neurons';
    const lines = !isNarrow ? [`${count} ${noun}`] : height < 3 * LINE ? [count!] : [count!, noun!];
    const first = y + height / 2 - ((lines.length - 1) * (LINE + 3)) / 2;
    lines.forEach((line, k) =>
      this.canvas.text(line, this.left - 8, first + k * (LINE + 3), 'right'),
    );
  }

  /// Each name above its inputs.
  private nameInputs(): void {
    const { canvas, left } = this;
    const width = (canvas.width - left) / NAMED;
    let k = 0;
    for (const [name, count] of INPUTS) {
      const middle = left + (k + count / 2) * width;
      const last = k + count === NAMED;
      canvas.text(name, last ? canvas.width : middle, NAMES / 2, last ? 'right' : 'center');
      k += count;
    }
  }

  private drawRow(layer: Float32Array, row: Row, y: number, height: number): void {
    const { canvas, left } = this;
    const { context } = canvas;
    const width = (canvas.width - left) / layer.length;
    const space = width > 8 ? 2 : width > 3 ? 1 : 0;
    canvas.rectangle(left, y, canvas.width - left, height, 'bar');
    row.most = Math.max(FADE * row.most, 1e-6, ...layer.map(Math.abs));
    layer.forEach((value, k) => {
      row.shown[k]! += EASE * (value / row.most - row.shown[k]!);
      const share = Math.abs(row.shown[k]!);
      if (share < 0.02) return;
      context.globalAlpha = Math.min(1, share);
      const color = row.shown[k]! > 0 ? 'torque' : 'below';
      canvas.rectangle(left + k * width + space / 2, y, width - space, height, color);
    });
    context.globalAlpha = 1;
  }
}
