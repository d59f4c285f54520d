import { coreModule } from '../core';
import type { LearnSettings, Report } from './learner';
import type { News, Order } from './worker';

/// A policy along the way.
export interface Checkpoint {
  step: number;
  file: ArrayBuffer;
}

const APART = 1500; // steps between checkpoints, at first
const MOST = 64; // checkpoints; beyond that every other one goes

/// A training in a worker of its own, and what has become known of it.
export class Session {
  readonly agent: string;
  readonly seed: number;
  readonly settings: LearnSettings;
  state: 'starting' | 'learning' | 'paused' | 'finished' | 'failed' | 'stopped' = 'starting';
  reason = ''; // why it failed
  last: Report | null = null;
  readonly episodes: { step: number; return: number }[] = [];
  readonly evaluations: { step: number; success: number; return: number }[] = [];
  checkpoints: Checkpoint[] = [];
  policy: ArrayBuffer | null = null; // as it stands
  best: Checkpoint | null = null; // at an evaluation
  updatesPerSecond = 0; // lately, evaluations included
  seconds = 0; // since it began, without pauses
  private apart = APART;
  private readonly worker: Worker;
  private readonly onNews: () => void;
  private heard = performance.now(); // ms, when it last ran

  /// `onNews` is called whenever something has changed.
  constructor(agent: string, seed: number, settings: LearnSettings, onNews: () => void) {
    this.agent = agent;
    this.seed = seed;
    this.settings = settings;
    this.onNews = onNews;
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = ({ data }: MessageEvent<News>) => this.hear(data);
    this.worker.onerror = (event) => {
      event.preventDefault();
      this.fail('its worker could not start, or broke off');
    };
    this.tell({ kind: 'start', module: coreModule(), agent, seed, settings });
  }

  get running(): boolean {
    return this.state === 'starting' || this.state === 'learning';
  }

  pause(): void {
    if (!this.running) return;
    this.state = 'paused';
    this.tell({ kind: 'pause' });
  }

  resume(): void {
    if (this.state !== 'paused') return;
    this.state = 'learning';
    this.heard = performance.now();
    this.tell({ kind: 'resume' });
  }

  /// Ends it; what is known stays.
  stop(): void {
    if (this.running || this.state === 'paused') this.state = 'stopped';
    this.worker.terminate();
  }

  private tell(order: Order): void {
    this.worker.postMessage(order);
  }

  private fail(reason: string): void {
    this.state = 'failed';
    this.reason = reason;
    this.worker.terminate();
    this.onNews();
  }

  private hear(news: News): void {
    if (news.kind === 'failed') return this.fail(news.reason);
    const { report, policy, best } = news;
    const now = performance.now();
    const passed = (now - this.heard) / 1000;
    this.heard = now;
    if (this.last) {
      this.seconds += passed;
      const rate = (report.updates - this.last.updates) / passed;
      this.updatesPerSecond += 0.3 * (rate - this.updatesPerSecond);
    }
    this.last = report;
    this.policy = policy;
    this.episodes.push(...report.episodes);
    this.evaluations.push(...report.evaluations);
    if (best) this.best = { step: report.bestStep, file: best };
    this.keep({ step: report.steps, file: policy }, report.finished);
    if (report.finished) {
      this.state = 'finished';
      this.worker.terminate();
    } else if (this.state === 'starting') {
      this.state = 'learning';
    }
    this.onNews();
  }

  private keep(checkpoint: Checkpoint, always: boolean): void {
    const before = this.checkpoints.at(-1);
    if (before && !always && checkpoint.step - before.step < this.apart) return;
    this.checkpoints.push(checkpoint);
    if (this.checkpoints.length <= MOST) return;
    this.checkpoints = this.checkpoints.filter((_, i) => i % 2 === 0);
    this.apart *= 2;
  }
}
