import { CONTROL_PERIOD } from '../pendulum';
import type { Curve } from '../view/charts';

/// A policy from some step of a training.
export interface Checkpoint {
  step: number;
  file: ArrayBuffer | (() => Promise<ArrayBuffer>); // function: fetches the file
  /// Counts up to this step, if known.
  after?: { trials: number; updates: number; seconds: number };
}

/// Control steps of a shipped agent's test (10 s).
const TEST_STEPS = 10 / CONTROL_PERIOD;

export interface Episode {
  step: number; // of the training, at its end
  reward: number; // mean of its steps
}

/// A training as the chart draws it and the scrubber moves through it.
export interface Course {
  readonly name: string; // for the list of trainings
  readonly steps: number; // so far
  readonly running: boolean;
  /// Episodes of the training, called trials on the page. (Attempts are those on the stage.)
  readonly episodes: readonly Episode[];
  readonly evaluations: readonly { step: number; success: number }[];
  readonly checkpoints: readonly Checkpoint[]; // the untrained policy first
  readonly newest: Checkpoint | null;
}

/// The recorded training of a shipped agent: its evaluations, and checkpoints, each fetched once
/// when needed.
export class Recording implements Course {
  readonly name: string;
  readonly running = false;
  readonly episodes: readonly Episode[];
  readonly evaluations: readonly { step: number; success: number }[];
  readonly checkpoints: readonly Checkpoint[];

  /// `fetch` gets the file with a name.
  constructor(
    name: string,
    { step: steps, success_rate, mean_return }: Curve,
    files: readonly { step: number; file: string }[],
    fetch: (file: string) => Promise<ArrayBuffer>,
  ) {
    this.name = name;
    this.episodes = steps.map((step, i) => ({ step, reward: mean_return[i]! / TEST_STEPS }));
    this.evaluations = steps.map((step, i) => ({ step, success: success_rate[i]! }));
    this.checkpoints = files.map(({ step, file }) => ({ step, file: once(() => fetch(file)) }));
  }

  get steps(): number {
    return this.checkpoints.at(-1)!.step;
  }

  get newest(): Checkpoint {
    return this.checkpoints.at(-1)!;
  }
}

/// Calls `get` once and keeps its result, unless it fails.
function once<T>(get: () => Promise<T>): () => Promise<T> {
  let got: Promise<T> | null = null;
  return () => {
    got ??= get().catch((error: unknown) => {
      got = null;
      throw error;
    });
    return got;
  };
}
