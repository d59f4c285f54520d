import { CONTROL_PERIOD } from '../pendulum';
import type { Plant, State } from '../pendulum';
import type { Push, Vec } from '../simulator';
import { pointOn } from '../world';
import type { Moment, World } from '../world';
import { Canvas } from './canvas';
import { drawLabel } from './labels';
import type { Label } from './labels';
import { Sparks } from './sparks';

export const TRAIL_SECONDS = 1.3; // of the pendulum's time
const TRAIL_SHADES = 13;
const FADING = 0.8; // s, in which the arrow of a shove fades: it acts for 0.1 s
const FLASH_STEPS = 5; // control steps between two flashes
const PIVOT: Vec = { x: 0, z: 0 };
const LARGEST_ARC = (150 / 180) * Math.PI; // at the motor's limit

/// The pendulum in its plane, seen so that positive angles and torques are clockwise.
export class Scene {
  readonly canvas: Canvas;
  readonly sparks = new Sparks();
  labels: readonly Label[] = [];
  /// The thing that is lit, as its noun in the text is pointed at: link1, link2, motor or goal.
  lit: string | null = null;

  /// Pixels per metre.
  private scale = 1;

  constructor(id: string) {
    this.canvas = new Canvas(id);
  }

  /// A place on the canvas as a point of the pendulum's plane (m).
  toPlane(px: number, py: number): Vec {
    const { width, height } = this.canvas;
    return { x: (px - width / 2) / this.scale, z: (height / 2 - py) / this.scale };
  }

  /// The inverse: a point of the plane (m) as a place on the canvas.
  at({ x, z }: Vec): [number, number] {
    const { width, height } = this.canvas;
    return [width / 2 + this.scale * x, height / 2 - this.scale * z];
  }

  /// Pixels of this many metres.
  toPixels(metres: number): number {
    return metres * this.scale;
  }

  /// Draws the pendulum in this state, and the path of its tip over `trail`, oldest first.
  draw(world: World, state: State, trail: readonly Moment[]): void {
    const { canvas } = this;
    const { plant } = world;
    const reach = Math.max(1, plant.length1 + plant.length2);
    this.scale = (0.44 * Math.min(canvas.width, canvas.height)) / reach;
    canvas.clear();
    this.drawGuides(plant.length1 + plant.length2, world.uprightFor !== null);
    this.drawFlashes(plant, trail);
    this.drawTrail(world, state, trail);

    const elbow = pointOn(plant, state, 1, plant.length1).position;
    const tip = pointOn(plant, state, 2, plant.length2).position;
    this.drawLink(PIVOT, elbow, 'link1', plant.mass1);
    this.drawLink(elbow, tip, 'link2', plant.mass2);
    this.drawMotor();
    canvas.disc(...this.at(elbow), 4.5, 'panel');
    this.drawTorque(world.torque / plant.torque_limit);
    this.drawPush(world, state);
    this.sparks.draw(canvas, ...this.at(elbow), 0.75 * this.scale);
    for (const { at, text } of this.labels) {
      const [x, y] = this.place(at, elbow, tip);
      drawLabel(canvas, text, x, y);
    }
  }

  /// Where the label of something is written.
  private place(what: Label['at'], elbow: Vec, tip: Vec): [number, number] {
    const aside = 0.12 * this.scale;
    if (what === 'motor') {
      const [x, y] = this.at(PIVOT);
      return [x + 1.6 * aside, y + 0.2 * aside];
    }
    if (what === 'goal') {
      const [x, y] = this.at({ x: 0.3, z: 1 });
      return [x, Math.max(12, y - 14)];
    }
    const [x, y] = this.at({ x: (elbow.x + tip.x) / 2, z: (elbow.z + tip.z) / 2 });
    return [x + aside, y];
  }

  /// How far the tip reaches, and the cone within which a link is upright, like the light of a lamp that
  /// is on (`lit`) while both are.
  private drawGuides(reach: number, lit: boolean): void {
    const { context } = this.canvas;
    const [x, y] = this.at(PIVOT);
    const radius = this.scale * reach;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.strokeStyle = this.canvas.color('grid');
    context.lineWidth = 1;
    context.stroke();
    context.beginPath();
    context.moveTo(x, y);
    context.arc(x, y, radius, (-120 / 180) * Math.PI, (-60 / 180) * Math.PI);
    context.closePath();
    context.fillStyle = this.canvas.color('cone');
    context.fill();
    if (lit) context.fill();
    context.strokeStyle = this.canvas.color('cone-edge');
    context.lineWidth = lit ? 3 : 1.5;
    context.stroke();
  }

  /// Where both links were, at equal times, as in a photograph by flashes.
  private drawFlashes(plant: Plant, moments: readonly Moment[]): void {
    const { context } = this.canvas;
    const width = Math.max(4, 0.025 * this.scale);
    context.lineCap = 'round';
    moments.forEach(({ t, state }, i) => {
      if (Math.round(t / CONTROL_PERIOD) % FLASH_STEPS !== 0) return;
      context.globalAlpha = (0.22 * i) / moments.length;
      const elbow = this.at(pointOn(plant, state, 1, plant.length1).position);
      const tip = this.at(pointOn(plant, state, 2, plant.length2).position);
      this.canvas.line([this.at(PIVOT), elbow], 'link1', width);
      this.canvas.line([elbow, tip], 'link2', width);
    });
    context.globalAlpha = 1;
    context.lineCap = 'butt';
  }

  private drawMotor(): void {
    const place = this.at(PIVOT);
    const radius = Math.max(9, 0.045 * this.scale);
    this.canvas.disc(...place, radius, 'ink');
    this.canvas.disc(...place, 0.45 * radius, 'stage');
  }

  /// Older parts are fainter.
  private drawTrail({ plant, time }: World, state: State, moments: readonly Moment[]): void {
    const tip = (s: State) => this.at(pointOn(plant, s, 2, plant.length2).position);
    const points = [...moments.map((moment) => tip(moment.state)), tip(state)];
    const shades = moments.map(({ t }) => {
      const age = Math.min(Math.max((time - t) / TRAIL_SECONDS, 0), 1);
      return Math.floor(TRAIL_SHADES * (1 - age)) / TRAIL_SHADES;
    });
    const { context } = this.canvas;
    context.lineJoin = 'round';
    for (let begin = 0; begin < moments.length;) {
      let end = begin + 1;
      while (end < moments.length && shades[end] === shades[begin]) ++end;
      context.globalAlpha = 0.6 * shades[begin]!;
      this.canvas.line(points.slice(begin, end + 1), 'link2', 2);
      begin = end;
    }
    context.globalAlpha = 1;
  }

  /// A link of 1 kg is as thick as its capsule, or more so that a finger finds it; a heavier one thicker.
  private drawLink(from: Vec, to: Vec, color: string, mass: number): void {
    const { context } = this.canvas;
    const thickness = Math.max(10, 0.06 * this.scale) * Math.min(Math.max(mass, 0.25), 3) ** 0.5;
    context.lineCap = 'round';
    this.canvas.line([this.at(from), this.at(to)], color, thickness);
    context.lineCap = 'butt';
  }

  /// An arc about the pivot, from above, clockwise for a positive torque; its length is the share of
  /// the motor's limit.
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

  private drawPush(world: World, state: State): void {
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

  /// Pixels from a place to the edge of the canvas in some direction, less the head of an arrow.
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
