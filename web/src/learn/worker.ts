import { Core } from '../core';
import { Learner } from './learner';
import type { LearnSettings, Report } from './learner';

/// Learns in a thread of its own, in slices, and tells of each.

const SLICE = 30; // ms, after which messages are heard
const TELL = 200; // ms between snapshots of the policy

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
      seconds: number; // since it began, evaluations included, pauses not
    }
  | { kind: 'poses'; poses: Float32Array<ArrayBuffer> } // of the pendulums: q1, q2 of each (rad)
  | { kind: 'failed'; reason: string };

let learner: Learner | null = null;
let paused = false;
let scheduled = false;
let told = 0; // ms, when it last told
let ran = 0; // ms, before it was last paused
let resumed = 0; // ms, when it last began or was resumed
let bestStep = 0;

function tell(): void {
  const report = learner!.report();
  const policy = learner!.policy();
  // The best one only when there is a new one.
  const best = report.bestStep > bestStep ? learner!.best() : null;
  bestStep = report.bestStep;
  told = performance.now();
  const seconds = (ran + told - resumed) / 1000;
  send({ kind: 'report', report, policy, best, seconds }, best ? [policy, best] : [policy]);
}

function show(): void {
  const poses = learner!.poses();
  send({ kind: 'poses', poses }, [poses.buffer]);
}

function send(news: News, transfer: Transferable[] = []): void {
  postMessage(news, { transfer });
}

/// A slice, and then the next, until the training ends or is paused.
function work(): void {
  scheduled = false;
  if (!learner || paused) return;
  try {
    const begin = performance.now();
    let more = true;
    while (more && performance.now() - begin < SLICE) more = learner.run(4);
    if (!more || performance.now() - told >= TELL) tell();
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
    if (paused) ran += performance.now() - resumed;
    else resumed = performance.now();
    return schedule();
  }
  const { module, agent, seed, settings } = data;
  try {
    learner = new Learner(await Core.start(module), agent, seed, settings);
    resumed = performance.now();
    tell();
  } catch (error) {
    return fail(error);
  }
  schedule();
};
