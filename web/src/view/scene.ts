import { GOALS, restIn } from '../pendulum';
import type { Plant, State } from '../pendulum';
import type { Push, Vec } from '../simulator';
import { pointOn } from '../world';
import type { Moment, World } from '../world';
import { Canvas } from './canvas';
import { drawLabel } from './labels';
import type { Anchor, Label } from './labels';
import {
  drawHousing,
  drawHub,
  drawJoint,
  drawLight,
  drawReach,
  drawRing,
  drawRod,
  drawTrace,
} from './machine';
import { drawSize } from './size';
import { Sparks } from './sparks';

export const TRAIL_SECONDS = 20; // of the world's time: a whole swing-up
const FADING = 0.8; // s until the arrow of a shove, which acts for 0.1 s, has faded
const PIVOT: Vec = { x: 0, z: 0 };
const CIRCLE = 0.86; // radius of the tip's reach, in shorter sides of the box
const LARGEST_ARC = (150 / 180) * Math.PI; // at the torque limit

const VISIBLE = 0.5; // px, smallest motion that is drawn
const VISIBLE_CALM = 2; // px, the same while the pendulum only sways
const CALM = 1; // rad/s, of both joints
const CALM_AFTER = 1; // s in the goal

/// Whether the pendulum only sways in its goal. Its motor dithers there, too fast for the eye.
function isCalm({ uprightFor }: Shown, { w1, w2 }: State): boolean {
  return (uprightFor ?? 0) > CALM_AFTER && Math.abs(w1) + Math.abs(w2) < CALM;
}

/// The parts of a world that a scene draws.
export type Shown = Pick<
  World,
  'plant' | 'time' | 'torque' | 'uprightFor' | 'target' | 'push' | 'drag' | 'shoved'
>;

/// The pendulum in its plane, seen so that positive angles and torques are clockwise.
export class Scene {
  readonly canvas: Canvas;
  readonly sparks = new Sparks();
  labels: readonly Label[] = [];
  /// Other pendulums, drawn faintly: q1, q2 [rad] of each.
  ghosts: ArrayLike<number> = [];
  /// Colours of the circle, clockwise from below; empty: none.
  ring: readonly string[] = [];
  /// Thing that glows because its word was touched: link1, link2, motor or goal.
  lit: string | null = null;

  /// Pixels per metre, and the place of the pivot on the canvas [px].
  private scale = 1;
  private pivot = { x: 0, y: 0 };
  private box = { left: 0, right: 0, top: 0, bottom: 0 }; // box around the pendulum on the canvas [px]

  constructor(id: string) {
    this.canvas = new Canvas(id);
  }

  /// What the last drawing showed: places of elbow and tip [px of the canvas], and words.
  private drawn: { places: readonly number[]; words: string; ring: readonly string[] } | null =
    null;

  /// Whether another drawing would show something new.
  stirs(world: Shown, state: State): boolean {
    const { drawn } = this;
    if (!drawn || this.sparks.fly || this.ghosts.length > 0 || this.isPushed(world)) return true;
    if (drawn.ring !== this.ring || drawn.words !== this.words) return true;
    const least = isCalm(world, state) ? VISIBLE_CALM : VISIBLE;
    return this.placesOf(world, state).some((at, i) => Math.abs(at - drawn.places[i]!) > least);
  }

  /// Whether a hand, a shove or its fading arrow is in sight.
  private isPushed({ push, drag, shoved, time }: Shown): boolean {
    return push !== null || drag !== null || (shoved !== null && time - shoved.at < FADING);
  }

  private get words(): string {
    return this.labels.map(({ text }) => text).join();
  }

  private placesOf({ plant }: Shown, state: State): number[] {
    const { length1, length2 } = plant;
    const elbow = pointOn(plant, state, 1, length1).position;
    const tip = pointOn(plant, state, 2, length2).position;
    return [...this.at(elbow), ...this.at(tip)];
  }

  /// A place on the canvas in the pendulum's plane (m).
  toPlane(px: number, py: number): Vec {
    return { x: (px - this.pivot.x) / this.scale, z: (this.pivot.y - py) / this.scale };
  }

  /// The inverse of toPlane().
  at({ x, z }: Vec): [number, number] {
    return [this.pivot.x + this.scale * x, this.pivot.y - this.scale * z];
  }

  /// A length (m) in pixels.
  toPixels(metres: number): number {
    return metres * this.scale;
  }

  /// Centres the pendulum in the box: the canvas itself may fill the window.
  private fit(reach: number): void {
    const canvas = this.canvas.element.getBoundingClientRect();
    const box = this.canvas.element.parentElement!.getBoundingClientRect();
    this.scale = (CIRCLE * Math.min(box.width, box.height)) / (2 * reach);
    this.pivot = {
      x: box.left - canvas.left + box.width / 2,
      y: box.top - canvas.top + box.height / 2,
    };
    this.box = {
      left: box.left - canvas.left,
      right: box.right - canvas.left,
      top: box.top - canvas.top,
      bottom: box.bottom - canvas.top,
    };
  }

  /// Draws a state of the pendulum, and the path of its tip over `trail`, oldest first.
  draw(world: Shown, state: State, trail: readonly Moment[]): void {
    const { canvas } = this;
    const { plant } = world;
    const reach = plant.length1 + plant.length2;
    this.fit(Math.max(1, reach));
    if (!(this.scale > 0)) return; // hidden
    this.drawn = {
      places: this.placesOf(world, state),
      words: this.words,
      ring: this.ring,
    };
    canvas.clear();
    drawReach(canvas, this.at(PIVOT), this.scale * reach);
    this.drawGoal(world);
    drawRing(canvas, this.at(PIVOT), this.scale * reach, this.ring);
    if (plant.size !== 1) {
      drawSize(canvas, this.box, this.scale / plant.size, plant.size > 1);
    }
    this.drawGhosts(plant);
    const tipOf = (s: State) => this.at(pointOn(plant, s, 2, plant.length2).position);
    const points = [...trail.map((moment) => tipOf(moment.state)), tipOf(state)];
    const ages = [...trail.map(({ t }) => world.time - t), 0];
    drawTrace(canvas, points, ages, TRAIL_SECONDS, this.scale * reach);

    const elbow = pointOn(plant, state, 1, plant.length1).position;
    const tip = pointOn(plant, state, 2, plant.length2).position;
    const size = this.thick(9, 0.045); // px, radius of the shaft
    const motorGlows = this.lit === 'motor';
    drawHousing(canvas, this.at(PIVOT), 2 * size, motorGlows);
    this.drawLink(PIVOT, elbow, 'link1', plant.mass1);
    this.drawLink(elbow, tip, 'link2', plant.mass2);
    drawHub(canvas, this.at(PIVOT), size, state.q1);
    drawJoint(canvas, this.at(elbow), 0.55 * size);
    if (!isCalm(world, state)) this.drawTorque(world.torque / plant.torque_limit);
    this.drawPush(world, state);
    this.sparks.draw(canvas, ...this.at(elbow), 0.75 * this.scale);
    const letters = Math.max(canvas.letters, 0.036 * this.scale);
    for (const { at, text } of this.labels) {
      drawLabel(canvas, text, letters, this.place(at, elbow, tip, plant), this.box);
    }
  }

  /// A width (m) in pixels; at least `least` unless the pendulum is tiny.
  private thick(least: number, metres: number): number {
    return Math.max(Math.min(least, 2 * metres * this.scale), metres * this.scale);
  }

  /// The square around the whole pendulum: its middle and half its side (px of the canvas).
  get square(): { x: number; y: number; half: number } {
    return { ...this.pivot, half: 1.2 * this.scale };
  }

  /// A thing's brightness, from 0 to 1.
  private glow(thing: 'goal', { uprightFor }: Shown): number {
    return this.lit === thing ? 1 : uprightFor !== null ? 0.8 : 0.4;
  }

  /// Light where each link counts as in the goal. A chosen goal has a ghost.
  private drawGoal(world: Shown): void {
    const { plant, target } = world;
    const { up1, up2 } = target ?? GOALS['up-up'];
    const { length1, length2 } = plant;
    const glow = this.glow('goal', world);
    const light = (from: Vec, length: number, up: boolean) =>
      drawLight(this.canvas, this.at(from), this.scale * length, glow, up);
    if (up1 === up2) {
      light(PIVOT, length1 + length2, up1);
    } else {
      const longer = Math.max(length1, length2);
      light(PIVOT, longer, up1);
      light({ x: 0, z: up1 ? length1 : -length1 }, longer, up2);
    }
    if (target) this.drawGhost(plant, restIn(target), 0.35);
  }

  private drawGhosts(plant: Plant): void {
    const alpha = this.ghosts.length > 2 ? 0.13 : 0.35;
    for (let i = 0; i + 1 < this.ghosts.length; i += 2) {
      const state = { q1: this.ghosts[i]!, q2: this.ghosts[i + 1]!, w1: 0, w2: 0 };
      this.drawGhost(plant, state, alpha);
    }
  }

  private drawGhost(plant: Plant, state: State, alpha: number): void {
    const { context } = this.canvas;
    context.globalAlpha = alpha;
    context.lineCap = 'round';
    const width = Math.max(3, 0.02 * this.scale);
    const elbow = this.at(pointOn(plant, state, 1, plant.length1).position);
    const tip = this.at(pointOn(plant, state, 2, plant.length2).position);
    this.canvas.line([this.at(PIVOT), elbow], 'link1', width);
    this.canvas.line([elbow, tip], 'link2', width);
    context.lineCap = 'butt';
    context.globalAlpha = 1;
  }

  /// The place of a label.
  private place(what: Label['at'], elbow: Vec, tip: Vec, plant: Plant): Anchor {
    if (what === 'motor') {
      const [x, y] = this.at(PIVOT);
      return { x, y, nx: 1, ny: 0, gap: Math.max(0.2 * this.scale, 30) };
    }
    if (what === 'goal') {
      const [x, y] = this.at({ x: 0.6, z: 1 });
      return { x, y, nx: 0, ny: -1, gap: 2 };
    }
    if (what === 'ring') {
      // In a lower corner, at the side where the tip is not.
      const side = tip.x > 0 ? -1 : 1;
      const [x, y] = this.at({ x: 4 * side, z: -1.1 });
      return { x, y, nx: 0, ny: -1, gap: 0 };
    }
    if (what === 'ghost') {
      const [q1, q2] = [this.ghosts[0]!, this.ghosts[1]!];
      const { position } = pointOn(plant, { q1, q2, w1: 0, w2: 0 }, 2, plant.length2);
      const [x, y] = this.at(position);
      return { x, y, nx: Math.sign(position.x) || 1, ny: 0, gap: 6 };
    }
    // At a side of the link, turning with it.
    const [x, y] = this.at({ x: (elbow.x + tip.x) / 2, z: (elbow.z + tip.z) / 2 });
    const length = Math.hypot(tip.x - elbow.x, tip.z - elbow.z);
    const [nx, ny] = [(elbow.z - tip.z) / length, (elbow.x - tip.x) / length];
    return { x, y, nx, ny, gap: this.thick(10, 0.06) };
  }

  /// A link of 1 kg is as thick as its capsule, or thicker for fingers. Thickness grows with the
  /// mass.
  private drawLink(from: Vec, to: Vec, name: 'link1' | 'link2', mass: number): void {
    const thickness = this.thick(10, 0.06) * Math.min(Math.max(mass, 0.25), 3) ** 0.5;
    drawRod(this.canvas, this.at(from), this.at(to), name, thickness, this.lit === name);
  }

  /// An arc about the pivot from above, clockwise for a positive torque. Its length is the share of
  /// the torque limit.
  private drawTorque(share: number): void {
    if (Math.abs(share) < 1e-9) return;
    const { context } = this.canvas;
    const [x, y] = this.at(PIVOT);
    const radius = 0.17 * this.scale;
    const [start, end] = [-Math.PI / 2, -Math.PI / 2 + share * LARGEST_ARC];
    context.beginPath();
    context.arc(x, y, radius, start, end, share < 0);
    context.strokeStyle = this.canvas.color('torque');
    context.lineWidth = 6;
    context.stroke();
    const direction = end + (share > 0 ? Math.PI / 2 : -Math.PI / 2);
    this.arrowHead(x + radius * Math.cos(end), y + radius * Math.sin(end), direction, 'torque');
  }

  private drawPush(world: Shown, state: State): void {
    const { push, drag, plant } = world;
    const { context } = this.canvas;
    if (drag) {
      const held = pointOn(plant, state, drag.link, drag.along).position;
      context.setLineDash([4, 4]);
      this.canvas.line([this.at(held), this.at(drag.target)], 'quiet', 1.5);
      context.setLineDash([]);
    }
    if (push) return this.drawForce(push, plant, state);
    const age = world.shoved ? world.time - world.shoved.at : FADING;
    if (age >= FADING) return;
    context.globalAlpha = Math.min(1, 2 * (1 - age / FADING));
    this.drawForce(world.shoved!.push, plant, state);
    context.globalAlpha = 1;
  }

  private drawForce(push: Push, plant: Plant, state: State): void {
    const size = Math.hypot(push.force.x, push.force.z); // N
    if (size < 0.05) return;
    const [x, y] = this.at(pointOn(plant, state, push.link, push.along).position);
    const [dx, dy] = [push.force.x / size, -push.force.z / size];
    const length = Math.min(40 + 7 * size, this.room(x, y, dx, dy)); // pixels
    this.canvas.line(
      [
        [x, y],
        [x + length * dx, y + length * dy],
      ],
      'push',
      4,
    );
    this.arrowHead(x + length * dx, y + length * dy, Math.atan2(dy, dx), 'push');
  }

  /// Pixels from a place to the canvas's edge in a direction, less an arrow's head.
  private room(x: number, y: number, dx: number, dy: number): number {
    const { width, height } = this.canvas;
    const along = (at: number, step: number, end: number) =>
      step > 0 ? (end - at) / step : step < 0 ? -at / step : Infinity;
    return Math.max(0, Math.min(along(x, dx, width), along(y, dy, height)) - 12);
  }

  private arrowHead(x: number, y: number, direction: number, color: string): void {
    const { context } = this.canvas;
    context.save();
    context.translate(x, y);
    context.rotate(direction);
    context.beginPath();
    context.moveTo(11, 0);
    context.lineTo(-3, 8);
    context.lineTo(-3, -8);
    context.fillStyle = this.canvas.color(color);
    context.fill();
    context.restore();
  }
}
