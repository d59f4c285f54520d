import { History } from '../history';
import { element } from '../page/dom';
import { onThemeChange } from '../page/theme';
import { Policy } from '../policy';
import { Scene, TRAIL_SECONDS } from '../view/scene';
import { World } from '../world';
import type { Checkpoint } from './course';
import type { Session } from './session';

const TRIES = 6;
const SECONDS = 7; // of a try
const STILL = { torque: 0, push: null, drag: null, shoved: null };

/// Six tries of an agent during its training, each drawn like a long exposure: from the untrained
/// policy to the last, or to the best one if the task is solved.
export class Filmstrip {
  private readonly place = element('learn-strip');
  private readonly stage: World;
  private world: World | null = null;
  private readonly scenes: Scene[] = [];
  private readonly captions: HTMLElement[] = [];
  private shown: Session | null = null;
  private pictures: (() => void)[] = [];

  /// Moves to a new simulator of the stage's engine.
  constructor(stage: World) {
    this.stage = stage;
    // Resizing clears a canvas.
    new ResizeObserver(() => requestAnimationFrame(() => this.repaint())).observe(this.place);
    onThemeChange(() => {
      for (const { canvas } of this.scenes) canvas.forgetColors();
      this.repaint();
    });
  }

  private repaint(): void {
    for (const paint of this.pictures) paint();
  }

  /// Shows the tries of a training that has ended; null hides them.
  show(session: Session | null): void {
    if (session === this.shown) return;
    this.shown = session;
    this.place.hidden = session === null;
    this.pictures = [];
    if (session) this.next(session, triesOf(session), 0);
  }

  /// Draws one try, and the next one when the page is idle.
  private next(session: Session, tries: readonly Checkpoint[], i: number): void {
    const checkpoint = tries[i];
    if (!checkpoint || session !== this.shown) return;
    this.draw(checkpoint, i);
    setTimeout(() => this.next(session, tries, i + 1));
  }

  private draw({ file, after }: Checkpoint, i: number): void {
    if (!(file instanceof ArrayBuffer)) return;
    const scene = this.scenes[i] ?? this.add(i);
    this.world ??= new World(this.stage.simulator.another());
    const { world } = this;
    const policy = new Policy(file);
    const history = new History(TRAIL_SECONDS);
    world.onMoment = (moment) => history.add(moment);
    world.policy = policy;
    world.agentOn = true;
    world.reset();
    const begun = world.time;
    let upright = 0;
    while (world.time - begun < SECONDS) {
      world.advance();
      upright = Math.max(upright, world.uprightFor ?? 0);
    }
    const { plant, time, state, uprightFor, target } = world;
    const last = { ...{ plant, time, uprightFor, target }, ...STILL };
    const paint = () => scene.draw(last, state, history.from(begun));
    this.pictures[i] = paint;
    paint();
    world.policy = null;
    policy.controller.close();
    const trial = after ? `trial ${after.trials.toLocaleString('en')}` : 'at the end';
    this.captions[i]!.textContent = `${trial}\n${upright.toFixed(1)} s up`;
  }

  private add(i: number): Scene {
    const [item, box, caption] = ['li', 'div', 'span'].map((tag) => document.createElement(tag));
    const canvas = document.createElement('canvas');
    canvas.id = `learn-try-${i}`;
    canvas.ariaHidden = 'true';
    box!.append(canvas);
    item!.append(box!, caption!);
    this.place.append(item!);
    const scene = new Scene(canvas.id);
    this.scenes.push(scene);
    this.captions.push(caption!);
    return scene;
  }
}

/// The untrained policy, four at even intervals, and the last one.
function triesOf({ checkpoints, newest }: Session): Checkpoint[] {
  const last = checkpoints.length - 1;
  const some = Array.from(
    { length: TRIES - 1 },
    (_, i) => checkpoints[Math.round((i * last) / TRIES)]!,
  );
  return newest ? [...some, newest] : some;
}
