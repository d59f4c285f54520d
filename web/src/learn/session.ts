import { coreModule } from '../core';
import type { LearnSettings, Report, Test, UpdateExample } from './learner';
import type { Recipe } from './recipe';
import type { Checkpoint, Course, Episode } from './course';
import type { News, Order } from './worker';

const MOST = 64; // checkpoints; when reached, every other one is removed

export interface Example extends UpdateExample {
  update: number; // its number in the training
}

/// A training in its own worker, with its results.
export class Session implements Course {
  readonly name: string;
  readonly side: number; // in a race, 0 or 1
  readonly agent: string;
  readonly seed: number;
  readonly settings: LearnSettings;
  state: 'starting' | 'learning' | 'paused' | 'finished' | 'failed' | 'stopped' = 'starting';
  reason = ''; // why it failed
  last: Report | null = null;
  readonly episodes: Episode[] = [];
  readonly evaluations: Test[] = [];
  /// The reward's terms: each one's mean per step, for each report with trials.
  terms: { name: string; means: number[] }[] = [];
  readonly examples: Example[] = []; // one for each report with updates
  slow: boolean; // whether its start is still slow
  checkpoints: Checkpoint[] = [];
  policy: ArrayBuffer | null = null; // latest one
  best: ArrayBuffer | null = null; // best evaluated one
  poses: Float32Array = new Float32Array(); // q1, q2 (rad) of each training pendulum
  updatesPerSecond = 0; // lately, evaluations included
  seconds = 0; // of the worker, without pauses
  private apart = 0; // steps between checkpoints
  private readonly worker: Worker;
  private readonly onNews: () => void;

  /// `contender`: its name and side in a race. `slow`: whether it starts slowly. `onNews`: called
  /// after each change.
  constructor(
    { agent, seed, settings }: Recipe,
    onNews: () => void,
    contender: { name: string; side: number } | null = null,
    slow = false,
  ) {
    this.slow = slow;
    this.name = contender ? `${contender.name}, seed ${seed}` : `seed ${seed}`;
    this.side = contender?.side ?? 0;
    this.agent = agent;
    this.seed = seed;
    this.settings = settings;
    this.onNews = onNews;
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = ({ data }: MessageEvent<News>) => this.hear(data);
    this.worker.onerror = (event) => {
      event.preventDefault();
      this.fail(
        navigator.onLine
          ? 'its worker could not start, or broke off'
          : 'the device is offline, and this part of the page has not been loaded yet',
      );
    };
    this.tell({ kind: 'start', module: coreModule(), agent, seed, settings, slow });
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

  /// Ends a slow start.
  hurry(): void {
    this.slow = false;
    this.tell({ kind: 'hurry' });
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
    const { report, policy, best, seconds, example, isMark } = news;
    this.slow &&= news.slow;
    if (this.last && seconds > this.seconds) {
      const rate = (report.updates - this.last.updates) / (seconds - this.seconds);
      this.updatesPerSecond += 0.3 * (rate - this.updatesPerSecond);
    }
    this.seconds = seconds;
    const isNew = report.updates !== this.last?.updates;
    if (example && isNew) this.examples.push({ ...example, update: report.updates });
    this.last = report;
    this.policy = policy;
    for (const { step, length, return: sum } of report.episodes)
      this.episodes.push({ step, reward: sum / length });
    this.sumTerms(report);
    this.evaluations.push(...report.evaluations);
    if (best) this.best = best;
    const { steps: step, episodeCount: trials, updates } = report;
    const checkpoint = { step, file: policy, after: { trials, updates, seconds } };
    if (isMark) this.keep(checkpoint, report.finished);
    if (report.finished) {
      this.state = 'finished';
      this.worker.terminate();
    } else if (this.state === 'starting') {
      this.state = 'learning';
    }
    this.onNews();
  }

  private sumTerms({ terms, episodes }: Report): void {
    if (this.terms.length === 0) this.terms = terms.map((name) => ({ name, means: [] }));
    if (episodes.length === 0) return;
    this.terms.forEach(({ means }, k) => {
      const sum = episodes.reduce((all, { terms, length }) => all + terms[k]! / length, 0);
      means.push(sum / episodes.length);
    });
  }

  /// Keeps the same checkpoints of a seed each time.
  private keep(checkpoint: Checkpoint, always: boolean): void {
    const before = this.checkpoints.at(-1);
    if (before && !always && checkpoint.step - before.step < this.apart) return;
    this.checkpoints.push(checkpoint);
    if (this.checkpoints.length <= MOST) return;
    this.checkpoints = this.checkpoints.filter((_, i) => i % 2 === 0);
    this.apart = this.checkpoints[1]!.step - this.checkpoints[0]!.step;
  }
}
