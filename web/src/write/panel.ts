import { coreModule } from '../core';
import type { Agent } from '../page/agents';
import { addressOf } from '../page/address';
import { nameSendButtons, send } from '../page/clipboard';
import type { Clock } from '../page/clock';
import { button, element, write } from '../page/dom';
import { recall, remember } from '../page/storage';
import { sentence, withMinus } from '../text';
import type { World } from '../world';
import type { Refusal } from './asker';
import { decodeText, encodeText, LONGEST_TEXT } from './link';
import { Live } from './live';
import { Sandbox } from './sandbox';
import type { Problem } from './sandbox';
import { EPISODES } from './score';
import type { Score } from './score';
import type { Contender, Result, Task } from './worker';
import MARKUP from './panel.html?raw';
import HINT from './hint.txt?raw';
import START from './start.txt?raw';
import './write.css';

/// The panel where a visitor writes a controller, runs it on the stage and scores it next to agents.

const KEY = 'controller';
/// The agents in the table of scores.
const RIVALS = ['d3qn', 'energy', 'lqr'];

/// The parts of the page that the panel uses.
export interface WritePage {
  readonly world: World;
  readonly clock: Clock;
  readonly agents: { has(id: string): boolean; get(id: string): Promise<Agent> };
  setAgentOn(on: boolean): void;
  /// Advances the pendulum by `seconds` of real time.
  advance(seconds: number): void;
  /// Hangs the pendulum.
  reset(): void;
}

// Markup of its own keeps the page's first load small.
element('write-panel').innerHTML = MARKUP;
nameSendButtons();

export class WritePanel {
  private readonly page: WritePage;
  private readonly editor = element<HTMLTextAreaElement>('write-text');
  private readonly progress = element<HTMLProgressElement>('write-progress');
  private sandbox: Sandbox | null = null;
  private live: Live | null = null; // while it runs on the stage
  private worker: Worker | null = null; // while it is scored
  private sent = ''; // text of the visitor's link

  constructor(page: WritePage) {
    this.page = page;
    this.editor.maxLength = LONGEST_TEXT;
    button('write-run', () => this.run());
    button('write-stop', () => this.leave());
    button('write-score', () => void this.score());
    button('write-share', () => void send('', addressOf(encodeText(this.text)), 'The link'));
    button('write-hint', () => this.set(HINT, true));
    button('write-again', () => this.set(START, true));
    this.editor.addEventListener('input', () => {
      remember(KEY, this.text);
      this.edited();
    });
    this.editor.addEventListener('scroll', () => this.number());
    this.editor.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      this.run();
    });
  }

  private get text(): string {
    return this.editor.value;
  }

  /// Shows the controller of an address, or else the visitor's own. Runs nothing. Returns the problems
  /// of the address.
  open(hash: string): readonly string[] {
    const { text, problems } = decodeText(hash);
    const own = recall(KEY) ?? START;
    this.sent = text ?? '';
    this.set(text ?? own, false);
    element('write-sent').hidden = text === null || text === own;
    return problems;
  }

  /// The part of the page's address after #. A sent controller stays in it until the
  /// visitor changes it.
  get address(): string {
    return this.sent !== '' && this.text === this.sent ? encodeText(this.sent) : 'write';
  }

  /// Ends everything that runs.
  leave(): void {
    this.sandbox?.close();
    this.sandbox = null;
    this.live?.close();
    this.live = null;
    this.worker?.terminate();
    this.worker = null;
    this.page.clock.ready = () => true;
    this.draw();
  }

  private set(text: string, keep: boolean): void {
    this.editor.value = text;
    if (keep) remember(KEY, text);
    this.edited();
  }

  /// Call after a change of the text.
  private edited(): void {
    element('write-sent').hidden = true;
    element('write-problem').textContent = '';
    element('write-own').textContent = '';
    this.number();
  }

  /// Starts the controller in a sandbox, and ends everything else. Returns the port to it.
  private begin(): MessagePort {
    this.leave();
    element('write-problem').textContent = '';
    const { port1, port2 } = new MessageChannel();
    this.sandbox = new Sandbox(this.text, port2, (problem) => this.fail(problem));
    return port1;
  }

  /// Runs the controller on the stage, from hanging.
  private run(): void {
    const { world, clock } = this.page;
    const port = this.begin();
    this.page.setAgentOn(false);
    this.page.reset();
    const live = new Live(
      world,
      port,
      () => this.page.advance(0),
      (refusal) => this.refused(refusal),
    );
    this.live = live;
    clock.ready = () => live.ready();
    this.draw();
  }

  /// Scores the controller, and each agent of the table at the first time.
  private async score(): Promise<void> {
    const own = await this.compute(this.begin());
    this.fill('write-own', 'Yours', own);
    element('write-table').hidden = false;
    element('write-status').textContent = `Yours balances ${own.balanced} of ${EPISODES} starts.`;
    const { agents } = this.page;
    for (const id of RIVALS.filter((id) => agents.has(id))) {
      const place = `write-${id}`;
      if (element(place).childElementCount > 0) continue;
      const { title, policy } = await agents.get(id);
      this.fill(place, title, await this.compute(policy.source));
    }
    this.leave();
  }

  /// The score of a contender, in a worker. Never settles if the visitor or a problem ends it.
  private compute(contender: Contender): Promise<Score> {
    const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker?.terminate();
    this.worker = worker;
    this.draw();
    return new Promise((resolve) => {
      worker.onmessage = ({ data }: MessageEvent<Result>) => {
        if (data.kind === 'progress') this.progress.value = data.share;
        else if (data.kind === 'refused') this.refused(data.refusal);
        else resolve(data.score);
      };
      worker.onerror = (event) => {
        event.preventDefault();
        this.fail({ text: 'the score could not be computed', row: null });
      };
      const task: Task = { module: coreModule(), contender };
      worker.postMessage(task, contender instanceof MessagePort ? [contender] : []);
    });
  }

  /// A row of the table.
  private fill(id: string, name: string, score: Score): void {
    const { balanced, swingUp, return: sum } = score;
    const head = document.createElement('th');
    head.scope = 'row';
    head.textContent = name;
    const cells = [
      `${balanced} of ${EPISODES}`,
      swingUp === null ? '–' : `${swingUp.toFixed(1)} s`,
      withMinus(sum.toFixed(0)),
    ].map((text) => {
      const cell = document.createElement('td');
      cell.textContent = text;
      return cell;
    });
    element(id).replaceChildren(head, ...cells);
  }

  private fail({ text, row }: Problem): void {
    this.leave();
    const where = row === null ? '' : `Row ${row}: `;
    element('write-problem').textContent = sentence(`${where}${text}`);
    this.number(row);
  }

  private refused({ text, returned }: Refusal): void {
    this.fail({ text, row: returned ? onlyReturn(this.text) : null });
  }

  private draw(): void {
    const scores = this.worker !== null;
    element<HTMLButtonElement>('write-stop').disabled = !scores && this.live === null;
    element<HTMLButtonElement>('write-score').disabled = scores;
    this.progress.hidden = !scores;
  }

  /// Numbers the rows, as far scrolled as the text, and marks one of them.
  private number(marked: number | null = null): void {
    const place = element('write-rows');
    const rows = this.text.split('\n').length;
    write(
      place,
      Array.from({ length: rows }, (_, i) => `${i + 1}${i + 1 === marked ? '◂' : ''}`).join('\n'),
    );
    place.scrollTop = this.editor.scrollTop;
  }
}

/// The row of the only return; null if there are several.
function onlyReturn(text: string): number | null {
  const rows = text.split('\n').flatMap((line, i) => (/\breturn\b/.test(line) ? [i + 1] : []));
  return rows.length === 1 ? rows[0]! : null;
}
