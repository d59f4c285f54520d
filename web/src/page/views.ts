import { recall, remember } from './storage';

/// The page has four views: the guided tour, an agent that learns, a controller to write, and
/// everything.

const KEY = 'view';

export interface View {
  name: 'tour' | 'learn' | 'write' | 'everything';
  step: number; // step of the tour
  chosen: boolean; // named by the address, so that the next visit begins there
}

/// The view of an address: everything if it has settings. Without settings it is the view chosen
/// last, and for a new visitor the tour.
export function viewOf(hash: string): View {
  const fields = new URLSearchParams(hash.replace(/^#/, ''));
  const step = fields.get('tour');
  if (step !== null) return { name: 'tour', step: Number(step), chosen: true };
  for (const name of ['learn', 'write'] as const) {
    if (fields.has(name)) return { name, step: 1, chosen: false };
  }
  const everything = fields.size > 0 || recall(KEY) === 'everything';
  const name = everything ? 'everything' : 'tour';
  return { name, step: 1, chosen: fields.has('everything') };
}

export function showView({ name, chosen }: View): void {
  const { documentElement: root } = document;
  // Both have a panel at the side of the stage.
  root.dataset.view = name === 'write' ? 'learn' : name;
  root.toggleAttribute('data-write', name === 'write');
  if (chosen) remember(KEY, name);
  for (const link of document.querySelectorAll('header nav a')) {
    const shown = name === 'write' ? 'everything' : name; // a part of the laboratory
    link.ariaCurrent = link.getAttribute('href') === `#${shown}` ? 'page' : null;
  }
}
