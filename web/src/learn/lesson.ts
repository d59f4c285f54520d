import { button, element, write } from '../page/dom';
import { withMinus } from '../text';
import { signed } from '../view/charts';
import type { Example, Session } from './session';

/// How a DQN agent learns, with the numbers of the training that is shown: its random torques, its
/// memory, updates of its network, and what it expected against what it got.
export class Lesson {
  private readonly guesses = element('lesson-guesses');
  private session: Session | null = null;
  private rewardScale = 1;
  private asked: Question | null = null; // waits for the visitor's guess, or has its answer
  private readonly done = new Set<number>(); // updates that were asked about

  constructor() {
    button('lesson-up', () => this.answer(true));
    button('lesson-down', () => this.answer(false));
    button('lesson-next', () => this.next());
  }

  /// Whether there is a question.
  get asks(): boolean {
    return this.asked !== null;
  }

  /// Call after each change. `rewardScale`: factor of the rewards in the agent's values.
  show(session: Session | null, rewardScale: number): void {
    if (session !== this.session) {
      this.asked = null;
      this.done.clear();
    }
    [this.session, this.rewardScale] = [session, rewardScale];
    const example = session?.examples.at(-1);
    element('lesson').hidden = !example;
    if (!session || !example) return;
    const meter = (id: string, value: number, text: string) => {
      element<HTMLMeterElement>(id).value = value;
      write(element(`${id}-text`), text);
    };
    meter('lesson-random', example.epsilon, percent(example.epsilon));
    const [filled, all] = [example.remembered, example.capacity];
    meter('lesson-memory', filled / all, `${whole(filled)} steps`);
    const test = session.evaluations.at(-1);
    element('lesson-tested').hidden = !test;
    if (test) {
      const [expected, attained] = [whole(test.expected), whole(test.attained)];
      write(element('lesson-test'), `${expected} points, and got ${attained}`);
    }
    if (!this.asked) this.next();
  }

  /// Asks about the newest update that was not asked about yet, if there is one with another answer
  /// than the last.
  private next(): void {
    const { session, rewardScale, asked, done } = this;
    const all = session!.examples.flatMap((example) => questionOf(example, rewardScale) ?? []);
    if (all.every(({ update }) => done.has(update))) {
      done.clear();
      if (asked && all.length > 1) done.add(asked.update); // not again at once
    }
    const open = all.filter(({ update }) => !done.has(update)).reverse();
    const other = open.find((question) => !asked || rises(question) !== rises(asked));
    this.asked = other ?? open[0] ?? null;
    if (this.asked) done.add(this.asked.update);
    element('lesson-question').hidden = !this.asked;
    if (!this.asked) return;
    const { update, torque, guess, reward, next } = this.asked;
    write(
      element('lesson-guess'),
      `Update ${whole(update)} looks at a remembered step. The agent turned with ` +
        `${signed(torque)}\u00a0N·m and guessed ${points(guess)} points. Then it got ` +
        `${points(reward)}, and from there it expects ${points(next)} more. Will its guess go up ` +
        `or down?`,
    );
    this.arrange(false);
  }

  private answer(up: boolean): void {
    if (!this.asked) return;
    const { guess, reward, next, target, corrected } = this.asked;
    const goesUp = rises(this.asked);
    const sum = `${points(reward)} ${next < 0 ? '−' : '+'} ${points(Math.abs(next))}`;
    write(
      element('lesson-answer'),
      `${up === goesUp ? 'Right' : 'No'}: ${sum} = ${points(target)} is ` +
        `${goesUp ? 'more' : 'less'} than ${points(guess)}. The guess went ` +
        `${goesUp ? 'up' : 'down'}, to ${points(corrected)}.`,
    );
    this.arrange(true);
  }

  private arrange(answered: boolean): void {
    this.guesses.hidden = answered;
    element('lesson-answer').hidden = !answered;
    element('lesson-next').hidden = !answered;
  }
}

/// An update, in tenths of a point: the numbers add up as they are shown.
interface Question {
  readonly update: number; // its number
  readonly torque: number; // N·m
  readonly guess: number;
  readonly reward: number;
  readonly next: number; // expected after the reward
  readonly target: number; // reward + next
  readonly corrected: number;
}

/// Whether the guess goes up.
const rises = ({ guess, target }: Question) => target > guess;

/// Null for an update that does not move clearly towards its target: other remembered steps pull,
/// too.
export function questionOf(example: Example, rewardScale: number): Question | null {
  const tenths = (value: number) => Math.round((10 * value) / rewardScale);
  const { update, torque } = example;
  const [guess, corrected] = [tenths(example.guess), tenths(example.corrected)];
  const [reward, target] = [tenths(example.reward), tenths(example.target)];
  const share = (corrected - guess) / (target - guess);
  if (!(share >= CLEAR && share <= 1)) return null;
  return { update, torque, guess, reward, next: target - reward, target, corrected };
}

const CLEAR = 0.1; // share of the way to the target

const percent = (share: number) => `${Math.round(100 * share)}%`;
const whole = (count: number) => Math.round(count).toLocaleString('en');
const points = (tenths: number) => withMinus((tenths / 10).toFixed(1));
