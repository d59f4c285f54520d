import { addressOf } from '../page/address';
import { send } from '../page/clipboard';
import { CONTROL_PERIOD } from '../pendulum';
import type { Learned } from '../page/laboratory';
import { sentence as asSentence } from '../text';
import type { Scene } from '../view/scene';
import { button, element } from '../page/dom';
import { note } from '../page/message';
import { prefersStill } from '../page/motion';
import { saveFile } from '../page/save';
import { onThemeChange } from '../page/theme';
import { LearnChart, stepsOf } from './chart';
import type { Checkpoint, Course, Recording } from './course';
import { Filmstrip } from './filmstrip';
import { Knobs, LEARNERS } from './knobs';
import './learn.css';
import type { LearnSettings } from './learner';
import { Lesson } from './lesson';
import { RACE_SEEDS } from './race';
import { nameOf as contenderOf } from './rivals';
import type { Rival } from './rivals';
import { RacePanel } from './race_panel';
import { RewardPanel } from './reward';
import { decodeRecipe, encodeRecipe, LARGEST_SEED } from './recipe';
import type { Recipe } from './recipe';
import { Scrubber } from './scrubber';
import type { LearnStage } from './scrubber';
import { nameInRace, SecondPendulum } from './second_pendulum';
import { Session } from './session';

/// The panel of a training. Its agent learns in this page while the stage shows its attempts. The
/// recorded training of the default agent can be shown instead.

const SEEDS_AT_ONCE = 4;
const REPORTED = 100; // ms from a report until its drawing, which also shows later reports
/// Smallest rewards per step of a trial of 4 s that prove balancing. A step earns at most 1.5 for
/// energy and 1 for height, and 5 more only while both links are up.
const DOWN = 2.5;
const UP = 5 / 4; // for a second
const PROOFS = [
  [DOWN + 2 * UP, 'for two seconds'],
  [DOWN + UP, 'for a second'],
  [DOWN, 'for a moment'],
] as const;

/// A visitor's own training, set aside.
interface Aside {
  readonly sessions: Session[];
  readonly rival: string | undefined;
  readonly course: Course | null;
}

/// A training's progress in words.
export interface Story {
  readonly count: string; // changes with each report
  readonly milestone: string;
}

/// The parts of the page that the panel uses.
export interface LearnPage extends LearnStage {
  readonly agents: {
    readonly ownName: string | null;
    readonly ownIsLearned: boolean;
    recording(id: string): Recording | null;
  };
  readonly scene: Scene;
  readonly agentTitle: string; // of the agent last chosen from the list
  /// Called when a training has begun.
  learned(): void;
  /// Keeps a policy of a training as the visitor's own. True if it is on the stage now.
  keepLearned(learned: Learned, shown: boolean): Promise<boolean>;
}

export class LearnPanel {
  private readonly page: LearnPage;
  private readonly chart = new LearnChart();
  private readonly knobs = new Knobs(element('learn-knobs'));
  private readonly scrub = element<HTMLInputElement>('learn-scrub');
  private readonly seed = element<HTMLInputElement>('learn-seed');
  private readonly four = element<HTMLInputElement>('learn-four');
  private readonly agent = element<HTMLSelectElement>('learn-agent');
  private readonly scrubber: Scrubber;
  private readonly strip: Filmstrip;
  private readonly race: RacePanel;
  private readonly lesson = new Lesson();
  private readonly reward = new RewardPanel(() => this.start());
  private readonly slow = element<HTMLInputElement>('learn-slow');
  private rival: string | undefined; // of the race that is shown
  private readonly second: SecondPendulum;
  private aside: Aside | null = null; // the visitor's own training, while another reward is tried
  private sessions: Session[] = [];
  private recording: Recording | null = null; // null: not requested
  private readonly taken = new WeakSet<Session>(); // policy taken over already
  private said = '';
  private drawnOnStage = false; // whether the last drawing had its agent on the stage
  private scheduled = false;

  /// `recorded`: agent whose recorded training can be shown.
  constructor(page: LearnPage, recorded: string) {
    this.page = page;
    this.strip = new Filmstrip(page.world);
    this.second = new SecondPendulum(page.twin);
    this.race = new RacePanel(
      () => this.start(this.race.rival),
      () => this.offerRace(),
    );
    this.scrubber = new Scrubber(page, () => this.draw());
    button('learn-start', () => this.toggle());
    button('learn-again', () => this.start());
    button('learn-save', () => this.save());
    button('learn-keep', () => void this.keep());
    button('learn-reset', () => this.knobs.reset());
    button(
      'learn-share',
      () => void send('', addressOf(this.address), 'The link to this training'),
    );
    button('learn-recorded', () => this.showRecording(recorded));
    element('learn-recorded').hidden = page.agents.recording(recorded) === null;
    this.agent.addEventListener('change', () => this.knobs.show(this.agent.value));
    this.slow.addEventListener('change', () => {
      if (!this.slow.checked) for (const session of this.sessions) session.hurry();
    });
    element('learn-panel').addEventListener('change', () => this.offerRace());
    const untrained = element<HTMLInputElement>('learn-untrained');
    untrained.addEventListener('change', () => void this.scrubber.showUntrained(untrained.checked));
    this.scrub.addEventListener('input', () => {
      this.scrubber.to(Number(this.scrub.value));
      this.draw();
    });
    // Arrow keys move by one policy.
    this.scrub.addEventListener('keydown', (event) => {
      const by = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
      if (by === undefined || event.altKey || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      this.scrubber.move(by);
      this.draw();
    });
    element('learn-courses').addEventListener('change', (event) => {
      this.choose(this.courses[Number((event.target as HTMLInputElement).value)]!);
    });
    this.knobs.show(this.agent.value);
    onThemeChange(() => {
      this.chart.canvas.forgetColors();
      this.draw();
    });
    new ResizeObserver(() => this.draw()).observe(this.chart.canvas.element);
  }

  /// Starts a training with the chosen seed and settings, or a race against a rival. If a value is
  /// invalid, shows the reason and lets the current training go on.
  start(rival: Rival | null = null): void {
    if (!this.knobs.check() || !this.reward.check()) return;
    this.endAll();
    const count = rival ? RACE_SEEDS : this.four.checked ? SEEDS_AT_ONCE : 1;
    const largest = LARGEST_SEED - (count - 1);
    const first = Math.min(Math.max(Math.round(Number(this.seed.value)) || 0, 0), largest);
    this.seed.value = String(first);
    const own = { agent: this.agent.value, settings: this.settings };
    this.sessions = [own, ...(rival ? [rival] : [])].flatMap(({ agent, settings }, side) => {
      const contender = rival ? { name: contenderOf(agent, settings), side } : null;
      return Array.from({ length: count }, (_, i) => {
        const recipe = { agent, seed: first + i, settings };
        return new Session(recipe, () => this.news(), contender, count === 1 && this.slow.checked);
      });
    });
    this.rival = rival?.id;
    this.race.begun();
    this.choose(this.sessions[0]!);
  }

  /// Ends the trainings; the panel does not show it yet.
  private endAll(): void {
    for (const session of this.sessions) session.stop();
  }

  /// Starts one training in place of all others.
  private train(recipe: Recipe): void {
    this.sessions = [new Session(recipe, () => this.news())];
    this.choose(this.sessions[0]!);
  }

  /// Trains an agent with another reward. The visitor's own training waits, and goes on if it has not
  /// ended.
  tryReward(reward: string): void {
    if (this.aside) this.endAll();
    this.aside ??= { sessions: this.sessions, rival: this.rival, course: this.scrubber.course };
    const recipe = { agent: LEARNERS[0]!, seed: 1, settings: { reward } };
    this.rival = undefined;
    this.train(recipe);
  }

  /// Ends a training with another reward, and goes back to the one before it.
  endTry(): void {
    const { aside } = this;
    if (!aside) return;
    this.endAll();
    this.sessions = aside.sessions;
    this.rival = aside.rival;
    this.aside = null;
    this.scrubber.back(aside.course);
    this.listCourses();
    this.draw();
  }

  /// The changed settings.
  private get settings(): LearnSettings {
    const reward = this.reward.changed;
    return { ...this.knobs.changed, ...(reward ? { reward } : {}) };
  }

  /// Offers a bet on a race of the chosen settings, if a rival is chosen.
  private offerRace(): void {
    this.race.offer(this.agent.value, this.settings);
    this.four.disabled = this.race.rival !== null;
    this.draw();
  }

  /// Both sides of the race that is shown; null without a race.
  private get sides(): [Session[], Session[]] | null {
    if (!this.rival || !this.session) return null;
    return [0, 1].map((side) => this.sessions.filter((one) => one.side === side)) as [
      Session[],
      Session[],
    ];
  }

  /// Starts the training of an address, unless it is shown already. Returns the problems of the
  /// address.
  open(hash: string): readonly string[] {
    const { recipe, problems } = decodeRecipe(hash, LEARNERS, (agent) =>
      this.knobs.settingsOf(agent),
    );
    const same = (one: Session) =>
      recipe !== null && encodeRecipe({ ...one, rival: this.rival }) === encodeRecipe(recipe);
    const known = this.sessions.some(same);
    if (recipe && !known) {
      this.four.checked = false;
      this.agent.value = recipe.agent;
      this.knobs.show(recipe.agent);
      this.knobs.set(recipe.settings);
      this.reward.set(recipe.settings.reward);
      this.seed.value = String(recipe.seed);
      this.race.choose(recipe.rival);
      this.offerRace();
      if (!prefersStill() && !recipe.rival) this.start(); // a race waits for a bet
    }
    return problems;
  }

  /// Trains the agent of a tour's address, for a visitor who has none.
  learnFor(hash: string): void {
    const fields = new URLSearchParams(hash.replace(/^#/, ''));
    if (!fields.has('learn') || this.sessions.length > 0) return;
    if (this.page.agents.ownName !== null) return;
    fields.delete('tour');
    const { recipe } = decodeRecipe(fields.toString(), LEARNERS, (agent) =>
      this.knobs.settingsOf(agent),
    );
    if (!recipe) return;
    this.train(recipe);
  }

  /// The shown training as the part of an address after #; without a training, only the view.
  get address(): string {
    const { session, rival, race } = this;
    if (session) return encodeRecipe(rival ? { ...this.sessions[0]!, rival } : session);
    if (!race.rival) return 'learn';
    const [agent, seed] = [this.agent.value, Number(this.seed.value)];
    return encodeRecipe({ agent, seed, settings: this.settings, rival: race.rival.id });
  }

  /// Ends all trainings.
  stop(): void {
    this.endAll();
    this.draw();
  }

  /// Ends and forgets all trainings, as for a new visitor.
  forget(): void {
    this.endAll();
    this.sessions = [];
    this.rival = undefined;
    this.aside = null;
    this.scrubber.back(null);
    this.listCourses();
    this.draw();
  }

  /// A running count, and the last milestone.
  get story(): Story {
    const { session } = this;
    if (!session || session.state === 'stopped') return { count: '', milestone: '' };
    if (session.state === 'failed' || !session.last) {
      return { count: '', milestone: sentence(session) };
    }
    if (!this.isAtNewest) {
      const { step } = this.scrubber;
      return { count: `After ${swinging(step)}`, milestone: earlier(session, step) };
    }
    const { episodeCount } = session.last;
    const { slow } = session;
    const example = session.examples.at(-1);
    const random = example && slow ? `${Math.round(100 * example.epsilon)}% random torques` : '';
    const trial = `Trial ${(episodeCount + (slow ? 1 : 0)).toLocaleString('en')}`;
    const count = `${trial}, ${random || swinging(session.steps, session.settings.control_period)}`;
    return { count, milestone: milestone(session) };
  }

  /// Whether all trainings that have not ended are paused.
  get paused(): boolean {
    const { active } = this;
    return active.length > 0 && active.every(({ state }) => state === 'paused');
  }

  /// Starts, pauses or resumes.
  toggle(): void {
    const { active, paused } = this;
    if (active.length === 0) return this.start();
    for (const session of active) {
      if (paused) session.resume();
      else session.pause();
    }
    this.draw();
  }

  /// Whether the visitor's own policy comes from the shown training.
  get keeps(): boolean {
    const { session, page } = this;
    return session !== null && this.taken.has(session) && page.agents.ownIsLearned;
  }

  /// Puts the shown training's policy on the stage again.
  show(): void {
    const { course, onStage } = this.scrubber;
    if (course && !onStage) this.scrubber.take(course, !prefersStill());
    this.draw();
  }

  /// Whether a policy of the shown training has been on the stage.
  get begun(): boolean {
    return this.scrubber.checkpoint !== null;
  }

  /// Leaves the stage to another view or step.
  leave(): void {
    this.scrubber.leave();
  }

  /// The pendulums of the shown training: q1, q2 [rad] of each.
  get ghosts(): ArrayLike<number> {
    const { session, scrubber } = this;
    return session?.running && scrubber.follows ? session.poses : [];
  }

  /// Whether there is an update of the network to ask about.
  get asks(): boolean {
    return this.lesson.asks;
  }

  /// Whether a training runs now.
  get running(): boolean {
    return this.sessions.some((session) => session.running);
  }

  /// The last test of the training whose agents are on the stage one after another, or the training
  /// before its first test; null otherwise.
  get lastTest(): object | null {
    const { session, scrubber } = this;
    if (!session?.running || !scrubber.follows || !scrubber.onStage || !this.begun) return null;
    return session.evaluations.at(-1) ?? session;
  }

  /// At each frame.
  follow(): void {
    this.scrubber.attempt();
    if (this.scrubber.onStage !== this.drawnOnStage) this.draw();
  }

  /// The trainings in the list.
  private get courses(): readonly Course[] {
    return this.recording ? [...this.sessions, this.recording] : this.sessions;
  }

  /// The shown training; null if it is the recording.
  private get session(): Session | null {
    const { course } = this.scrubber;
    return course instanceof Session ? course : null;
  }

  /// The trainings that have not ended.
  private get active(): readonly Session[] {
    return this.sessions.filter((session) => session.active);
  }

  private showRecording(agent: string): void {
    this.recording ??= this.page.agents.recording(agent);
    if (this.recording) this.choose(this.recording);
  }

  private choose(course: Course): void {
    this.scrubber.take(course);
    this.listCourses();
    this.draw();
    this.page.learned();
  }

  /// Draws after reports, some times a second.
  private news(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    setTimeout(() => {
      this.scheduled = false;
      this.scrubber.update();
      this.draw();
      void this.takeOver();
    }, REPORTED);
  }

  /// Once a training has solved the task, keeps its best policy as the visitor's own, unless that
  /// would replace a file that the visitor brought.
  private async takeOver(): Promise<void> {
    const { aside, scrubber } = this;
    // A tried reward leaves the visitor's own agent as it is.
    const session = aside ? aside.sessions.find((one) => one === aside.course) : this.session;
    if (!session?.last?.solved || session.state !== 'finished' || this.taken.has(session)) return;
    this.taken.add(session);
    const { ownName, ownIsLearned } = this.page.agents;
    if (ownName !== null && !ownIsLearned) return;
    const { newest } = session;
    const file = newest && fileOf(session, newest);
    if (!file) return;
    const isShown = !aside && scrubber.follows && scrubber.onStage;
    const shown = await this.page.keepLearned({ file, recipe: encodeRecipe(session) }, isShown);
    if (shown) scrubber.again();
  }

  /// Keeps the policy on the stage as the visitor's own. Asks before it replaces a file that the
  /// visitor brought.
  private async keep(): Promise<void> {
    const file = this.file();
    const { ownName, ownIsLearned } = this.page.agents;
    const question = `This replaces your own policy, ${ownName}, in this browser. Replace it?`;
    if (!file || (ownName !== null && !ownIsLearned && !confirm(question))) return;
    const recipe = this.recipeOfShown;
    if (await this.page.keepLearned({ file, recipe }, true)) this.scrubber.again();
    this.draw();
    note('It stays in this browser. The lists of agents mark it with "(yours)".');
  }

  /// A film's title: the agent on the stage and its success.
  get title(): readonly [string, string] {
    const { session, scrubber, page } = this;
    const { course } = scrubber;
    if (!course || !scrubber.onStage) return [page.agentTitle, ''];
    const step = session && scrubber.follows ? session.steps : scrubber.step;
    const success = successAt(course, step);
    const score = success === undefined ? '' : `, success ${(100 * success).toFixed(0)}%`;
    const chosen = [...this.agent.options].find(({ value }) => value === session?.agent);
    const name = session ? `${chosen?.text ?? session.agent}, ${session.name}` : course.name;
    return [name, `after ${step.toLocaleString('en')} steps${score}`];
  }

  private save(): void {
    const file = this.file();
    if (file) saveFile(file, 'policy.safetensors');
  }

  /// The policy on the stage, or the training's newest one if another agent is there.
  private file(): File | null {
    const { session, shown } = this;
    return session && shown ? fileOf(session, shown) : null;
  }

  /// The recipe of the policy on the stage; empty for one on the way, which no recipe gives.
  private get recipeOfShown(): string {
    const { session, shown } = this;
    const isLast = session?.state === 'finished' && shown?.step === session.newest?.step;
    return isLast ? encodeRecipe(session) : '';
  }

  /// Whether the policy on the stage is the visitor's own already.
  private get isKept(): boolean {
    const { session, shown, page } = this;
    return session !== null && shown !== null && page.agents.ownName === nameOf(session, shown);
  }

  /// The checkpoint that numbers and file belong to; null without a training.
  private get shown(): Checkpoint | null {
    const { session, scrubber } = this;
    if (!session) return null;
    return this.isAtNewest ? session.newest : scrubber.checkpoint;
  }

  /// Whether numbers and file belong to the newest policy: it is followed, or another agent is on
  /// the stage.
  private get isAtNewest(): boolean {
    return this.scrubber.follows || !this.scrubber.onStage;
  }

  private listCourses(): void {
    const place = element('learn-courses');
    place.hidden = this.courses.length < 2;
    place.replaceChildren(
      ...this.courses.map((course, i) => {
        const label = document.createElement('label');
        const input = document.createElement('input');
        input.type = 'radio';
        input.name = 'learn-which';
        input.value = String(i);
        input.checked = course === this.scrubber.course;
        label.append(input, ` ${course.name} `, document.createElement('output'));
        return label;
      }),
    );
  }

  private draw(): void {
    const { session, scrubber, page } = this;
    const { course, onStage } = scrubber;
    this.drawnOnStage = onStage;
    const { sides } = this;
    if (sides) this.chart.drawRace(sides);
    else
      this.chart.draw(
        course && !session ? [course] : this.sessions,
        course,
        onStage ? scrubber.step : null,
      );
    this.race.show(sides);
    if (onStage) this.second.show(sides?.[1][0] ?? null);
    if (sides && onStage) {
      const [first] = sides[0];
      element('first-name').textContent = nameInRace(first!, scrubber.step);
    }
    this.reward.show(session);
    this.lesson.show(sides ? null : session, page.world.policy?.rewardScale ?? 1);
    element('learn-figure').toggleAttribute('data-race', sides !== null);
    this.strip.show(session?.state === 'finished' ? session : null);
    // Of the built-in reward and task; tests of the recording are longer than trials.
    const isUsual = session !== null && !Object.keys(session.settings).some(changesRewards);
    element('learn-best').hidden = course !== null && !isUsual;
    const running = this.active.length > 0;
    const label = this.paused ? 'Resume training' : running ? 'Pause training' : 'Learn';
    element('learn-start').textContent = label;
    // A race begins with a bet.
    const races = this.race.rival !== null;
    element('learn-start').hidden = races && !running;
    element('learn-again').hidden = races || this.sessions.length === 0;
    // A training that has ended is not learned again by the same button.
    if (this.sessions.length > 0 && !running) element('learn-start').hidden = true;
    document.documentElement.toggleAttribute('data-begun', this.sessions.length > 0 || !!course);
    const has = session !== null && session.policy !== null;
    element<HTMLButtonElement>('learn-save').disabled = !has;
    element<HTMLButtonElement>('learn-keep').disabled = !has || this.isKept;
    // A sign of a training that goes on while something else is shown.
    const goesOn = this.running;
    document.documentElement.toggleAttribute('data-training', goesOn);
    const link = document.querySelector<HTMLElement>('nav a[href="#learn"]')!;
    link.title = goesOn ? 'A training is running' : '';
    const share = element<HTMLButtonElement>('learn-share');
    share.disabled = session === null;
    share.textContent = sides ? 'Share this race' : 'Share this training';
    this.scrub.disabled = !course || course.checkpoints.length < 2;
    if (!course) return;
    const outputs = [...element('learn-courses').querySelectorAll('output')];
    this.sessions.forEach((other, i) => {
      if (outputs[i]) outputs[i].textContent = brief(other);
    });
    // A finger that drags the slider keeps it.
    if (!this.scrub.matches(':active')) {
      this.scrub.max = String(stepsOf(session ? this.sessions : [course]));
      this.scrub.value = String(this.isAtNewest ? course.steps : scrubber.step);
    }
    this.scrub.ariaValueText = `after ${scrubber.step.toLocaleString('en')} steps`;
    this.drawNumbers(course);
    const said = this.isAtNewest || !session ? sentence : earlier;
    this.say(session ? said(session, scrubber.step) : OF_RECORDING);
  }

  /// The numbers of a training: the latest ones, or at the step of the policy on the stage.
  private drawNumbers(course: Course): void {
    const write = (id: string, text: string) => (element(`learn-${id}`).textContent = text);
    const { session, scrubber } = this;
    const now = session !== null && this.isAtNewest;
    const at = now ? Infinity : scrubber.step;
    const success = successAt(course, at);
    const count = (number: number | undefined) => number?.toLocaleString('en') ?? '–';
    const last = session?.last;
    const after = !now
      ? scrubber.checkpoint?.after
      : { trials: last?.episodeCount ?? 0, updates: last?.updates ?? 0, seconds: session.seconds };
    write('steps', count(now ? session.steps : scrubber.step));
    write('trials', count(after?.trials));
    write('updates', count(after?.updates));
    write('rate', now && session.running ? session.updatesPerSecond.toFixed(0) : '–');
    write('time', after ? `${after.seconds.toFixed(1)} s` : '–');
    write('success', success === undefined ? '–' : `${(100 * success).toFixed(0)}%`);
    const where = now ? 'as it is now' : `after ${count(scrubber.step)} steps`;
    write('where', `on the stage: ${scrubber.onStage ? where : 'another agent'}`);
  }

  /// Writes the status when it changes, for screen readers.
  private say(text: string): void {
    if (text === this.said) return;
    this.said = text;
    element('learn-status').textContent = text;
  }
}

function fileOf(session: Session, shown: Checkpoint): File | null {
  const { file } = shown;
  return file instanceof ArrayBuffer ? new File([file], nameOf(session, shown)) : null;
}

/// The name of a kept policy.
function nameOf({ agent, seed, newest, state }: Session, { step }: Checkpoint): string {
  const isLast = state === 'finished' && step === newest?.step;
  return `learned here, ${agent}, seed ${seed}${isLast ? '' : `, ${step.toLocaleString('en')} steps`}`;
}

const OF_RECORDING =
  'The default agent learned like this. Drag the line under the chart to see earlier versions.';

/// The success rate of the last test up to a step.
function successAt({ evaluations }: Course, at: number): number | undefined {
  return evaluations.findLast(({ step }) => step <= at)?.success;
}

function brief({ state, last, seconds }: Session): string {
  if (state === 'failed') return 'failed';
  if (last?.solved) return `solved in ${seconds.toFixed(1)} s`;
  return state === 'finished' ? 'not solved' : '';
}

/// The simulated time of `steps` control steps, `period` seconds apart.
function swinging(steps: number, period: string | number = CONTROL_PERIOD): string {
  const minutes = (steps * Number(period)) / 60;
  return minutes < 1 ? 'less than a minute of swinging' : `${minutes.toFixed(0)} min of swinging`;
}

/// How the newest test went; before a success, how long both links were up.
function milestone(session: Session): string {
  const { state, episodes, evaluations, settings } = session;
  if (state !== 'starting' && state !== 'learning') return sentence(session);
  const best = Math.max(...evaluations.map(({ success }) => success));
  if (best > 0) {
    const { success } = evaluations.at(-1)!;
    const steady = success < best ? ': learning is not steady.' : '.';
    return `It passes ${Math.round(100 * success)} of 100 tests${steady}`;
  }
  // With another reward or goal, returns prove nothing.
  if (Object.keys(settings).some(changesRewards)) return 'Learning …';
  for (const [proof, long] of PROOFS) {
    const trial = episodes.findIndex(({ reward }) => reward > proof);
    if (trial >= 0) return `Upright ${long}: trial ${trial + 1}.`;
  }
  return 'Learning …';
}

/// Whether returns with this setting cannot be compared with the usual ones.
function changesRewards(setting: string): boolean {
  return /reward|_weight$|any_pose/.test(setting);
}

/// The policy on the stage, which is not the newest one.
function earlier(session: Session, step: number): string {
  const success = Math.round(100 * (successAt(session, step) ?? 0));
  return `An earlier version: it passes ${success > 0 ? `${success} of 100 tests` : 'no test'}.`;
}

function sentence(session: Session): string {
  const { state, last, reason, seconds, settings } = session;
  if (state === 'failed') {
    // The editor of the reward shows the whole message.
    if (reason.startsWith('reward:')) return 'The reward cannot be used: see the message below it.';
    return asSentence(`Training failed: ${reason}`);
  }
  if (state === 'paused') return 'Paused.';
  if (state === 'stopped') return 'Ended.';
  if (state !== 'finished' || !last) return 'Learning …';
  const steps = last.steps.toLocaleString('en');
  if (!last.solved) return `Not solved within ${steps} steps.`;
  const own = Object.keys(settings).length > 0 ? ', with your settings' : '';
  const took = `${swinging(last.steps, settings.control_period)} computed in ${seconds.toFixed(1)} s`;
  return `Solved after ${steps} steps${own}: ${took}.`;
}
