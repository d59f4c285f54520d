import type { State } from '../pendulum';
import type { Vec } from '../simulator';
import type { Scene } from '../view/scene';
import { pointOn } from '../world';
import type { World } from '../world';

const NEAR = 28; // pixels, grip of a fingertip around a link

const MOVED = 4; // pixels, beyond which a touch is a drag

/// A mouse's or finger's grip.
interface Held {
  link: 1 | 2;
  along: number; // m from the link's hinge
  pointer: number;
  from: Vec;
  moved: boolean;
}

/// Lets mouse and finger grab the pendulum, to drag it while it moves or to pose it while it is
/// paused.
export class Hand {
  private readonly world: World;
  private readonly scene: Scene;
  private readonly paused: () => boolean;
  private readonly onPose: () => void;
  private held: Held | null = null;

  constructor(world: World, scene: Scene, paused: () => boolean, onPose: () => void) {
    this.world = world;
    this.scene = scene;
    this.paused = paused;
    this.onPose = onPose;
    const canvas = scene.canvas.element;
    // A finger on the pendulum does not scroll the page; a finger elsewhere does.
    const keep = (event: TouchEvent) => {
      const { left, top } = canvas.getBoundingClientRect();
      const { clientX, clientY } = event.changedTouches[0]!;
      if (this.nearest(scene.toPlane(clientX - left, clientY - top))) event.preventDefault();
    };
    canvas.addEventListener('touchstart', keep, { passive: false });
    canvas.addEventListener('pointerdown', (event) => this.grab(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
      canvas.addEventListener(end, (event) => this.release(event));
    }
  }

  private at(event: PointerEvent): Vec {
    return this.scene.toPlane(event.offsetX, event.offsetY);
  }

  private grab(event: PointerEvent): void {
    if (this.held || event.button !== 0) return; // one hand, and the left button of a mouse
    const place = this.at(event);
    const nearest = this.nearest(place);
    if (!nearest) return;
    event.preventDefault();
    this.scene.canvas.element.setPointerCapture(event.pointerId);
    this.held = { ...nearest, pointer: event.pointerId, from: place, moved: false };
    this.hold(place);
  }

  private move(event: PointerEvent): void {
    const place = this.at(event);
    if (!this.held) {
      this.scene.canvas.element.style.cursor = this.nearest(place) ? 'grab' : '';
    } else if (this.held.pointer === event.pointerId) {
      const distance = Math.hypot(place.x - this.held.from.x, place.z - this.held.from.z);
      this.held.moved ||= this.scene.toPixels(distance) > MOVED;
      this.hold(place);
    }
  }

  private release(event: PointerEvent): void {
    if (this.held?.pointer !== event.pointerId) return;
    this.held = null;
    this.world.drag = null;
  }

  private hold(target: Vec): void {
    const { link, along, moved } = this.held!;
    if (!this.paused()) {
      this.world.drag = { link, along, target };
    } else if (moved) {
      this.world.drag = null;
      this.world.reset(this.posed(target));
      this.onPose();
    }
  }

  /// A pose at rest with the held link pointing at the hand; the other joint keeps its
  /// angle.
  private posed(target: Vec): State {
    const { q1, q2 } = this.world.state;
    const rest = { w1: 0, w2: 0 };
    const angle = (from: Vec) => Math.atan2(-(target.x - from.x), -(target.z - from.z));
    if (this.held!.link === 1) return { q1: angle({ x: 0, z: 0 }), q2, ...rest };
    const elbow = pointOn(this.world.plant, this.world.state, 1, this.world.plant.length1);
    const second = angle(elbow.position) - q1;
    return { q1, q2: Math.atan2(Math.sin(second), Math.cos(second)), ...rest };
  }

  /// The nearest point of a link, if it is within reach.
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
