import { printable } from '../text';
import { STRANGE } from './asker';
import PRELUDE from './prelude.js?raw';
import SANDBOX from './sandbox.html?raw';

/// Runs a visitor's controller in a worker of a sandboxed frame. The page trusts nothing that comes
/// from there. The frame's text is a part of this script, because no service worker answers for a
/// sandboxed frame without a network.

const HEAD = 'function torque(q1, q2, w1, w2, t) {\n';
const ROWS_BEFORE = `${PRELUDE}\n${HEAD}`.split('\n').length - 1;
const LONGEST_PROBLEM = 160; // characters

/// The script of the worker: the lines of a controller as the body of a function, after the prelude.
function scriptOf(text: string): string {
  // encodeURIComponent refuses lone surrogates.
  const source = `${HEAD}${text.replace(/\p{Cs}/gu, '\ufffd')}\n}`;
  return `${PRELUDE.replace('SOURCE_LENGTH', String(source.length))}\n${source}`;
}

/// The first row with the word `import`; null if there is none. The policy forbids import(), but the
/// moment of its refusal would be a source of chance. A keyword cannot be written with escapes.
function rowOfImport(text: string): number | null {
  const place = text.search(/\bimport\b/);
  return place < 0 ? null : text.slice(0, place).split('\n').length;
}

/// Why a controller failed, in one line, and its row (from 1 on) if that is known.
export interface Problem {
  text: string;
  row: number | null;
}

export class Sandbox {
  private readonly text: string;
  private readonly port: MessagePort;
  private readonly onProblem: (problem: Problem) => void;
  private readonly frame = document.createElement('iframe');
  private ready = false; // whether the frame has the text

  /// `text`: the lines of a function of the state that returns the motor's torque (N·m). `port`: for
  /// an Asker at its other end. `onProblem`: called at most once; the worker has ended then.
  constructor(text: string, port: MessagePort, onProblem: (problem: Problem) => void) {
    this.text = text;
    this.port = port;
    this.onProblem = onProblem;
    addEventListener('message', this.hear);
    const { frame } = this;
    frame.hidden = true;
    frame.title = 'Sandbox';
    frame.sandbox.add('allow-scripts');
    frame.srcdoc = SANDBOX;
    document.body.append(frame);
  }

  /// Ends the worker.
  close(): void {
    removeEventListener('message', this.hear);
    this.frame.remove();
  }

  /// Ends the worker because of a problem.
  fail({ text, row }: Problem): void {
    this.close();
    this.onProblem({ text: printable(text, LONGEST_PROBLEM), row });
  }

  /// Messages of the frame: that it is there, or an error in the worker.
  private readonly hear = ({ data, source }: MessageEvent): void => {
    const { contentWindow } = this.frame;
    if (source === null || source !== contentWindow) return;
    if (data === 'ready' && !this.ready) {
      this.ready = true;
      const row = rowOfImport(this.text);
      if (row !== null) {
        return this.fail({ text: 'a controller cannot use the word import', row });
      }
      // An opaque origin has no name.
      contentWindow.postMessage(scriptOf(this.text), '*', [this.port]);
      return;
    }
    const { problem, row } = (data ?? {}) as { problem?: unknown; row?: unknown };
    if (typeof problem !== 'string' || typeof row !== 'number') {
      return this.fail({ text: STRANGE, row: null });
    }
    const rows = this.text.split('\n').length;
    const own = row - ROWS_BEFORE;
    const text = problem.replace(/^(uncaught exception: |Uncaught )/, '');
    if (own > rows) this.fail({ text: `${text}: is a bracket open, or one too many?`, row: rows });
    else this.fail({ text, row: own >= 1 ? own : null });
  };
}
