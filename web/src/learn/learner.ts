import type { Core } from '../core';

/// Progress of a training since the last report (web/wasm/learner.cc).
export interface Report {
  steps: number; // control steps, over all environments
  updates: number; // gradient steps
  episodeCount: number;
  seconds: number; // of training, without evaluations
  solved: boolean; // two passed evaluations in a row
  finished: boolean;
  bestStep: number; // of the best evaluation; 0: none
  bestSuccess: number;
  terms: string[]; // names of the reward's terms (K)
  warnings: string[]; // about the settings
  /// With the number of its steps and the sum of each term.
  episodes: { step: number; length: number; return: number; terms: number[] }[];
  evaluations: Test[];
}

/// An evaluation.
export interface Test {
  step: number;
  success: number; // share of the starts
  return: number;
  expected: number; // discounted return that the agent expected at the starts, and got
  attained: number;
}

/// What a DQN agent learned from one remembered step, in units of its values (rl/agent.h).
export interface UpdateExample {
  torque: number; // N·m
  guess: number; // of all rewards to come, before the update
  corrected: number; // the same after it
  reward: number; // of the step and those joined with it
  target: number;
  epsilon: number; // share of random torques
  remembered: number; // steps
  capacity: number;
}

/// Settings by their names in the program, such as { learning_rate: '1e-3' }.
export type LearnSettings = Readonly<Record<string, string>>;

/// A training in the core.
export class Learner {
  private readonly core: Core;
  private readonly learner: number;

  /// `agent`: named agent with the defaults of the other settings. Throws BadInput.
  constructor(core: Core, agent: string, seed: number, settings: LearnSettings = {}) {
    this.core = core;
    const all = { agent, seed: String(seed), ...settings };
    const lines = Object.entries(all).map(([name, value]) => `${name}=${value}`);
    this.learner = core.withBytes(new TextEncoder().encode(lines.join('\n')), (at, size) =>
      core.expect(core.exports.learner_open(at, size)),
    );
  }

  /// Makes at most `steps` steps of all environments. False once the training is finished. Throws
  /// BadInput if numbers are no longer finite.
  run(steps: number): boolean {
    return this.core.expect(this.core.exports.learner_run(this.learner, steps)) === 1;
  }

  report(): Report {
    this.core.expect(this.core.exports.learner_report(this.learner));
    return JSON.parse(this.core.text) as Report;
  }

  /// An example of the last update; null before the first one, and for SAC.
  lastUpdate(): UpdateExample | null {
    this.core.expect(this.core.exports.learner_last_update(this.learner));
    return JSON.parse(this.core.text) as UpdateExample | null;
  }

  /// The current policy, as a file.
  policy(): ArrayBuffer {
    return this.fileOf(0);
  }

  /// The best evaluated policy; null before the first one.
  best(): ArrayBuffer | null {
    const file = this.fileOf(1);
    return file.byteLength > 0 ? file : null;
  }

  /// Both angles (rad) of each training pendulum: q1, q2, q1, q2 …
  poses(): Float32Array<ArrayBuffer> {
    this.core.expect(this.core.exports.learner_poses(this.learner));
    return new Float32Array(this.core.file);
  }

  close(): void {
    this.core.exports.learner_close(this.learner);
  }

  private fileOf(best: 0 | 1): ArrayBuffer {
    this.core.expect(this.core.exports.learner_policy(this.learner, best));
    return this.core.file;
  }
}

/// A setting of a named agent, as the program describes it.
export interface Setting {
  name: string;
  value: string;
  low: number | null; // null: unbounded, or not a number
  high: number | null;
  whole: boolean; // integers only
  unit: string;
  help: string;
}

export function agentSettings(core: Core, agent: string): Map<string, Setting> {
  core.withBytes(new TextEncoder().encode(agent), (at, size) =>
    core.expect(core.exports.agent_settings(at, size)),
  );
  const settings = JSON.parse(core.text) as Setting[];
  return new Map(settings.map((setting) => [setting.name, setting]));
}
