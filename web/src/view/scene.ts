import type { State } from '../pendulum';
import type { Vec } from '../simulator';
import { pointOn } from '../world';
import type { Moment, World } from '../world';
import { Canvas } from './canvas';

export const TRAIL_SECONDS = 1.3; // of the pendulum's time
const TRAIL_SHADES = 13;
const LARGEST_ARC = (150 / 180) * Math.PI; // at the motor's limit

/// The pendulum in its plane, seen so that positive angles and torques are clockwise.
export class Scene {
  readonly canvas = new Canvas('scene');

  /// Pixels per metre.
  private scale = 1;

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
    this.drawGuides(plant.length1 + plant.length2);
    this.drawTrail(world, state, trail);

    const elbow = pointOn(plant, state, 1, plant.length1).position;
    const tip = pointOn(plant, state, 2, plant.length2).position;
    this.drawLink({ x: 0, z: 0 }, elbow, 'link1', plant.mass1);
    this.drawLink(elbow, tip, 'link2', plant.mass2);
    canvas.disc(...this.at({ x: 0, z: 0 }), 7, 'ink');
    canvas.disc(...this.at(elbow), 4, 'panel');
    this.drawTorque(world.torque / plant.torque_limit);
    this.drawPush(world, state);
  }

  /// How far the tip reaches, and the cone within which a link is upright.
  private drawGuides(reach: number): void {
    const { context } = this.canvas;
    const [x, y] = this.at({ x: 0, z: 0 });
    const radius = this.scale * reach;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.strokeStyle = this.canvas.color('edge');
    context.lineWidth = 0.5;
    context.stroke();
    context.beginPath();
    context.moveTo(x, y);
    context.arc(x, y, radius, (-120 / 180) * Math.PI, (-60 / 180) * Math.PI);
    context.fillStyle = this.canvas.color('cone');
    context.fill();
    context.closePath();
    context.stroke();
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

  /// A link is as thick as its capsule, or more so that a finger finds it; heavier is darker.
  private drawLink(from: Vec, to: Vec, color: string, mass: number): void {
    const { context } = this.canvas;
    context.lineCap = 'round';
    context.globalAlpha = Math.min(1, 0.55 + 0.3 * mass);
    this.canvas.line([this.at(from), this.at(to)], color, Math.max(10, 0.06 * this.scale));
    context.globalAlpha = 1;
    context.lineCap = 'butt';
  }

  /// An arc about the pivot, from above, clockwise for a positive torque; its length is the share of
  /// the motor's limit.
  private drawTorque(share: number): void {
    if (Math.abs(share) < 1e-9) return;
    const { context } = this.canvas;
    const [x, y] = this.at({ x: 0, z: 0 });
    const radius = 0.17 * this.scale;
    const [start, end] = [-Math.PI / 2, -Math.PI / 2 + share * LARGEST_ARC];
    context.beginPath();
    context.arc(x, y, radius, start, end, share < 0);
    context.strokeStyle = this.canvas.color('torque');
    context.lineWidth = 5;
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
    if (!push) return;
    const size = Math.hypot(push.force.x, push.force.z); // N
    if (size < 0.05) return;
    const [x, y] = this.at(pointOn(plant, state, push.link, push.along).position);
    const [dx, dy] = [push.force.x / size, -push.force.z / size];
    const length = Math.min(14 + 5 * size, this.room(x, y, dx, dy)); // pixels
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
