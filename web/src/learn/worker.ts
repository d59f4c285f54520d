import { Core } from '../core';
import { CONTROL_PERIOD } from '../period';
import { Learner } from './learner';
import type { LearnSettings, Report, UpdateExample } from './learner';

/// Learns in its own thread, in slices, and reports its progress.

const SLICE = 30; // ms between checks for messages
const REPORT_INTERVAL = 200; // ms between snapshots of the policy
const PART = 4; // steps of all environments between looks at the clock
const MARK = 48; // steps between the snapshots that every training with this seed makes
// A slow start: the first trials run in real time, those after them twice as fast, and so on.
const TRIAL = 4; // s
const DOUBLINGS = 6;
const TICK = 16; // ms

export type Order =
  | {
      kind: 'start';
      module: WebAssembly.Module;
      agent: string;
      seed: number;
      settings: LearnSettings;
      slow: boolean; // whether it starts slowly
    }
  | { kind: 'pause' | 'resume' | 'hurry' };

export type News =
  | {
      kind: 'report';
      report: Report;
      policy: ArrayBuffer;
      best: ArrayBuffer | null;
      seconds: number; // including evaluations, without pauses
      example: UpdateExample | null;
      slow: boolean;
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
let ran = 0; // steps of all environments
let slow = false;
let due = 0; // steps in a slow start
let period = CONTROL_PERIOD; // s
let tickedAt = 0; // ms, time of the last tick in a slow start

function sendReport(isMark: boolean): void {
  const report = learner!.report();
  const policy = learner!.policy();
  // The best policy, only when it is a new one.
  const best = report.bestStep > bestStep ? learner!.best() : null;
  bestStep = report.bestStep;
  reportedAt = performance.now();
  const seconds = (ranBefore + reportedAt - resumedAt) / 1000;
  const example = learner!.lastUpdate();
  const news = { kind: 'report', report, policy, best, seconds, example, slow, isMark } as const;
  send(news, best ? [policy, best] : [policy]);
}

function show(): void {
  const poses = learner!.poses();
  send({ kind: 'poses', poses }, [poses.buffer]);
}

function send(news: News, transfer: Transferable[] = []): void {
  postMessage(news, { transfer });
}

/// Makes `count` steps. False once the training is finished.
function advance(count: number): boolean {
  const more = learner!.run(count);
  ran += count;
  if (more && ran % MARK === 0) sendReport(true);
  return more;
}

/// Makes the steps that are due in a slow start. False once the training is finished.
function advanceSlowly(now: number): boolean {
  const doublings = Math.floor((ran * period) / TRIAL);
  due += (Math.min(now - tickedAt, 2 * TICK) / 1000 / period) * 2 ** doublings;
  tickedAt = now;
  let more = true;
  for (; more && due >= 1; --due) more = advance(1);
  slow = doublings < DOUBLINGS;
  return more;
}

/// Trains for a slice and schedules the next, until the training ends or is paused.
function work(): void {
  scheduled = false;
  if (!learner || paused) return;
  try {
    const begin = performance.now();
    let more = true;
    if (slow) more = advanceSlowly(begin);
    else while (more && performance.now() - begin < SLICE) more = advance(PART - (ran % PART));
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
  if (scheduled) return;
  scheduled = true;
  if (slow) setTimeout(work, TICK);
  else next.port2.postMessage(null);
}

onmessage = async ({ data }: MessageEvent<Order>): Promise<void> => {
  if (data.kind === 'hurry') return void (slow = false);
  if (data.kind !== 'start') {
    paused = data.kind === 'pause';
    if (paused) ranBefore += performance.now() - resumedAt;
    else resumedAt = performance.now();
    return schedule();
  }
  const { module, agent, seed, settings } = data;
  slow = data.slow;
  period = Number(settings.control_period ?? CONTROL_PERIOD);
  try {
    learner = new Learner(await Core.start(module), agent, seed, settings);
    resumedAt = performance.now();
    sendReport(true);
  } catch (error) {
    return fail(error);
  }
  schedule();
};
