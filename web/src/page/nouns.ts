import type { Scene } from '../view/scene';

/// A noun of the text, <b class="noun" data-thing="link1">, lights its thing on the stage while a
/// mouse is over it, or from a tap until the next one. `changed`: called after another thing is
/// lit, or none.
export function lightNouns(scene: Scene, changed: () => void): void {
  const light = ({ target }: Event) => {
    const noun = target instanceof Element && target.closest<HTMLElement>('.noun');
    const thing = (noun && noun.dataset.thing) || null;
    if (thing === scene.lit) return;
    scene.lit = thing;
    changed();
  };
  addEventListener('pointerdown', light);
  addEventListener('pointerover', (event) => {
    if (event.pointerType === 'mouse') light(event);
  });
}
