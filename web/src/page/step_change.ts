import type { Parameter } from '../pendulum';
import { element } from './dom';
import { enter, heldFor, NOMINAL_AGENT, yoursOf } from './step';
import type { Stage, Step } from './step';
import { HELD } from './verdict';

/// A step of the tour: the visitor changes the pendulum until its agent fails. It begins with one
/// slider; the others appear after its first use.

const PATIENCE = 12; // s until an agent that does not get up has failed

const CHOICES: readonly (readonly [Parameter | 'size', string])[] = [
  ['mass2', 'lower mass'],
  ['mass1', 'upper mass'],
  ['length2', 'lower length'],
  ['length1', 'upper length'],
  ['damping2', 'damping'],
  ['gravity', 'gravity'],
  ['size', 'size'],
];

export function change(stage: Stage): Step {
  let changedAt = 0; // s, in the world's time; 0: nothing has changed
  let fell = false; // since the change
  let told = ''; // the value that was changed last, such as "0.8 kg"
  const choice = element('change-choice');
  const rows = CHOICES.map(([name, text]) => {
    const slider = stage.plantSlider(name, `change-${name}`);
    const chip = document.createElement('button');
    chip.type = 'button';
    chip.textContent = text;
    chip.addEventListener('click', () => show(name));
    slider.element.addEventListener('input', () => changed(slider.text));
    slider.element.addEventListener('click', () => changed(slider.text)); // of the reset button
    return { name, slider, chip };
  });
  element('change-sliders').append(...rows.map(({ slider }) => slider.element));
  choice.append(...rows.map(({ chip }) => chip));

  /// Shows one of the sliders.
  const show = (shown: Parameter | 'size') => {
    for (const { name, slider, chip } of rows) {
      slider.element.hidden = name !== shown;
      chip.ariaPressed = String(name === shown);
    }
  };
  const changed = (text: string) => {
    if (text === told) return;
    told = text;
    changedAt = stage.world.time;
    fell = false;
    choice.style.visibility = '';
  };
  return {
    id: 'change',
    agents: [NOMINAL_AGENT],
    moves: true,
    yours: true,
    async begin() {
      changedAt = 0;
      told = '';
      show('mass2');
      choice.style.visibility = 'hidden'; // its place stays, so that nothing moves
      await enter(stage, { agent: yoursOf(stage), on: true });
    },
    answer(world) {
      if (changedAt === 0 || !world.agentOn) return '';
      const tried = (world.time - changedAt) * world.units.time;
      const held = heldFor(world);
      if (held > HELD && tried > HELD) {
        fell = false;
        return `Still up with ${told}. Go on!`;
      }
      if (tried > PATIENCE) return `It fails with ${told}: it never met such a pendulum.`;
      if (held === 0) fell = true;
      return fell ? 'It fell, and tries again …' : 'It holds on …';
    },
  };
}
