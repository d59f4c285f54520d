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
  else if (map.parentElement !== charts) element('phase-figure').before(map);
  const grown = element('learn-figure');
  if (view === 'tour') element('step-learn').append(grown);
  else element('learn-view').prepend(grown);
}
wide.addEventListener('change', placeCharts);

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
