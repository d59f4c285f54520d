import { Canvas } from '../view/canvas';
import type { Course } from './course';

const LEFT = 42; // px
const RIGHT = 42;
const BOTTOM = 16;

/// Chart of trainings over their steps: returns of trials and success at evaluations. The chosen
/// training is in front, with a mark at the policy on the stage.
export class LearnChart {
  readonly canvas = new Canvas('learn-curve');

  draw(courses: readonly Course[], chosen: Course | null, at: number | null): void {
    const { canvas } = this;
    canvas.clear();
    const bottom = canvas.height - BOTTOM;
    const width = canvas.width - LEFT - RIGHT;
    const steps = stepsOf(courses);
    const means = new Map(courses.map((course) => [course, meansOf(course)]));
    const largest = Math.max(1000, ...[...means.values()].flat().map(({ value }) => value));
    const highest = 500 * Math.ceil(largest / 500);
    const x = (step: number) => LEFT + (step / steps) * width;
    const ofReturn = (value: number) => 6 + (bottom - 6) * (1 - Math.max(0, value) / highest);
    const ofSuccess = (share: number) => 6 + (bottom - 6) * (1 - share);

    for (const share of [0, 0.5, 1]) {
      const y = ofSuccess(share);
      const line = [LEFT, canvas.width - RIGHT].map((end) => [end, y] as [number, number]);
      canvas.line(line, 'grid', 1);
      const value = share * highest;
      canvas.text(value.toFixed(0), LEFT - 5, y, 'right', 'torque');
      canvas.text(`${100 * share}%`, canvas.width - RIGHT + 5, y, 'left', 'energy');
    }
    canvas.text('0', LEFT, canvas.height - 6);
    const end = `${steps.toLocaleString('en')} steps`;
    canvas.text(end, canvas.width - RIGHT, canvas.height - 6, 'right');

    for (const course of [...courses.filter((other) => other !== chosen), chosen]) {
      if (!course) continue;
      const front = course === chosen;
      const returns = means
        .get(course)!
        .map(({ step, value }) => [x(step), ofReturn(value)] as const);
      if (returns.length > 1) canvas.line(returns, front ? 'torque' : 'edge', front ? 2 : 1);
      const success = course.evaluations.map(
        ({ step, success: share }) => [x(step), ofSuccess(share)] as const,
      );
      if (success.length > 1) canvas.line(success, front ? 'energy' : 'edge', front ? 2 : 1);
      if (front) for (const [px, py] of success) canvas.disc(px, py, 3, 'energy');
    }
    if (at === null) return;
    canvas.line([[x(at), 2] as const, [x(at), bottom] as const], 'ink', 1.5);
    canvas.disc(x(at), bottom, 4, 'ink');
  }
}

/// Length of the chart in steps. Includes the tests of a recorded training after its best policy.
export function stepsOf(courses: readonly Course[]): number {
  const ends = courses.map(({ steps, evaluations }) => [steps, evaluations.at(-1)?.step ?? 0]);
  return Math.max(20_000, ...ends.flat());
}

/// Mean return of the trials that ended at the same step. Environments that begin together end
/// together.
function meansOf({ episodes }: Course): { step: number; value: number }[] {
  const ended = new Map<number, number[]>();
  for (const { step, return: value } of episodes)
    ended.set(step, [...(ended.get(step) ?? []), value]);
  return [...ended].map(([step, values]) => {
    return { step, value: values.reduce((sum, x) => sum + x, 0) / values.length };
  });
}
