import type { Moment, World } from '../world';
import { button, element, write } from './dom';
import { prefersStill } from './motion';
import { LOST, makeSteps } from './steps';
import type { Stage, Step } from './steps';
import type { Scene } from '../view/scene';

const FRAMES = 6; // between two calls of a step's answer

/// The guided tour. Each step has one sentence, one control and one marked thing.
export class Tour {
  private readonly steps: readonly Step[];
  private readonly dots: HTMLButtonElement[];
  private readonly onStep: () => void;
  private readonly start: HTMLButtonElement; // shown for reduced motion
  private readonly twin: Scene;
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
    this.twin = stage.twin.scene;
    this.steps = makeSteps(stage).filter(({ agents }) => agents.every(has));
    this.dots = this.steps.map((step, i) => {
      const dot = document.createElement('button');
      dot.type = 'button';
      dot.textContent = String(i + 1);
      dot.ariaLabel = `Step ${i + 1}: ${heading(step).textContent}`;
      dot.addEventListener('click', () => void this.go(i + 1, true));
      return dot;
    });
    element('dots').append(...this.dots);
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
    return `tour=${this.number}${code && `&ghost=${code}`}`;
  }

  /// The shown step's heading.
  get title(): string {
    return this.now ? heading(this.now).textContent : '';
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
    element<HTMLButtonElement>('tour-back').disabled = i === 0;
    element('tour-next').hidden = i === this.steps.length - 1;
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
    if (this.now && this.frame++ % FRAMES === 0) this.say(this.now.answer?.(world) ?? '');
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
