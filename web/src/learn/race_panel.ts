import { button, element, write } from '../page/dom';
import type { LearnSettings } from './learner';
import { resultOf, stepsToSolve, winnerOf } from './race';
import { nameOf, RIVALS } from './rivals';
import type { Rival } from './rivals';
import type { Session } from './session';

/// The choice of a rival, the bet on a race, and its result.
export class RacePanel {
  private readonly select = element<HTMLSelectElement>('learn-rival');
  private readonly bets: readonly HTMLButtonElement[];
  private bet: number | null = null; // side, of the race that goes on
  private next: number | null = null; // side, of the race that begins

  /// `start`: starts a race. `changed`: called when another rival is chosen.
  constructor(start: () => void, changed: () => void) {
    for (const { id, name } of RIVALS) this.select.append(new Option(name, id));
    this.select.addEventListener('change', changed);
    this.bets = ['race-one', 'race-two'].map((id, side) =>
      button(id, () => {
        this.next = side;
        start();
        this.next = null;
      }),
    );
  }

  /// The chosen rival.
  get rival(): Rival | null {
    return RIVALS.find(({ id }) => id === this.select.value) ?? null;
  }

  choose(id: string | undefined): void {
    this.select.value = id ?? '';
  }

  /// Shows the bet for the agent that would start against the rival.
  offer(agent: string, settings: LearnSettings): void {
    const own = nameOf(agent, settings);
    if (this.rival?.name === own) this.select.value = '';
    for (const option of this.select.options) option.hidden = option.text === own;
    const { rival } = this;
    element('race').hidden = rival === null;
    if (!rival) return;
    this.bets[0]!.textContent = own;
    this.bets[1]!.textContent = rival.name;
  }

  /// Call when other trainings have begun.
  begun(): void {
    this.bet = this.next;
    this.bets.forEach((one, side) => (one.ariaPressed = String(side === this.bet)));
  }

  /// Shows how far a race is, or its result.
  show(sides: readonly [readonly Session[], readonly Session[]] | null): void {
    write(element('race-result'), sides ? this.textOf(sides) : '');
    const runs = sides?.flat() ?? [];
    const goesOn = runs.some(({ active }) => active);
    for (const bet of this.bets) bet.disabled = goesOn;
    const ended = runs.length > 0 && runs.every(({ state }) => state === 'finished');
    const explained = ended && isFamily(runs.map(({ agent }) => agent));
    for (const id of ['race-how', 'race-why']) element(id).hidden = !explained;
    sides?.forEach(([first], side) => {
      write(element(`race-name-${side}`), nameOf(first!.agent, first!.settings));
    });
  }

  private textOf(sides: readonly [readonly Session[], readonly Session[]]): string {
    const [one, two] = [stepsToSolve(sides[0]), stepsToSolve(sides[1])];
    const all = sides.flat();
    if (all.some(({ state }) => state === 'stopped')) return 'The race was ended.';
    if (!one || !two) {
      const ended = all.filter(({ active }) => !active).length;
      return `${ended} of ${all.length} trainings have ended.`;
    }
    const winner = winnerOf(one, two);
    const names = sides.map(([first]) => nameOf(first!.agent, first!.settings));
    const result = resultOf(names as [string, string], [one, two]);
    if (this.bet === null || !winner) return result;
    return `${this.bet === winner.side ? 'You were right' : 'You lost'}. ${result}`;
  }
}

/// Whether all are of the DQN family, which the page explains.
const isFamily = (agents: readonly string[]) => agents.every((agent) => agent === 'fast');
