import { element, write } from '../page/dom';
import { warn } from '../page/message';
import { sentence, withMinus } from '../text';
import { Canvas } from '../view/canvas';
import type { Session } from './session';

/// The reward of a training as an expression (docs/howto/reward.md), and how much each of its terms
/// brings.

/// The built-in reward as an expression.
export const USUAL_REWARD =
  'energy: E; height: h; balance: 5*inverted; calm: -0.01*inverted*(w1^2 + w2^2); effort: -(0.01 + 0.04*inverted)*tau^2';
const EMPTY = 'The reward is empty. Write a term, such as h, or go back to the first one.';
const ROW = 18; // px
const NAME = 96; // px, of a name at the left
const VALUE = 52; // px, of a number at the right

/// The editor of the reward, with its problem and the chart of its terms.
export class RewardPanel {
  private readonly text = element<HTMLTextAreaElement>('reward-text');
  private readonly canvas = new Canvas('reward-terms');
  private refused = false; // because it is empty

  /// `learn`: starts a training.
  constructor(learn: () => void) {
    this.set(undefined);
    element('reward-learn').addEventListener('click', learn);
    this.text.addEventListener('input', () => (this.refused = false));
    element('reward-reset').addEventListener('click', () => this.set(undefined));
  }

  /// Whether there is a reward. An empty text is none: says so.
  check(): boolean {
    this.refused = this.text.value.trim() === '';
    if (!this.refused) return true;
    this.text.closest('details')!.open = true;
    write(element('reward-problem'), EMPTY);
    if (this.text.offsetParent) this.text.focus();
    else warn(EMPTY); // in another view or step
    return false;
  }

  /// The expression if it is not the built-in reward.
  get changed(): string | undefined {
    const reward = this.text.value.replace(/\s+/g, ' ').trim();
    return reward === '' || reward === USUAL_REWARD ? undefined : reward;
  }

  /// Shows an expression; undefined: the built-in reward.
  set(reward: string | undefined): void {
    this.refused = false;
    this.text.value = (reward ?? USUAL_REWARD).replace(/;\s*/g, ';\n');
    if (reward) this.text.closest('details')!.open = true;
  }

  /// Shows the terms of a training, or why its reward was refused, or the
  /// warnings about it.
  show(session: Session | null): void {
    const reason = session?.state === 'failed' ? session.reason : '';
    const problems = reason.startsWith('reward:') ? [reason] : (session?.last?.warnings ?? []);
    write(element('reward-problem'), this.refused ? EMPTY : problems.map(sentence).join(' '));
    const sums = session ? session.terms : [];
    this.canvas.element.hidden = sums.length === 0;
    this.canvas.element.style.height = `${ROW * sums.length}px`;
    if (sums.length > 0) this.draw(sums);
  }

  /// One row for each term: its name, its means over the trials, and the last one.
  private draw(terms: readonly { name: string; means: readonly number[] }[]): void {
    const { canvas } = this;
    canvas.clear();
    const all = terms.flatMap(({ means }) => means);
    const [low, high] = [Math.min(0, ...all), Math.max(1e-9, ...all)];
    const width = canvas.width - NAME - VALUE;
    terms.forEach(({ name, means }, k) => {
      const bottom = ROW * (k + 1) - 3;
      const y = (value: number) => bottom - ((value - low) / (high - low)) * (ROW - 5);
      canvas.text(name, 0, ROW * (k + 0.5), 'left', 'ink');
      canvas.line([[NAME, y(0)] as const, [NAME + width, y(0)] as const], 'faint', 1);
      const step = width / Math.max(1, means.length - 1);
      if (means.length > 1) {
        canvas.line(
          means.map((value, i) => [NAME + i * step, y(value)] as const),
          'torque',
        );
      }
      canvas.text(shown(means), canvas.width, ROW * (k + 0.5), 'right');
    });
    const now = terms.map(({ name, means }) => `${name} ${shown(means)}`);
    canvas.element.ariaLabel = `Reward per step of each term: ${now.join(', ')}`;
  }
}

/// The last of some means; a dash without one.
function shown(means: readonly number[]): string {
  const last = means.at(-1);
  return last === undefined ? '–' : withMinus(last.toFixed(2));
}
