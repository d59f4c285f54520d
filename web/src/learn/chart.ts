import { Canvas } from '../view/canvas';
import type { Course } from './course';
import type { Session } from './session';

const LEFT = 42; // px
const RIGHT = 42;
const BOTTOM = 16;
const MOST = 4; // reward per step, at least at the top of the chart

/// Chart of trainings over their steps: reward per step of trials and success at evaluations. The chosen
/// training is in front, with a mark at the policy on the stage.
export class LearnChart {
  readonly canvas = new Canvas('learn-curve');

  /// The success of both sides of a race: means, and bands from the worst to the best training.
  drawRace(sides: readonly [readonly Session[], readonly Session[]]): void {
    const { canvas } = this;
    canvas.clear();
    const steps = stepsOf(sides.flat());
    const { x, ofShare } = this.axes(steps);
    sides.forEach((side, i) => {
      const color = i === 0 ? 'link1' : 'link2';
      const tested = new Set(
        side.flatMap(({ evaluations }) => evaluations.map(({ step }) => step)),
      );
      const points = [...tested]
        .sort((a, b) => a - b)
        .map((step) => ({ at: x(step), success: successOf(side, step) }))
        .flatMap(({ at, success }) => (success ? [{ at, success }] : []));
      if (points.length < 2) return;
      const line = (k: 0 | 1 | 2) =>
        points.map(({ at, success }) => [at, ofShare(success[k])] as const);
      canvas.context.globalAlpha = 0.2;
      canvas.fill([...line(1), ...line(2).toReversed()], color);
      canvas.context.globalAlpha = 1;
      canvas.line(line(0), color, 2.5);
    });
  }

  /// Grid and names of steps and success, and places on the canvas.
  private axes(steps: number) {
    const { canvas } = this;
    const bottom = canvas.height - BOTTOM;
    const width = canvas.width - LEFT - RIGHT;
    const x = (step: number) => LEFT + (step / steps) * width;
    const ofShare = (share: number) => 6 + (bottom - 6) * (1 - share);
    for (const share of [0, 0.5, 1]) {
      const y = ofShare(share);
      const line = [LEFT, canvas.width - RIGHT].map((end) => [end, y] as [number, number]);
      canvas.line(line, 'grid', 1);
      canvas.text(`${100 * share}%`, canvas.width - RIGHT + 5, y, 'left', 'energy');
    }
    canvas.text('0', LEFT, canvas.height - 6);
    const end = `${steps.toLocaleString('en')} steps`;
    canvas.text(end, canvas.width - RIGHT, canvas.height - 6, 'right');
    return { x, ofShare, bottom };
  }

  draw(courses: readonly Course[], chosen: Course | null, at: number | null): void {
    const { canvas } = this;
    canvas.clear();
    const { x, ofShare, bottom } = this.axes(stepsOf(courses));
    const means = new Map(courses.map((course) => [course, meansOf(course)]));
    const largest = Math.max(MOST, ...[...means.values()].flat().map(({ value }) => value));
    const highest = 2 * Math.ceil(largest / 2);
    const ofReward = (value: number) => ofShare(Math.max(0, value) / highest);
    for (const share of [0, 0.5, 1]) {
      canvas.text((share * highest).toFixed(0), LEFT - 5, ofShare(share), 'right', 'torque');
    }

    for (const course of [...courses.filter((other) => other !== chosen), chosen]) {
      if (!course) continue;
      const front = course === chosen;
      const rewards = means
        .get(course)!
        .map(({ step, value }) => [x(step), ofReward(value)] as const);
      if (rewards.length > 1) canvas.line(rewards, front ? 'torque' : 'edge', front ? 2 : 1);
      const success = course.evaluations.map(
        ({ step, success: share }) => [x(step), ofShare(share)] as const,
      );
      if (success.length > 1) canvas.line(success, front ? 'energy' : 'edge', front ? 2 : 1);
      if (front) for (const [px, py] of success) canvas.disc(px, py, 3, 'energy');
    }
    if (at === null) return;
    canvas.line([[x(at), 2] as const, [x(at), bottom] as const], 'ink', 1.5);
    canvas.disc(x(at), bottom, 4, 'ink');
  }
}

/// The success of one side of a race at a step: mean and ends of its trainings. An ended training
/// keeps its last success. Null where one has not been tested yet.
function successOf(side: readonly Session[], step: number): [number, number, number] | null {
  const all: number[] = [];
  for (const { evaluations, active } of side) {
    const known = evaluations.findLast((one) => one.step <= step);
    if (!known || (active && evaluations.at(-1)!.step < step)) return null;
    all.push(known.success);
  }
  return [all.reduce((sum, x) => sum + x, 0) / all.length, Math.min(...all), Math.max(...all)];
}

/// Length of the chart in steps. Includes the tests of a recorded training after its best policy.
export function stepsOf(courses: readonly Course[]): number {
  const ends = courses.map(({ steps, evaluations }) => [steps, evaluations.at(-1)?.step ?? 0]);
  return Math.max(20_000, ...ends.flat());
}

/// Mean reward per step of the trials that ended at the same step. Environments that begin together end
/// together.
function meansOf({ episodes }: Course): { step: number; value: number }[] {
  const ended = new Map<number, number[]>();
  for (const { step, reward } of episodes) ended.set(step, [...(ended.get(step) ?? []), reward]);
  return [...ended].map(([step, values]) => {
    return { step, value: values.reduce((sum, x) => sum + x, 0) / values.length };
  });
}
