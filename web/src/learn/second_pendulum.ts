import { Policy } from '../policy';
import type { LearnStage } from './scrubber';
import { nameOf } from './rivals';
import type { Session } from './session';

/// The second pendulum of a race: the newest policy of the other side's first training.
export class SecondPendulum {
  private readonly twin: LearnStage['twin'];
  private file: ArrayBuffer | null = null; // of the policy that it shows
  private policy: Policy | null = null;

  constructor(twin: LearnStage['twin']) {
    this.twin = twin;
  }

  /// Call after each report, while the training is on the stage. Null: there is no race.
  show(session: Session | null): void {
    const newest = session?.newest ?? null;
    const file = newest?.file instanceof ArrayBuffer ? newest.file : null;
    const isShown = this.policy !== null && this.twin.policy === this.policy;
    if (file === this.file && (isShown || file === null)) return;
    this.file = file;
    const before = this.policy;
    this.policy = file && new Policy(file);
    if (this.policy) this.twin.change(this.policy, nameInRace(session!, newest!.step));
    else if (isShown) this.twin.show(null, '');
    before?.controller.close();
  }
}

/// A contender and how long it has learned.
export function nameInRace({ agent, settings }: Session, step: number): string {
  return `${nameOf(agent, settings)}, after ${step.toLocaleString('en')} steps`;
}
