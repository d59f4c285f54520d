import { coreModule } from '../core';
import type { LearnSettings, Report } from './learner';
import type { Checkpoint, Course } from './course';
import type { News, Order } from './worker';

const APART = 1500; // steps between checkpoints, at first
const MOST = 64; // checkpoints; when reached, every other one is removed

/// A training in its own worker, with its results.
export class Session implements Course {
  readonly name: string;
  readonly agent: string;
  readonly seed: number;
  readonly settings: LearnSettings;
  state: 'starting' | 'learning' | 'paused' | 'finished' | 'failed' | 'stopped' = 'starting';
  reason = ''; // why it failed
  last: Report | null = null;
  readonly episodes: { step: number; return: number }[] = [];
  readonly evaluations: { step: number; success: number; return: number }[] = [];
  checkpoints: Checkpoint[] = [];
  policy: ArrayBuffer | null = null; // latest one
  best: ArrayBuffer | null = null; // best evaluated one
  poses: Float32Array = new Float32Array(); // q1, q2 (rad) of each training pendulum
  updatesPerSecond = 0; // lately, evaluations included
  seconds = 0; // of the worker, without pauses
  private apart = APART;
  private readonly worker: Worker;
  private readonly onNews: () => void;

  /// `onNews`: called after each change.
  constructor(agent: string, seed: number, settings: LearnSettings, onNews: () => void) {
    this.name = `seed ${seed}`;
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

  /// Whether it learns or is paused.
  get active(): boolean {
    return this.running || this.state === 'paused';
  }

  get steps(): number {
    return this.last?.steps ?? 0;
  }

  /// The latest policy; once the task is solved, the best one.
  get newest(): Checkpoint | null {
    if (this.best && this.last?.solved) return { step: this.last.bestStep, file: this.best };
    return this.policy && { step: this.steps, file: this.policy };
  }

  pause(): void {
    if (!this.running) return;
    this.state = 'paused';
    this.tell({ kind: 'pause' });
  }

  resume(): void {
    if (this.state !== 'paused') return;
    this.state = 'learning';
    this.tell({ kind: 'resume' });
  }

  /// Ends the training; its results stay.
  stop(): void {
    if (this.active) this.state = 'stopped';
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
    if (news.kind === 'poses') return void (this.poses = news.poses);
    const { report, policy, best, seconds } = news;
    if (this.last && seconds > this.seconds) {
      const rate = (report.updates - this.last.updates) / (seconds - this.seconds);
      this.updatesPerSecond += 0.3 * (rate - this.updatesPerSecond);
    }
    this.seconds = seconds;
    this.last = report;
    this.policy = policy;
    this.episodes.push(...report.episodes);
    this.evaluations.push(...report.evaluations);
    if (best) this.best = best;
    const { steps: step, episodeCount: trials, updates } = report;
    this.keep({ step, file: policy, after: { trials, updates, seconds } }, report.finished);
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
