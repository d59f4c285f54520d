import { Core } from '../core';
import { Learner } from './learner';
import type { LearnSettings, Report } from './learner';

/// Learns in its own thread, in slices, and reports its progress.

const SLICE = 30; // ms between checks for messages
const REPORT_INTERVAL = 200; // ms between snapshots of the policy
const PART = 4; // steps of all environments between looks at the clock
const MARK = 12; // parts between the snapshots that every training with this seed makes

export type Order =
  | {
      kind: 'start';
      module: WebAssembly.Module;
      agent: string;
      seed: number;
      settings: LearnSettings;
    }
  | { kind: 'pause' | 'resume' };

export type News =
  | {
      kind: 'report';
      report: Report;
      policy: ArrayBuffer;
      best: ArrayBuffer | null;
      seconds: number; // including evaluations, without pauses
      isMark: boolean; // whether every training with this seed makes this snapshot
    }
  | { kind: 'poses'; poses: Float32Array<ArrayBuffer> } // q1, q2 of each pendulum (rad)
  | { kind: 'failed'; reason: string };

let learner: Learner | null = null;
let paused = false;
let scheduled = false;
let reportedAt = 0; // ms, time of the last report
let ranBefore = 0; // ms, before the last pause
let resumedAt = 0; // ms, time of the start or the last resumption
let bestStep = 0;
let parts = 0; // run so far

function sendReport(isMark: boolean): void {
  const report = learner!.report();
  const policy = learner!.policy();
  // The best policy, only when it is a new one.
  const best = report.bestStep > bestStep ? learner!.best() : null;
  bestStep = report.bestStep;
  reportedAt = performance.now();
  const seconds = (ranBefore + reportedAt - resumedAt) / 1000;
  send({ kind: 'report', report, policy, best, seconds, isMark }, best ? [policy, best] : [policy]);
}

function show(): void {
  const poses = learner!.poses();
  send({ kind: 'poses', poses }, [poses.buffer]);
}

function send(news: News, transfer: Transferable[] = []): void {
  postMessage(news, { transfer });
}

/// Trains for a slice and schedules the next, until the training ends or is paused.
function work(): void {
  scheduled = false;
  if (!learner || paused) return;
  try {
    const begin = performance.now();
    let more = true;
    while (more && performance.now() - begin < SLICE) {
      more = learner.run(PART);
      if (more && ++parts % MARK === 0) sendReport(true);
    }
    if (!more || performance.now() - reportedAt >= REPORT_INTERVAL) sendReport(!more);
    if (more) show();
    if (more) schedule();
    else end();
  } catch (error) {
    fail(error);
  }
}

function end(): void {
  learner?.close();
  learner = null;
}

function fail(error: unknown): void {
  learner = null;
  send({ kind: 'failed', reason: error instanceof Error ? error.message : String(error) });
}

// Sooner than setTimeout, which waits for 4 ms.
const next = new MessageChannel();
next.port1.onmessage = work;

function schedule(): void {
  if (!scheduled) next.port2.postMessage(null);
  scheduled = true;
}

onmessage = async ({ data }: MessageEvent<Order>): Promise<void> => {
  if (data.kind !== 'start') {
    paused = data.kind === 'pause';
    if (paused) ranBefore += performance.now() - resumedAt;
    else resumedAt = performance.now();
    return schedule();
  }
  const { module, agent, seed, settings } = data;
  try {
    learner = new Learner(await Core.start(module), agent, seed, settings);
    resumedAt = performance.now();
    sendReport(true);
  } catch (error) {
    return fail(error);
  }
  schedule();
};
