import { button, element, write } from '../page/dom';
import { signed } from '../view/charts';
import type { UpdateExample } from './learner';
import type { Session } from './session';

/// How a DQN agent learns, with the numbers of the training that is shown: its random torques, its
/// memory, one update, and what it expected against what it got.
export class Lesson {
  private readonly guesses = element('lesson-guesses');
  private shown: UpdateExample | null = null; // waits for the visitor's guess, or has its answer
  private answered = false;

  constructor() {
    button('lesson-up', () => this.answer(true));
    button('lesson-down', () => this.answer(false));
    button('lesson-next', () => (this.shown = null));
  }

  /// Call after each change. `rewardScale`: factor of the rewards in the agent's values.
  show(session: Session | null, rewardScale: number): void {
    const example = session?.example ?? null;
    element('lesson').hidden = example === null;
    if (!example) return;
    const meter = (id: string, value: number, text: string) => {
      element<HTMLMeterElement>(id).value = value;
      write(element(`${id}-text`), text);
    };
    meter('lesson-random', example.epsilon, percent(example.epsilon));
    const [filled, all] = [example.remembered, example.capacity];
    meter('lesson-memory', filled / all, `${whole(filled)} of ${whole(all)} steps`);
    const test = session!.evaluations.at(-1);
    const expected = test ? `${whole(test.expected)}, and got ${whole(test.attained)}` : '–';
    write(element('lesson-test'), expected);
    if (!this.shown) this.ask(example, rewardScale);
  }

  /// Asks whether a guess will go up or down.
  private ask(example: UpdateExample, rewardScale: number): void {
    const scaled = (value: number) => value / rewardScale;
    this.shown = {
      ...example,
      guess: scaled(example.guess),
      corrected: scaled(example.corrected),
      reward: scaled(example.reward),
      target: scaled(example.target),
    };
    this.answered = false;
    const { torque, guess } = this.shown;
    write(
      element('lesson-guess'),
      `In a step that it remembers, it turned with ${signed(torque)} N·m and guessed that all ` +
        `rewards from there on are worth ${points(guess)}. Will it correct this guess up or down?`,
    );
    this.arrange();
  }

  private answer(up: boolean): void {
    if (!this.shown) return;
    const { guess, reward, target, corrected } = this.shown;
    const right = up === target > guess;
    write(
      element('lesson-answer'),
      `${right ? 'Right' : 'No'}: the step and those after it brought ${points(reward)}, and ` +
        `from there it expects ${points(target - reward)} more. The target is ` +
        `${points(target)}, so the guess ${points(guess)} became ${points(corrected)}` +
        `${target > guess === corrected > guess ? '.' : ': other steps pulled it away.'}`,
    );
    this.answered = true;
    this.arrange();
  }

  private arrange(): void {
    this.guesses.hidden = this.answered;
    element('lesson-answer').hidden = !this.answered;
    element('lesson-next').hidden = !this.answered;
  }
}

const percent = (share: number) => `${Math.round(100 * share)}%`;
const whole = (count: number) => Math.round(count).toLocaleString('en');
const points = (reward: number) => signed(Number(reward.toFixed(1)));
