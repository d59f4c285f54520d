import { CONTROL_PERIOD } from '../pendulum';
import { addressOf } from './address';
import { send } from './clipboard';
import { button, element, write } from './dom';
import { Game } from './game';
import { prefersStill } from './motion';
import { MotorKeys } from './motor';
import { OWN } from './share';
import { ARROWS, enter, GOAL, heldFor, NOMINAL_AGENT, SMALL_AGENT, yoursOf } from './step';
import type { Stage, Step } from './step';
import { bet } from './step_bet';
import { change } from './step_change';
import { pose } from './step_pose';
import { reward } from './step_reward';
import { HELD } from './verdict';

/// The steps of the tour: their actions on the page, and their answers to the visitor. Their words
/// and controls are in index.html.

const CALM = 5; // s balanced until the tour shoves the pendulum
const SHOVES = 2; // at once, so that it is a push that the visitor sees

function watch(stage: Stage): Step {
  let direction: -1 | 1 = 1;
  const swingUp = () => {
    stage.setAgentOn(true);
    stage.reset();
  };
  const again = button('watch-again', swingUp);
  return {
    id: 'watch',
    agents: [SMALL_AGENT],
    labels: () => [GOAL, { at: 'motor', text: 'the motor' }],
    async begin() {
      const on = !prefersStill();
      again.textContent = on ? 'Swing up again' : 'Swing up';
      await stage.begin({ agent: SMALL_AGENT, on });
    },
    moment() {
      const { world } = stage;
      const calm = Math.min(heldFor(world), world.time - (world.shoved?.at ?? -Infinity));
      if (prefersStill() || world.push || calm < CALM) return;
      for (let k = 0; k < SHOVES; ++k) world.shoveTo(direction);
      direction = direction === 1 ? -1 : 1;
    },
    answer(world) {
      if (heldFor(world) < HELD) return '';
      return world.shoved
        ? 'Balanced, even when it is shoved. Now see how that is learned: press Start.'
        : 'Balanced, after 70 minutes of practice, computed in seconds. Press Start.';
    },
  };
}

function motor(stage: Stage): Step {
  const keys = new MotorKeys(stage.world);
  const game = new Game(
    stage.world,
    (speed) => stage.setSpeed(speed),
    () => stage.reset(),
  );
  return {
    id: 'motor',
    agents: [],
    labels: ({ torque }) => [
      GOAL,
      ...(torque === 0 ? [] : [{ at: 'motor', text: 'your torque' } as const]),
      ...(game.ghost ? [{ at: 'ghost', text: game.ghostName } as const] : []),
    ],
    async begin(ghost) {
      keys.enabled = true;
      if (!(await stage.begin({ agent: SMALL_AGENT, on: false }))) return;
      game.open(ghost);
      void stage.choose(NOMINAL_AGENT); // The large agent loads while the visitor plays.
    },
    end() {
      keys.enabled = false;
      game.close();
    },
    ghost: () => game.ghost,
    code: () => game.code,
    moment: ({ state }) => game.moment(state),
    answer() {
      game.draw();
      return game.answer;
    },
  };
}

const NAMED = 2000; // ms that the ring has a label

function learn(stage: Stage): Step {
  let ringSince = 0; // ms; 0: there is no ring
  let asks = false; // whether the visitor guesses an update
  const start = button('tour-learn', () => {
    const { running, paused } = stage.learn;
    if (running || paused) stage.learn.toggle();
    else stage.learn.start();
  });
  const ask = button('tour-ask', () => (asks = !asks));
  const buttonName = () => {
    const { running, paused, story } = stage.learn;
    if (paused) return 'Resume';
    if (running) return 'Pause';
    return story.milestone === '' ? 'Learn' : 'Start over';
  };
  return {
    id: 'learn',
    agents: [NOMINAL_AGENT],
    labels() {
      if (!stage.learn.begun) ringSince = 0;
      else if (ringSince === 0) ringSince = performance.now();
      const isNew = ringSince > 0 && performance.now() - ringSince < NAMED;
      return isNew ? [{ at: 'ring', text: 'expected points' }] : [];
    },
    async begin() {
      asks = false;
      const learned = stage.learn.keeps;
      const on = learned && !prefersStill();
      if (!(await stage.begin({ agent: learned ? OWN : NOMINAL_AGENT, on }))) return;
      stage.learn.show();
    },
    answer() {
      const { story, asks: canAsk } = stage.learn;
      asks &&= canAsk;
      write(start, buttonName());
      ask.style.visibility = canAsk ? '' : 'hidden'; // its place stays, so that nothing moves
      ask.ariaPressed = String(asks);
      write(ask, asks ? 'Back to the curve' : 'Guess an update');
      element('learn-ask').hidden = !asks;
      element('step-learn').toggleAttribute('data-asks', asks);
      write(element('tour-count'), story.count);
      return story.milestone;
    },
  };
}

function shove(stage: Stage): Step {
  let shoved = 0; // time of the last shove (s)
  let fell = false;
  const push = (direction: -1 | 1) => stage.world.shoveTo(direction);
  button('tour-shove-left', () => push(-1));
  button('tour-shove-right', () => push(1));
  return {
    id: 'shove',
    agents: [NOMINAL_AGENT],
    moves: true,
    yours: true,
    keys: ARROWS,
    async begin() {
      await enter(stage, { agent: yoursOf(stage), on: true });
      shoved = 0;
      fell = false;
    },
    answer(world) {
      if (world.push) {
        shoved = world.time;
        if (heldFor(world) > HELD) fell = false; // so that the next fall counts as another one
      }
      if (shoved === 0)
        return heldFor(world) > HELD || !world.agentOn ? '' : 'Wait until it is up …';
      if (heldFor(world) === 0) fell = true;
      if (fell && heldFor(world) > HELD) return 'It fell, and swung up again by itself.';
      if (fell) return 'It falls …';
      if (world.time - shoved < HELD) return 'It catches the shove …';
      return 'It caught that shove. Now try several, quickly.';
    },
  };
}

const SMALL_TORQUE = 1; // N·m
const MEMORY = 0.5; // s that the mean torque remembers

function values(stage: Stage): Step {
  let effort = 0; // running mean of the torque's size, N·m
  const speed = element<HTMLInputElement>('tour-speed');
  const show = () => {
    element('tour-speed-value').textContent = `${speed.value}×`;
    stage.setSpeed(Number(speed.value));
  };
  speed.addEventListener('input', show);
  return {
    id: 'values',
    agents: [NOMINAL_AGENT],
    moves: true,
    yours: true,
    keys: ARROWS,
    async begin() {
      effort = 0;
      speed.value = '1';
      element('tour-speed-value').textContent = '1×';
      await stage.begin({ agent: yoursOf(stage), on: !prefersStill() });
    },
    moment({ torque }) {
      effort += (CONTROL_PERIOD / MEMORY) * (Math.abs(torque) - effort);
    },
    answer(world) {
      if (heldFor(world) <= HELD) return '';
      const what = effort < SMALL_TORQUE ? 'small torques are best' : 'its torques are large';
      return `Upright, ${what}. Drag the pendulum and watch the bars.`;
    },
  };
}

function map(stage: Stage): Step {
  let clicked = false;
  return {
    id: 'map',
    agents: [NOMINAL_AGENT],
    moves: true,
    yours: true,
    async begin() {
      clicked = false;
      stage.resetMap();
      await enter(stage, { agent: yoursOf(stage), on: true });
    },
    started() {
      clicked = true;
      stage.setAgentOn(true);
    },
    answer(world) {
      if (!clicked) return '';
      return heldFor(world) > HELD
        ? 'From there it found its way to the bright middle: upright.'
        : 'Follow the dot …';
    },
  };
}

/// The last step: a summary and links.
function end(stage: Stage): Step {
  button('tour-send', () => void send(INVITATION, addressOf('tour'), 'An invitation'));
  return {
    id: 'end',
    agents: [NOMINAL_AGENT],
    moves: true,
    yours: true,
    async begin() {
      await stage.begin({ agent: yoursOf(stage), on: !prefersStill() });
      element('tour-end').textContent = stage.agents.ownIsLearned
        ? 'Everything, with your own agent'
        : 'Everything at once';
    },
  };
}

const INVITATION = 'A double pendulum learns to stand up, in your browser. Can you do it by hand?';

export function makeSteps(stage: Stage): Step[] {
  return [watch, motor, learn, shove, bet, change, reward, pose, values, map, end].map((make) =>
    make(stage),
  );
}
