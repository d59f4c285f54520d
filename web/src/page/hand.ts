import type { State } from '../pendulum';
import type { Vec } from '../simulator';
import type { Scene } from '../view/scene';
import { pointOn } from '../world';
import type { World } from '../world';

const NEAR = 28; // pixels from a link within which it is grabbed: a fingertip

/// Lets mouse and finger grab the pendulum: to drag it while it moves, to pose it while it is paused.
export class Hand {
  private readonly world: World;
  private readonly scene: Scene;
  private readonly paused: () => boolean;
  private readonly onPose: () => void;
  private held: { link: 1 | 2; along: number } | null = null;

  constructor(world: World, scene: Scene, paused: () => boolean, onPose: () => void) {
    this.world = world;
    this.scene = scene;
    this.paused = paused;
    this.onPose = onPose;
    const canvas = scene.canvas.element;
    // A finger on the pendulum does not scroll the page; one beside it does.
    const keep = (event: TouchEvent) => {
      const { left, top } = canvas.getBoundingClientRect();
      const touch = event.touches[0]!;
      const place = scene.toPlane(touch.clientX - left, touch.clientY - top);
      if (this.nearest(place)) event.preventDefault();
    };
    canvas.addEventListener('touchstart', keep, { passive: false });
    canvas.addEventListener('pointerdown', (event) => this.grab(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
      canvas.addEventListener(end, () => this.release());
    }
  }

  private at(event: PointerEvent): Vec {
    return this.scene.toPlane(event.offsetX, event.offsetY);
  }

  private grab(event: PointerEvent): void {
    const place = this.at(event);
    this.held = this.nearest(place);
    if (!this.held) return;
    event.preventDefault();
    this.scene.canvas.element.setPointerCapture(event.pointerId);
    this.hold(place);
  }

  private move(event: PointerEvent): void {
    const place = this.at(event);
    this.scene.canvas.element.style.cursor = this.held || this.nearest(place) ? 'grab' : '';
    if (this.held) this.hold(place);
  }

  private release(): void {
    this.held = null;
    this.world.drag = null;
  }

  private hold(target: Vec): void {
    if (this.paused()) {
      this.world.drag = null;
      this.world.reset(this.posed(target));
      this.onPose();
    } else {
      this.world.drag = { ...this.held!, target };
    }
  }

  /// At rest, with the held link pointing at the hand; the other one keeps its place beside it.
  private posed(target: Vec): State {
    const { q1, q2 } = this.world.state;
    const rest = { w1: 0, w2: 0 };
    const angle = (from: Vec) => Math.atan2(-(target.x - from.x), -(target.z - from.z));
    if (this.held!.link === 1) return { q1: angle({ x: 0, z: 0 }), q2, ...rest };
    const elbow = pointOn(this.world.plant, this.world.state, 1, this.world.plant.length1);
    const second = angle(elbow.position) - q1;
    return { q1, q2: Math.atan2(Math.sin(second), Math.cos(second)), ...rest };
  }

  /// The nearest point of a link, if one is near enough.
  private nearest(place: Vec): { link: 1 | 2; along: number } | null {
    const { plant, state } = this.world;
    const elbow = pointOn(plant, state, 1, plant.length1).position;
    const candidates = ([1, 2] as const).map((link) => {
      const from = link === 1 ? { x: 0, z: 0 } : elbow;
      const length = link === 1 ? plant.length1 : plant.length2;
      const to = pointOn(plant, state, link, length).position;
      const share =
        ((place.x - from.x) * (to.x - from.x) + (place.z - from.z) * (to.z - from.z)) / length ** 2;
      const along = length * Math.min(Math.max(share, 0), 1);
      const { position } = pointOn(plant, state, link, along);
      return { link, along, distance: Math.hypot(place.x - position.x, place.z - position.z) };
    });
    const [first, second] = candidates as [(typeof candidates)[0], (typeof candidates)[0]];
    const best = second.distance <= first.distance ? second : first;
    return this.scene.toPixels(best.distance) <= NEAR
      ? { link: best.link, along: best.along }
      : null;
  }
}
