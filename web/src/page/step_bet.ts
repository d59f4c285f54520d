import { NOMINAL } from '../pendulum';
import { button, element, write } from './dom';
import { ADAPTIVE_AGENT, heldFor, NOMINAL_AGENT, yoursOf } from './step';
import type { Stage, Step } from './step';
import { laterOf, textOf, verdictOf } from './verdict';
import type { Verdict } from './verdict';

/// A step of the tour: a race of two agents with a pendulum that is new to one of them.

const LIGHT = 0.65; // kg

export function bet(stage: Stage): Step {
  let onMany = false; // the visitor's bet
  let verdict: Verdict | null = null;
  let begun = 0; // s, in the world's time
  const choices = [
    [button('bet-one', () => void run(false)), false],
    [button('bet-many', () => void run(true)), true],
  ] as const;

  /// Hangs both pendulums, and starts them if there is a bet.
  const begin = async (on: boolean) => {
    const plant = { ...NOMINAL, mass2: LIGHT };
    const race = { agent: yoursOf(stage), twin: ADAPTIVE_AGENT, plant };
    if (!(await stage.begin({ ...race, on }))) return;
    verdict = null;
    begun = stage.world.time;
  };
  const run = (many: boolean) => {
    onMany = many;
    for (const [choice, of] of choices) choice.ariaPressed = String(of === many);
    return begin(true);
  };
  return {
    id: 'bet',
    agents: [NOMINAL_AGENT, ADAPTIVE_AGENT],
    yours: true,
    labels: () => [{ at: 'link2', text: `${LIGHT} kg` }],
    async begin() {
      for (const [choice] of choices) choice.ariaPressed = 'false';
      await begin(false);
    },
    answer(world) {
      const { ownIsLearned } = stage.agents;
      write(element('first-name'), ownIsLearned ? 'yours, learned on one' : 'learned on one');
      write(element('twin-name'), 'learned on many');
      if (!world.agentOn || !world.twin) return '';
      const [one, many] = [heldFor(world), heldFor(world.twin)];
      verdict ??= verdictOf(one, many, world.time - begun);
      if (!verdict) return 'Both try …';
      return `${textOf(verdict, onMany)}${laterOf(verdict, one, many)}`;
    },
  };
}
