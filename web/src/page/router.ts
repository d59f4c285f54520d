import type { LearnPanel } from '../learn/panel';
import { plantProblem } from '../pendulum';
import type { WritePage, WritePanel } from '../write/panel';
import { Address } from './address';
import type { Agents } from './agents';
import { button, element } from './dom';
import type { Laboratory } from './laboratory';
import { explain, listenToExamples, placeCharts } from './layout';
import { warn } from './message';
import { prefersStill } from './motion';
import { RANGES } from './settings';
import { decode, encode, OWN, problemText } from './share';
import type { Shared } from './share';
import type { PendulumStage } from './stage';
import type { Tour } from './tour';
import { showView, viewOf } from './views';

const PANEL_KEYS = ['g', 'r', 'ArrowLeft', 'ArrowRight']; // pauses a training, not the pendulum

/// The parts of the page that the router changes.
export interface Routed {
  readonly agents: Agents;
  readonly stage: PendulumStage;
  readonly laboratory: Laboratory;
  readonly learn: LearnPanel;
  readonly tour: Tour;
}

/// Shows the view of an address, and writes the address of the shown view.
export class Router {
  laboratoryHash = ''; // last address of Everything
  private readonly parts: Routed;
  private readonly writePage: WritePage;
  private readonly address = new Address(() => this.hash());
  private write: WritePanel | null = null; // loaded when it is needed first
  private view = viewOf(location.hash).name;
  private learning_ = false;

  constructor(parts: Routed, writePage: WritePage) {
    this.parts = parts;
    this.writePage = writePage;
  }

  /// Whether the view or the step of the tour is a training.
  get learning(): boolean {
    return this.learning_;
  }

  /// The page's keys that the view leaves to the pendulum; null: all.
  get keys(): readonly string[] | null {
    return ['learn', 'write'].includes(this.view) ? PANEL_KEYS : this.parts.tour.keys;
  }

  /// The title of a film: what the stage shows.
  get title(): readonly [string, string] {
    const { laboratory, learn, stage, tour } = this.parts;
    if (this.learning) return learn.title;
    if (this.view === 'write') return ['A controller of my own', ''];
    if (this.view === 'tour') return [tour.title, ''];
    const twin = stage.world.twin ? `and ${element('twin-name').textContent}` : '';
    return [laboratory.agent?.title ?? '', twin];
  }

  /// Starts to handle input.
  listen(): void {
    button('share', () => {
      const isOwn = this.parts.laboratory.agent?.id === OWN;
      const without = isOwn ? ' (without your policy, which stays with you)' : '';
      void this.address.share(this.hash(true) || 'everything', without);
    });
    // The event's address: the page may have written another one since.
    addEventListener('hashchange', ({ newURL }) => void this.open(new URL(newURL).hash));
    listenToExamples(() => void this.open());
  }

  /// Shows the view of an address, with its settings.
  async open(hash = location.hash): Promise<void> {
    const { agents, laboratory, learn, stage, tour } = this.parts;
    if (hash === '#how') {
      if (this.view !== 'everything' || !laboratory.agent) await this.open('#everything');
      this.address.changed();
      return explain();
    }
    const view = viewOf(hash);
    const isOther = this.view !== view.name;
    if (isOther && this.view === 'everything' && laboratory.agent) {
      this.laboratoryHash = this.hash();
    }
    this.view = view.name;
    this.write?.leave();
    if (isOther) scrollTo(0, 0);
    const returns = isOther && hash === '#everything';
    showView(view);
    placeCharts();
    stage.setPaused(false);
    if (view.name === 'tour') {
      learn.learnFor(hash);
      return tour.go(view.step, false, new URLSearchParams(hash.slice(1)).get('ghost') ?? '');
    }
    const learns = view.name === 'learn';
    const writes = view.name === 'write';
    const { shared, problems }: { shared: Partial<Shared>; problems: string[] } =
      learns || writes
        ? { shared: {}, problems: [] }
        : decode(returns ? this.laboratoryHash : hash, RANGES, (id) => agents.has(id));
    const unstable = shared.plant ? plantProblem(shared.plant) : '';
    if (unstable) {
      delete shared.plant;
      problems.push(unstable);
    }
    // A policy learned in the page stays on the stage.
    const isAsked = shared.agent && !returns;
    if ((learns || tour.number > 0) && learn.keeps && !isAsked) {
      Object.assign(shared, { agent: OWN, on: !prefersStill() });
    }
    tour.leave();
    this.arranged();
    stage.world.agentOn = false;
    if (!(await laboratory.begin(shared))) return;
    if (learns) {
      problems.push(...learn.open(hash));
      learn.show();
    }
    if (writes) problems.push(...(await this.openWriting(hash)));
    if (problems.length > 0) warn(problemText(problems));
  }

  /// Call after a change that the address shows.
  changed(): void {
    this.address.changed();
  }

  /// Sets up the stage for the view, step or training.
  arranged(): void {
    const { laboratory, learn } = this.parts;
    const { step } = document.documentElement.dataset;
    this.learning_ = this.view === 'learn' || step === 'learn' || step === 'reward';
    laboratory.mapAtRest = this.view !== 'everything';
    if (!this.learning) learn.leave();
  }

  /// Opens the editor of a controller. Returns the problems of the address.
  private async openWriting(hash: string): Promise<readonly string[]> {
    try {
      const { WritePanel } = await import('../write/panel');
      this.write ??= new WritePanel(this.writePage);
    } catch {
      return ['the editor cannot be loaded'];
    }
    return this.view === 'write' ? this.write.open(hash) : [];
  }

  /// The page's state for the address, or for a link to others, who lack the visitor's own policy.
  private hash(forOthers = false): string {
    const { laboratory, learn, tour } = this.parts;
    if (tour.number > 0) return tour.address;
    if (this.view === 'learn') return learn.address;
    if (this.view === 'write') return this.write?.address ?? 'write';
    return encode(laboratory.shared(forOthers));
  }
}
