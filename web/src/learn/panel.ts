import { button, element } from '../page/dom';
import { onThemeChange } from '../page/theme';
import { Policy } from '../policy';
import type { World } from '../world';
import { LearnChart, stepsOf } from './chart';
import { Knobs } from './knobs';
import './learn.css';
import { Session } from './session';
import type { Checkpoint } from './session';

/// An agent learns in this page, and the stage shows its attempts.

const ATTEMPT = 8; // s, after which the next begins
const HELD = 4; // s balanced, after which it does
const SEEDS_AT_ONCE = 4;
const LEARNED = 'learned here'; // how files are named that the page made

/// What the panel does with the page.
export interface LearnStage {
  readonly world: World;
  readonly agents: { readonly ownName: string | null };
  setAgentOn(on: boolean): void;
  /// From hanging.
  reset(): void;
  openFile(file: File): Promise<void>;
  readonly twin: { show(policy: Policy | null, name: string): void };
}

export class LearnPanel {
  private readonly stage: LearnStage;
  private readonly chart = new LearnChart();
  private readonly knobs = new Knobs(element('learn-knobs'));
  private readonly scrub = element<HTMLInputElement>('learn-scrub');
  private readonly seed = element<HTMLInputElement>('learn-seed');
  private readonly four = element<HTMLInputElement>('learn-four');
  private readonly ghost = element<HTMLInputElement>('learn-ghost');
  private readonly agent = element<HTMLSelectElement>('learn-agent');
  private sessions: Session[] = [];
  private chosen: Session | null = null;
  private follows = true; // the stage shows the newest policy, not an earlier one
  private shown: Policy | null = null; // on the stage, by this panel
  private shownFile: ArrayBuffer | null = null;
  private shownStep = 0;
  private attemptBegan = 0; // s, in the world's time
  private untrained: Policy | null = null; // beside it
  private said = '';
  private scheduled = false;

  constructor(stage: LearnStage) {
    this.stage = stage;
    button('learn-start', () => this.toggle());
    button('learn-again', () => this.start());
    button('learn-save', () => this.save());
    button('learn-keep', () => void this.keep());
    button('learn-reset', () => this.knobs.reset());
    this.agent.addEventListener('change', () => this.knobs.show(this.agent.value));
    this.ghost.addEventListener('change', () => this.showGhost());
    this.scrub.addEventListener('input', () => this.scrubTo(Number(this.scrub.value)));
    element('learn-seeds').addEventListener('change', (event) => {
      this.choose(Number((event.target as HTMLInputElement).value));
    });
    this.knobs.show(this.agent.value);
    onThemeChange(() => {
      this.chart.canvas.forgetColors();
      this.draw();
    });
    new ResizeObserver(() => this.draw()).observe(this.chart.canvas.element);
  }

  /// Trains anew, with the seed and the settings that are chosen.
  start(): void {
    for (const session of this.sessions) session.stop();
    const first = Math.min(Math.max(Math.round(Number(this.seed.value)) || 0, 0), 1e9);
    this.seed.value = String(first);
    const count = this.four.checked ? SEEDS_AT_ONCE : 1;
    this.sessions = Array.from(
      { length: count },
      (_, i) => new Session(this.agent.value, first + i, this.knobs.changed, () => this.news()),
    );
    this.chosen = this.sessions[0]!;
    this.follows = true;
    this.shownFile = null;
    this.showGhost();
    this.listSeeds();
    this.stage.setAgentOn(true);
    this.stage.reset();
    this.attemptBegan = this.stage.world.time;
    this.draw();
  }

  /// Ends what still learns.
  stop(): void {
    for (const session of this.sessions) session.stop();
    this.draw();
  }

  /// How it goes, in a sentence.
  get story(): string {
    const session = this.chosen;
    if (session?.state === 'failed') return sentence(session);
    if (!session?.last) return '';
    const steps = session.last.steps.toLocaleString('en');
    const success = session.evaluations.at(-1)?.success ?? 0;
    if (session.state === 'stopped') return '';
    if (session.state !== 'learning') return sentence(session);
    const tested =
      success > 0 ? `, it succeeds in ${(100 * success).toFixed(0)}% of its tests` : '';
    return `After ${steps} steps in ${session.last.episodeCount} trials${tested} …`;
  }

  /// Learns, pauses, resumes.
  toggle(): void {
    const active = this.sessions.filter(({ running, state }) => running || state === 'paused');
    if (active.length === 0) return this.start();
    const resume = active.every(({ state }) => state === 'paused');
    for (const session of active) {
      if (resume) session.resume();
      else session.pause();
    }
    this.draw();
  }

  /// At each frame: the next attempt begins when one has ended.
  follow(): void {
    const { world } = this.stage;
    if (!this.chosen || this.shown === null || world.policy !== this.shown) return;
    if (!this.chosen.running && this.follows) return;
    const held = (world.uprightFor ?? 0) > HELD;
    if (!held && world.time - this.attemptBegan < ATTEMPT) return;
    if (held && !this.chosen.running) return;
    this.attemptBegan = world.time;
    this.stage.reset();
  }

  /// A training had news: drawn once a frame, however many there are.
  private news(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.showNewest();
      this.draw();
      void this.takeOver();
    });
  }

  private showNewest(): void {
    if (!this.follows || !this.chosen?.policy || this.chosen.policy === this.shownFile) return;
    // Somebody chose another agent meanwhile: that stays.
    if (this.shownFile && this.stage.world.policy !== this.shown) return;
    this.show({ step: this.chosen.last!.steps, file: this.chosen.policy });
  }

  private show({ step, file }: Checkpoint): void {
    const before = this.shown;
    this.shown = new Policy(file);
    this.shownFile = file;
    this.shownStep = step;
    this.stage.world.policy = this.shown;
    before?.controller.close();
    if (this.ghost.checked && !this.untrained) this.showGhost();
  }

  /// The policy that knew nothing, beside the other; or nobody.
  private showGhost(): void {
    const untrained = this.ghost.checked && this.chosen?.checkpoints[0];
    const before = this.untrained;
    this.untrained = untrained ? new Policy(untrained.file) : null;
    if (before || this.untrained) this.stage.twin.show(this.untrained, 'untrained');
    before?.controller.close();
  }

  private choose(seed: number): void {
    this.chosen = this.sessions.find((session) => session.seed === seed) ?? null;
    this.scrubTo(Infinity);
  }

  /// Puts the checkpoint that is nearest to a step on the stage; the last one is the policy as it is.
  private scrubTo(step: number): void {
    const session = this.chosen;
    const last = session?.checkpoints.at(-1);
    if (!session || !last) return;
    const away = (one: Checkpoint) => Math.abs(one.step - step);
    const nearest = session.checkpoints.reduce((a, b) => (away(b) < away(a) ? b : a));
    this.follows = step >= last.step || nearest === last;
    this.show(this.follows ? { step: session.last!.steps, file: session.policy! } : nearest);
    this.stage.setAgentOn(true);
    this.stage.reset();
    this.attemptBegan = this.stage.world.time;
    this.draw();
  }

  /// The best policy of a training that has solved the task stays on the stage and in this browser,
  /// unless that would replace a file that the visitor brought.
  private async takeOver(): Promise<void> {
    const solved = this.chosen?.state === 'finished' && this.chosen.last!.solved;
    if (!solved || !this.follows || this.stage.world.policy !== this.shown) return;
    const { ownName } = this.stage.agents;
    if (ownName === null || ownName.startsWith(LEARNED)) await this.keep();
  }

  /// Keeps the best policy as the visitor's own.
  private async keep(): Promise<void> {
    const file = this.file();
    if (file) await this.stage.openFile(file);
  }

  private save(): void {
    const file = this.file();
    if (!file) return;
    const link = document.createElement('a');
    link.href = URL.createObjectURL(file);
    link.download = 'policy.safetensors';
    link.click();
    URL.revokeObjectURL(link.href);
  }

  private file(): File | null {
    const session = this.chosen;
    const bytes = session?.best?.file ?? session?.policy;
    if (!session || !bytes) return null;
    return new File([bytes], `${LEARNED}, ${session.agent}, seed ${session.seed}`);
  }

  private listSeeds(): void {
    const place = element('learn-seeds');
    place.hidden = this.sessions.length < 2;
    place.replaceChildren(
      ...this.sessions.map(({ seed }, i) => {
        const label = document.createElement('label');
        const input = document.createElement('input');
        input.type = 'radio';
        input.name = 'learn-which';
        input.value = String(seed);
        input.checked = i === 0;
        label.append(input, ` seed ${seed} `, document.createElement('output'));
        return label;
      }),
    );
  }

  private draw(): void {
    const session = this.chosen;
    const at = session && this.shown ? this.shownStep : null;
    this.chart.draw(this.sessions, session, at);
    const active = this.sessions.filter(({ running, state }) => running || state === 'paused');
    const paused = active.length > 0 && active.every(({ state }) => state === 'paused');
    const label = active.length === 0 ? 'Learn' : paused ? 'Go on' : 'Pause';
    element('learn-start').textContent = label;
    element<HTMLButtonElement>('learn-again').disabled = this.sessions.length === 0;
    const has = session !== null && session.policy !== null;
    element<HTMLButtonElement>('learn-save').disabled = !has;
    element<HTMLButtonElement>('learn-keep').disabled = !has;
    this.scrub.disabled = !session || session.checkpoints.length < 2;
    if (!session) return;
    const outputs = [...element('learn-seeds').querySelectorAll('output')];
    this.sessions.forEach((other, i) => {
      if (outputs[i]) outputs[i].textContent = brief(other);
    });
    this.scrub.max = String(stepsOf(this.sessions));
    this.scrub.value = String(this.follows ? (session.last?.steps ?? 0) : this.shownStep);
    this.scrub.ariaValueText = `after ${this.shownStep.toLocaleString('en')} steps`;
    const { last } = session;
    if (last) this.drawNumbers(session, last.steps, last.updates, last.episodeCount);
    this.say(sentence(session));
  }

  private drawNumbers(session: Session, steps: number, updates: number, trials: number): void {
    const write = (id: string, text: string) => (element(`learn-${id}`).textContent = text);
    const success = session.evaluations.at(-1)?.success;
    write('steps', steps.toLocaleString('en'));
    write('trials', trials.toLocaleString('en'));
    write('updates', updates.toLocaleString('en'));
    write('rate', session.updatesPerSecond.toFixed(0));
    write('time', `${session.seconds.toFixed(1)} s`);
    write('success', success === undefined ? '–' : `${(100 * success).toFixed(0)}%`);
    const where = this.follows
      ? 'as it is now'
      : `after ${this.shownStep.toLocaleString('en')} steps`;
    write('where', `on the stage: ${where}`);
  }

  /// Said once, for those who listen.
  private say(text: string): void {
    if (text === this.said) return;
    this.said = text;
    element('learn-status').textContent = text;
  }
}

function brief({ state, last, seconds }: Session): string {
  if (state === 'failed') return 'failed';
  if (last?.solved) return `solved in ${seconds.toFixed(1)} s`;
  return state === 'finished' ? 'not solved' : '';
}

function sentence(session: Session): string {
  const { state, last, reason, seconds, settings } = session;
  if (state === 'failed') return `It cannot learn so: ${reason}.`;
  if (state === 'paused') return 'Paused.';
  if (state === 'stopped') return 'Ended.';
  if (state !== 'finished' || !last) return 'Learning …';
  const steps = last.steps.toLocaleString('en');
  if (!last.solved) return `Not solved within ${steps} steps.`;
  const own = Object.keys(settings).length > 0 ? ', with your settings' : '';
  return `Solved after ${steps} steps and ${seconds.toFixed(1)} s${own}.`;
}
