import { startCore } from '../core';
import { Policy } from '../policy';
import { Asker } from './asker';
import type { Refusal } from './asker';
import { scoreOf } from './score';
import type { Score } from './score';

/// Scores controllers in its own thread, because the page draws meanwhile.

/// A policy's file, a controller's name, or the port of a visitor's controller.
export type Contender = ArrayBuffer | string | MessagePort;

export interface Task {
  module: WebAssembly.Module;
  contender: Contender;
}

export type Result =
  | { kind: 'progress'; share: number }
  | { kind: 'score'; score: Score }
  | { kind: 'refused'; refusal: Refusal };

const tell = (result: Result) => postMessage(result);

onmessage = async ({ data: { module, contender } }: MessageEvent<Task>): Promise<void> => {
  await startCore(module);
  const controller =
    contender instanceof MessagePort
      ? new Asker(contender, (refusal) => tell({ kind: 'refused', refusal }))
      : new Policy(contender);
  const score = await scoreOf(controller, (share) => tell({ kind: 'progress', share }));
  tell({ kind: 'score', score });
};
