import type { Moment, World } from '../world';
import { button, element, write } from './dom';
import { prefersStill } from './motion';
import { note } from './message';
import { yoursOf } from './step';
import type { Stage, Step } from './step';
import { makeSteps } from './steps';
import { LOST } from './verdict';
import type { Scene } from '../view/scene';

const FRAMES = 6; // between two calls of a step's answer

/// The guided tour. Each step has one sentence, one control and one marked thing.
export class Tour {
  private readonly steps: readonly Step[];
  private readonly dots: HTMLButtonElement[];
  private readonly onStep: () => void;
  private readonly start: HTMLButtonElement; // shown for reduced motion
  private readonly list = element<HTMLSelectElement>('tour-list'); // in place of the dots
  private readonly twin: Scene;
  private readonly stage: Stage;
  private isYours = false; // whether the shown step began with the visitor's own agent
  private now: Step | null = null;
  private frame = 0;
  private last = 1; // number of the step shown last

  /// `has`: whether an agent exists. `onStep`: called when another step is shown.
  constructor(
    stage: Stage & { readonly twin: { readonly scene: Scene } },
    has: (agent: string) => boolean,
    onStep: () => void,
  ) {
    this.onStep = onStep;
    this.stage = stage;
    this.twin = stage.twin.scene;
    this.steps = makeSteps(stage).filter(({ agents }) => agents.every(has));
    this.dots = this.steps.map((step, i) => {
      const dot = document.createElement('button');
      dot.type = 'button';
      dot.textContent = String(i + 1);
      dot.ariaLabel = `Step ${i + 1}: ${plain(heading(step))}`;
      dot.addEventListener('click', () => void this.go(i + 1, true));
      return dot;
    });
    element('dots').append(...this.dots);
    this.steps.forEach((step, i) => {
      const text = `${i + 1} of ${this.steps.length}: ${plain(heading(step))}`;
      this.list.append(new Option(text, String(i + 1)));
    });
    this.list.addEventListener('change', () => void this.go(Number(this.list.value), true));
    button('tour-back', () => void this.go(this.number - 1, true));
    button('tour-next', () => void this.go(this.number + 1, true));
    this.start = button('tour-start', () => {
      stage.setAgentOn(true);
      this.start.hidden = true;
    });
  }

  /// The shown step, from 1 on; 0 outside of the tour.
  get number(): number {
    return this.now ? this.steps.indexOf(this.now) + 1 : 0;
  }

  /// The part of the address after #; empty outside of the tour.
  get address(): string {
    if (!this.now) return '';
    const code = this.now.code?.() ?? '';
    // The visitor's agent learns again where the link is opened.
    const recipe = this.now.yours ? this.stage.agents.ownRecipe : '';
    return `tour=${this.number}${code && `&ghost=${code}`}${recipe && `&${recipe}`}`;
  }

  /// The shown step's heading.
  get title(): string {
    return this.now ? plain(heading(this.now)) : '';
  }

  /// The keys that the shown step names; null outside of the tour.
  get keys(): readonly string[] | null {
    return this.now && (this.now.keys ?? []);
  }

  /// Shows the nearest existing step, or for 0 the one shown last, with a try of the game in the
  /// address. When the visitor goes there, moves the focus to it and adds it to the browser's
  /// history.
  async go(number: number, focus = false, ghost = ''): Promise<void> {
    this.leave();
    const i = Math.min(Math.max(Math.round(number) || this.last, 1), this.steps.length) - 1;
    const now = this.steps[i]!;
    this.now = now;
    this.last = i + 1;
    for (const step of this.steps) section(step).inert = step !== now;
    this.dots.forEach((dot, k) => (dot.ariaCurrent = k === i ? 'step' : null));
    this.list.value = String(i + 1);
    element<HTMLButtonElement>('tour-back').disabled = i === 0;
    element('tour-next').hidden = i === this.steps.length - 1;
    element('tour-next').textContent = i === 0 ? 'Start' : 'Next';
    this.start.hidden = !(now.moves && prefersStill());
    section(now).append(this.start);
    document.documentElement.dataset.step = now.id;
    // A training's attempts are not announced.
    element('live').ariaLive = now.id === 'learn' ? 'off' : 'polite';
    this.say('');
    if (focus) {
      history.pushState(null, '', `#tour=${i + 1}`);
      heading(now).focus({ preventScroll: true });
    }
    this.onStep();
    this.isYours = this.stage.agents.ownIsLearned;
    await now.begin(ghost);
  }

  /// Call after a click on the map started the pendulum somewhere.
  started(): void {
    this.now?.started?.();
  }

  /// Call at each control step.
  moment(moment: Moment): void {
    this.now?.moment?.(moment);
  }

  leave(): void {
    this.now?.end?.();
    this.now = null;
    delete document.documentElement.dataset.step;
    element('live').ariaLive = 'polite';
  }

  /// Call at each frame.
  follow(world: World, scene: Scene): void {
    const ghost = prefersStill() ? null : this.now?.ghost?.();
    scene.ghosts = ghost ? [ghost.q1, ghost.q2] : [];
    const labels = this.now?.labels?.(world) ?? [];
    scene.labels = this.twin.labels = labels.filter(({ at }) => at !== 'ghost' || ghost);
    if (!this.now || this.frame++ % FRAMES !== 0) return;
    this.say(this.now.answer?.(world) ?? '');
    this.takeYours();
  }

  /// Gives the step the visitor's agent once that has learned.
  private takeYours(): void {
    const { agents, world } = this.stage;
    if (!this.now?.yours || this.isYours || !agents.ownIsLearned || world.twin) return;
    this.isYours = true;
    note('Your agent has learned, and takes over.');
    void this.stage.choose(yoursOf(this.stage));
  }

  private say(text: string): void {
    const answer = this.now && section(this.now).querySelector('.answer');
    if (!answer) return;
    write(answer, text);
    answer.classList.toggle('lost', text.startsWith(LOST));
  }
}

function section({ id }: Step): HTMLElement {
  return element(`step-${id}`);
}

function heading(step: Step): HTMLElement {
  return section(step).querySelector('h2')!;
}

/// The words of an element in one line.
function plain({ textContent }: HTMLElement): string {
  return textContent.replace(/\s+/g, ' ').trim();
}
