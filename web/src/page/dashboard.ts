import type { History } from '../history';
import {
  energy,
  inverted,
  normalizedEnergy,
  relativeHeight,
  restIn,
  rewardTerms,
  tipHeight,
} from '../pendulum';
import type { State } from '../pendulum';
import type { Decision } from '../decision';
import { shownIn } from '../quantity';
import type { Shown } from '../quantity';
import { PhasePortrait, SECONDS_SHOWN, signed, Strip } from '../view/charts';
import { withMinus } from '../text';
import { DecisionChart } from '../view/decision';
import { NeuronChart } from '../view/neurons';
import type { Moment, World } from '../world';
import { element, write } from './dom';

const FRAMES = 2; // the charts take turns: each is drawn at every second frame
/// What the chart of a decision shows.
const NAMES = {
  q: 'Q-values',
  gaussian: 'Policy',
  categorical: 'Policy',
  computed: 'Decision',
} as const;
const TORQUE_MEAN = 15; // control steps: a balancing agent changes its torque at each of them

/// The charts and their numbers.
export class Dashboard {
  private readonly energy = new Strip('energy', 'energy', (m) => m.energy);
  private readonly height = new Strip('height', 'link2', (m) => m.height);
  private readonly torque = new Strip('torque', 'torque', (m) => m.torque);
  private readonly phase = new PhasePortrait();
  private readonly decision = new DecisionChart();
  private readonly neurons = new NeuronChart();
  private frame = 0;

  get canvases() {
    const { energy, height, torque, phase, decision, neurons } = this;
    return [energy, height, torque, phase, decision, neurons].map((c) => c.canvas);
  }

  /// Whether a chart that changes all the time is in sight.
  get inSight(): boolean {
    return this.canvases.some((canvas) => canvas.shown);
  }

  draw(world: World, history: History): void {
    const turn = this.frame++;
    const moments = history.from(world.time - SECONDS_SHOWN);
    if (turn % FRAMES === 0) this.drawWay(moments, world);
    else this.drawTorque(moments, world);
    if (turn % (5 * FRAMES) === 0) this.showNumbers(world);
  }

  private drawWay(moments: readonly Moment[], { time: now, plant, target, units }: World): void {
    const goal = restIn(target);
    this.energy.draw(moments, now, units, {
      low: -0.1,
      high: 1.6,
      target: normalizedEnergy(plant, goal),
      labels: [
        [0, 'hang'],
        [1, 'up'],
      ],
    });
    this.height.draw(moments, now, units, {
      low: -1.1,
      high: 1.1,
      target: relativeHeight(plant, goal),
      labels: [
        [-1, 'hang'],
        [0, 'pivot'],
        [1, 'up'],
      ],
    });
    this.phase.draw(moments, units);
  }

  private drawTorque(moments: readonly Moment[], world: World): void {
    const { time: now, plant, decision, policy, units } = world;
    const limit = plant.torque_limit;
    const { factor, unit } = torqueIn(world);
    this.torque.draw(moments, now, units, {
      unit,
      mean: TORQUE_MEAN,
      low: -1.1 * limit,
      high: 1.1 * limit,
      labels: [
        [-limit, signed(-factor * limit)],
        [0, '0'],
        [limit, signed(factor * limit)],
      ],
    });
    this.decision.draw(decision, policy?.rewardScale ?? 1, torqueIn(world));
    if (this.neurons.canvas.shown) this.neurons.draw(policy?.neurons ?? null, world.seen);
  }

  /// A few times a second, so that the numbers can be read.
  private showNumbers(world: World): void {
    const { plant, policy, decision, state, target, units } = world;
    const goal = restIn(target);
    const of = target ? ', goal' : ' of';
    const both = (quantityOf: typeof energy, si: number, name: string) => {
      const { factor, unit } = shownIn(quantityOf(plant, restIn(null)), si, name);
      const text = (s: State) => `${fixed(factor * quantityOf(plant, s))} ${unit}`;
      return `${text(state)}${of} ${text(goal)}`;
    };
    tell('energy', both(energy, units.torque, 'J'));
    tell('height', both(tipHeight, units.size, 'm'));
    const torque = torqueIn(world);
    tell('torque', `${fixed(torque.factor * world.torque)} ${torque.unit}`);
    const name = decision ? NAMES[decision.kind] : 'Policy';
    write(element('q-name'), name);
    element('q').dataset.name = name;
    tell('q', policy && decision ? decisionText(decision, policy.rewardScale, torque) : '');
    write(element('reward'), rewardText(rewardTerms(plant, state, world.torque, target)));
  }
}

/// The unit of the world's torques.
export function torqueIn({ plant, units }: World): Shown {
  return shownIn(plant.torque_limit, units.torque, 'N·m', 1);
}

/// Writes a number next to its chart, and into the chart's name for screen readers.
function tell(chart: string, text: string): void {
  write(element(`${chart}-value`), text);
  const label = `${element(chart).dataset.name}: ${text}`;
  if (element(chart).ariaLabel !== label) element(chart).ariaLabel = label;
}

/// Two decimals.
function fixed(value: number): string {
  return withMinus(value.toFixed(2));
}

function rewardText(terms: number[]): string {
  const sum = terms.reduce((total, term) => total + term, 0);
  const text = terms.map(
    (term, i) => (i > 0 ? `${term < 0 ? '−' : '+'} ` : '') + Math.abs(term).toFixed(2),
  );
  return `${text.join(' ')} = ${fixed(sum)}`;
}

/// The decision's torque, and its value in units of the reward.
export function decisionText(decision: Decision, rewardScale: number, shown: Shown): string {
  const inUnit = (torque: number) => fixed(shown.factor * torque);
  const reward = (x: number) => withMinus((x / rewardScale).toFixed(1));
  const value = Number.isNaN(decision.value) ? '' : reward(decision.value);
  switch (decision.kind) {
    case 'q': {
      const best = decision.q[decision.action]!;
      const cost = reward(best - Math.min(...decision.q));
      const all = withMinus((best / rewardScale).toFixed(0));
      return `best ${all} points, worst ${cost} less`;
    }
    case 'gaussian': {
      const { torque, low, high } = decision;
      const spread = inUnit((high - low) / 2);
      return `${inUnit(torque)} ${shown.unit}, σ ${spread}${value && `, V ${value}`}`;
    }
    case 'computed':
      return `${inUnit(decision.torque)} ${shown.unit}`;
    case 'categorical': {
      const percent = (100 * decision.probabilities[decision.action]!).toFixed(0);
      return `likeliest ${percent}%${value && `, V ${value}`}`;
    }
  }
}

const SPIN = 3; // rad/s
const BALANCED = 1; // s upright, after which it is more than a swing through the top

/// The pendulum's state in words. `said`: the text without numbers.
export function situation(world: World): { state: string; text: string; said: string } {
  const { agentOn, target } = world;
  const isUp = target === null || target.name === 'up-up';
  const { state, text } = agentOn && !isUp ? onItsWay(world) : upOrNot(world);
  return { state, text, said: text.replace(/ for [\d.]+ s$/, '') };
}

/// The state of a pendulum with another goal than upright.
function onItsWay({ uprightFor: held, state, units }: World): { state: string; text: string } {
  if (held !== null && held >= BALANCED)
    return { state: 'balanced', text: `in the pose for ${(units.time * held).toFixed(1)} s` };
  if (held !== null && isSlow(state)) return { state: 'upright', text: 'in the pose' };
  return { state: 'swinging', text: 'on its way' };
}

function upOrNot(world: World): { state: string; text: string } {
  const upright = inverted(world.state) ? world.uprightFor : null;
  if (upright !== null && upright >= BALANCED)
    return {
      state: 'balanced',
      text: `balanced for ${(world.units.time * upright).toFixed(1)} s`,
    };
  if (upright !== null && isSlow(world.state)) return { state: 'upright', text: 'upright' };
  if (world.agentOn)
    return {
      state: 'swinging',
      text: world.policy?.swingsUp === false ? 'cannot swing up' : 'swinging up',
    };
  return isAtRest(world.state)
    ? { state: 'hanging', text: 'hanging' }
    : { state: 'free', text: 'swinging freely' };
}

/// Whether no link is spinning.
function isSlow({ w1, w2 }: State): boolean {
  return Math.max(Math.abs(w1), Math.abs(w1 + w2)) < SPIN;
}

function isAtRest({ q1, q2, w1, w2 }: State): boolean {
  return Math.abs(w1) + Math.abs(w2) < 0.02 && Math.cos(q1) > 0.999 && Math.cos(q1 + q2) > 0.999;
}
