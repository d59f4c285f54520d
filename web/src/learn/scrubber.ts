import { BadInput } from '../bad_input';
import { element } from '../page/dom';
import { warn } from '../page/message';
import { Policy } from '../policy';
import { sentence } from '../text';
import type { World } from '../world';
import type { Checkpoint, Course } from './course';

const ATTEMPT = 8; // s, longest attempt
const HELD = 4; // s balanced, after which an attempt ends

/// The parts of the page that the scrubber uses.
export interface LearnStage {
  readonly world: World;
  setAgentOn(on: boolean): void;
  /// Hangs the pendulum.
  reset(): void;
  readonly twin: {
    readonly policy: Policy | null; // on the second pendulum
    show(policy: Policy | null, name: string): void;
    /// Gives the second pendulum another policy while it moves on.
    change(policy: Policy, name: string): void;
  };
}

/// Puts policies of a training on the stage, where each makes one attempt after another: the newest
/// one, or an earlier one. The untrained policy can swing next to it.
export class Scrubber {
  course: Course | null = null;
  follows = true; // shows the newest policy, now and later
  step = 0; // of the policy on the stage
  checkpoint: Checkpoint | null = null; // the course's policy on the stage
  private readonly stage: LearnStage;
  private readonly onShown: () => void;
  private shown: Policy | null = null;
  private given: Checkpoint | null = null; // the last policy asked for
  private replaceable: Policy | null = null; // while it is on the stage, a newer policy replaces it
  private untrained: Policy | null = null;
  private withUntrained = false;
  private attemptBegan = 0; // s, in the world's time
  private requests = 0; // to drop late answers
  private untrainedRequests = 0; // to drop late answers

  /// `onShown`: called when another policy is on the stage.
  constructor(stage: LearnStage, onShown: () => void) {
    this.stage = stage;
    this.onShown = onShown;
  }

  /// Whether a policy of this training is on the stage.
  get onStage(): boolean {
    return this.shown !== null && this.stage.world.policy === this.shown;
  }

  /// Shows another training and follows it. `moves`: its policy acts at once.
  take(course: Course, moves = true): void {
    this.course = course;
    this.given = this.checkpoint = null;
    this.replaceable = this.stage.world.policy;
    this.follow(moves);
    void this.showUntrained(this.withUntrained);
  }

  /// Puts its policy back on the stage after a copy became the visitor's own agent.
  again(): void {
    const policy = this.follows ? this.course?.newest : this.checkpoint;
    if (policy) void this.show(policy);
  }

  /// Goes back to another training, or to none, and changes nothing on the stage.
  back(course: Course | null): void {
    this.course = course;
    this.given = this.checkpoint = null;
    this.follows = true;
    this.leave();
  }

  /// Leaves the stage to others until the next policy is shown.
  leave(): void {
    ++this.requests; // drops the policy that is loading
    this.replaceable = null;
  }

  /// Shows the newest policy, now and later.
  follow(moves = true): void {
    this.follows = true;
    const newest = this.course?.newest;
    if (newest) void this.show(newest);
    if (moves) this.restart();
  }

  /// Call after reports. If the visitor has chosen another agent, that one stays.
  update(): void {
    const newest = this.course?.newest;
    if (this.untrained === null && this.withUntrained) void this.showUntrained(true);
    if (!newest || !this.follows || newest.file === this.given?.file) return;
    if (this.stage.world.policy === this.replaceable) void this.show(newest);
  }

  /// Shows the checkpoint nearest to a step. From the last one on, follows the training.
  to(step: number): void {
    const checkpoints = this.course?.checkpoints ?? [];
    const last = checkpoints.at(-1);
    if (!last) return;
    const away = (one: Checkpoint) => Math.abs(one.step - step);
    const nearest = checkpoints.reduce((a, b) => (away(b) < away(a) ? b : a));
    if (step >= last.step || nearest === last) return this.follow();
    this.follows = false;
    void this.show(nearest);
    this.restart();
  }

  /// Shows the checkpoint `by` places later; negative: earlier.
  move(by: number): void {
    const checkpoints = this.course?.checkpoints ?? [];
    const now = this.follows
      ? checkpoints.length - 1
      : checkpoints.findLastIndex(({ step }) => step <= (this.given?.step ?? 0));
    const next = checkpoints[Math.max(now + by, 0)];
    if (next) this.to(next.step);
  }

  /// Call at each frame. Begins the next attempt when one has ended.
  attempt(): void {
    const { world } = this.stage;
    if (!this.course || !this.onStage) return;
    const { running } = this.course;
    if (!running && this.follows) return;
    const held = (world.uprightFor ?? 0) > HELD;
    if (held ? !running : world.time - this.attemptBegan < ATTEMPT) return;
    this.attemptBegan = world.time;
    this.stage.reset();
  }

  /// Shows or hides the untrained policy next to the other.
  async showUntrained(wanted: boolean): Promise<void> {
    this.withUntrained = wanted;
    const request = ++this.untrainedRequests;
    const first = wanted ? this.course?.checkpoints[0] : undefined;
    const policy = first ? await policyOf(first) : null;
    if (request !== this.untrainedRequests) return policy?.controller.close();
    const before = this.untrained;
    this.untrained = policy;
    if (before || this.untrained) this.stage.twin.show(this.untrained, 'untrained');
    before?.controller.close();
  }

  private async show(checkpoint: Checkpoint): Promise<void> {
    const request = ++this.requests;
    const { world } = this.stage;
    const { step, file } = checkpoint;
    this.given = checkpoint;
    if (file instanceof ArrayBuffer) return this.put(new Policy(file), checkpoint);
    const { policy: before } = world;
    const policy = await policyOf({ step, file });
    // Dropped if another policy was requested while this one loaded.
    if (policy && request === this.requests && world.policy === before)
      this.put(policy, checkpoint);
    else policy?.controller.close();
  }

  private put(policy: Policy, checkpoint: Checkpoint): void {
    const before = this.shown;
    const { step } = checkpoint;
    this.stage.world.policy = this.shown = this.replaceable = policy;
    this.step = step;
    this.checkpoint = checkpoint;
    element('first-name').textContent = `after ${step.toLocaleString('en')} steps`;
    before?.controller.close();
    this.onShown();
  }

  private restart(): void {
    this.stage.setAgentOn(true);
    this.stage.reset();
    this.attemptBegan = this.stage.world.time;
  }
}

/// Null, with a message, if it is missing or invalid.
async function policyOf({ step, file }: Checkpoint): Promise<Policy | null> {
  try {
    return new Policy(file instanceof ArrayBuffer ? file : await file());
  } catch (error) {
    if (!(error instanceof BadInput)) throw error;
    warn(
      sentence(
        `The agent after ${step.toLocaleString('en')} steps cannot be shown: ${error.message}`,
      ),
    );
    return null;
  }
}
