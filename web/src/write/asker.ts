import type { World } from '../world';

/// Asks a controller in another thread for torques.

export const STRANGE = 'it sent something other than a torque';
const TICK = 250; // ms
const LIMIT = 12; // ticks until an answer counts as an endless loop
const START_LIMIT = 120; // the same for the first one, because the thread has to load

/// Values that are not a torque.
const KINDS: readonly unknown[] = [
  ...['NaN', 'null', 'undefined', 'boolean', 'string', 'object', 'function', 'bigint', 'symbol'],
];

/// q1, q2, w1, w2 and the time t since the start, of each pendulum.
export type Rows = Float64Array<ArrayBuffer>;

/// Why there is no torque: a text for people, and whether the controller returned another value.
export interface Refusal {
  text: string;
  returned: boolean;
}

export class Asker {
  private readonly port: MessagePort;
  private readonly onRefusal: (refusal: Refusal) => void;
  private answer: ((torques: Float64Array) => void) | null = null;
  private expected = 0; // torques of the next answer
  private ready = false; // whether the other thread has started
  private ticks = 0; // since the question
  private readonly timer: ReturnType<typeof setInterval>;

  /// `onRefusal`: called at most once; the port is closed then.
  constructor(port: MessagePort, onRefusal: (refusal: Refusal) => void) {
    this.port = port;
    this.onRefusal = onRefusal;
    port.onmessage = ({ data }) => this.hear(data);
    // Ticks instead of one long wait: a thread that is busy itself does not count.
    this.timer = setInterval(() => {
      const limit = this.ready ? LIMIT : START_LIMIT;
      if (!this.answer || ++this.ticks <= limit) return;
      const seconds = (limit * TICK) / 1000;
      this.refuse(`no torque after ${seconds} s: is there a loop without an end?`);
    }, TICK);
  }

  /// The torques (N·m) for some states. Never settles after a refusal. One question at a time.
  ask(rows: Rows): Promise<Float64Array> {
    return new Promise((resolve) => {
      this.answer = resolve;
      this.expected = rows.length / 5;
      this.ticks = 0;
      this.port.postMessage(rows);
    });
  }

  close(): void {
    clearInterval(this.timer);
    this.port.close();
  }

  private refuse(text: string, returned = false): void {
    this.close();
    this.onRefusal({ text, returned });
  }

  private hear(data: unknown): void {
    if (data === 'ready' && !this.ready) {
      this.ready = true;
      this.ticks = 0;
      return;
    }
    const { answer } = this;
    const isTorques = data instanceof Float64Array && data.length === this.expected;
    if (answer && isTorques && !data.some(Number.isNaN)) {
      this.answer = null;
      return answer(data);
    }
    const [t, kind] = Array.isArray(data) ? (data as unknown[]) : [];
    if (!answer || typeof t !== 'number' || !KINDS.includes(kind)) return this.refuse(STRANGE);
    const got = kind === 'NaN' ? kind : `${String(kind)} instead of a number`;
    this.refuse(`it returned ${got} at t = ${t.toFixed(2)} s`, true);
  }
}

/// The state and the time since the start of a pendulum.
export function rowOf({ state: { q1, q2, w1, w2 }, elapsed }: World): number[] {
  return [q1, q2, w1, w2, elapsed];
}
