import type { Curve } from '../view/charts';

/// A policy along a training's way.
export interface Checkpoint {
  step: number;
  file: ArrayBuffer | (() => Promise<ArrayBuffer>); // which may have to be fetched
  /// What had happened by then, if that is known.
  after?: { trials: number; updates: number; seconds: number };
}

/// A training as it is drawn, and as one goes back and forth in it.
export interface Course {
  readonly name: string; // among those that are shown together
  readonly steps: number; // so far
  readonly running: boolean;
  /// Of training, which the page calls trials; an attempt is one on the stage.
  readonly episodes: readonly { step: number; return: number }[];
  readonly evaluations: readonly { step: number; success: number }[];
  readonly checkpoints: readonly Checkpoint[]; // the untrained policy first
  readonly newest: Checkpoint | null;
}

/// The training of an agent that comes with the page: what its evaluations said, and policies along the
/// way, which are fetched when they are asked for, once.
export class Recording implements Course {
  readonly name: string;
  readonly running = false;
  readonly episodes: readonly { step: number; return: number }[];
  readonly evaluations: readonly { step: number; success: number }[];
  readonly checkpoints: readonly Checkpoint[];

  /// `fetch` gets a file of that name.
  constructor(
    name: string,
    { step: steps, success_rate, mean_return }: Curve,
    files: readonly { step: number; file: string }[],
    fetch: (file: string) => Promise<ArrayBuffer>,
  ) {
    this.name = name;
    this.episodes = steps.map((step, i) => ({ step, return: mean_return[i]! }));
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

/// What `get` gets, got once unless it fails.
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
