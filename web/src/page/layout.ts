import { element } from './dom';
import { prefersStill } from './motion';

const SECONDS_TO_TRY = 12; // until an example shows its result

/// Room for three columns; the same width as in style/page.css.
const wide = matchMedia('(min-width: 75em)');

/// Keeps the Q-values on one screen with the pendulum: as the first chart of a column next to it,
/// or below it. Outside of Everything the map is the background of the stage.
export function placeCharts(): void {
  const { view } = document.documentElement.dataset;
  const [charts, beside] = [element('charts'), element('beside')];
  const q = element('q-figure');
  const map = element('map-figure');
  const place = wide.matches && view === 'everything' ? charts : beside;
  if (q.parentElement !== place) {
    if (place === beside) element('neuron-figure').after(q);
    else place.prepend(q);
  }
  if (view !== 'everything') beside.append(map);
  else if (map.parentElement === beside) element('phase-figure').before(map);
  const [grown, question] = [element('learn-figure'), element('lesson-question')];
  const editor = element('reward-details');
  if (view === 'tour') {
    element('learn-now').append(grown);
    element('learn-ask').append(question);
    element('step-reward').append(editor);
  } else {
    element('learn-view').prepend(grown);
    element('lesson').append(question);
    element('learn-words-meaning').after(editor);
  }
}
wide.addEventListener('change', placeCharts);

/// Folds the charts where they are not next to the pendulum.
export function foldCharts(): void {
  element<HTMLDetailsElement>('more-charts').open = wide.matches;
}

/// Opens the explanations of reward, DQN, Double and Dueling, and scrolls to them.
export function explain(): void {
  const about = element<HTMLDetailsElement>('q-about');
  const parts = [...about.querySelectorAll('details')].slice(0, 4); // before the actors
  for (const details of [about, ...parts]) details.open = true;
  about.scrollIntoView({ block: 'start' });
}

/// Lets the keyboard focus and scroll a formula that is wider than its place.
export function focusWideFormulas(): void {
  const observer = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      if (target.scrollWidth > target.clientWidth) target.setAttribute('tabindex', '0');
      else target.removeAttribute('tabindex');
    }
  });
  for (const formula of document.querySelectorAll('math[display]')) observer.observe(formula);
}

/// Links to examples lead back to the pendulum. `again`: called for the example that is open
/// already.
export function listenToExamples(again: () => void): void {
  element('try').addEventListener('click', (event) => {
    const link = (event.target as HTMLElement).closest<HTMLAnchorElement>('a[href^="#"]');
    if (!link) return;
    showStage();
    setTimeout(() => (link.dataset.tried = ''), 1000 * SECONDS_TO_TRY);
    if (link.hash === location.hash) again();
  });
}

function showStage(): void {
  const stage = element('stage');
  stage.focus({ preventScroll: true });
  stage.scrollIntoView({ block: 'start', behavior: prefersStill() ? 'instant' : 'smooth' });
}

/// Keeps the pendulum in sight while a slider is dragged: it moves to the end of the screen where the
/// slider is not.
export function keepStageInSight(): void {
  const stage = element('stage');
  const cell = element('stage-cell');
  const root = document.documentElement;
  const ends = ['pointerup', 'pointercancel'] as const;
  const drop = () => {
    delete root.dataset.dragged;
    cell.style.minHeight = '';
    for (const end of ends) removeEventListener(end, drop);
  };
  element('plant-settings')
    .closest('aside')!
    .addEventListener('pointerdown', ({ target }) => {
      if (!(target instanceof HTMLInputElement) || target.type !== 'range') return;
      const { top, bottom } = stage.getBoundingClientRect();
      const isInSight = bottom - Math.max(top, 0) > innerHeight * 0.3;
      if (isInSight) return;
      cell.style.minHeight = `${cell.offsetHeight}px`; // the page keeps its length
      const isBelow = target.getBoundingClientRect().top > innerHeight / 2;
      root.dataset.dragged = isBelow ? 'below' : 'above';
      for (const end of ends) addEventListener(end, drop);
    });
}
