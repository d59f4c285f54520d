import type { GoalName } from '../pendulum';
import type { World } from '../world';
import { element } from './dom';

/// Buttons for the pose to reach, while a policy for any pose is on the stage.
export class GoalButtons {
  private readonly place = element<HTMLFieldSetElement>('goals');
  private readonly buttons = [...this.place.querySelectorAll('button')];

  constructor(choose: (name: GoalName) => void) {
    for (const button of this.buttons) {
      button.addEventListener('click', () => choose(button.value as GoalName));
    }
  }

  /// Call at each frame.
  follow({ goal, target, twin }: World): void {
    const shown = target ?? twin?.target ?? null;
    if (this.place.hidden === (shown !== null)) this.place.hidden = shown === null;
    for (const button of this.buttons) {
      const pressed = String(button.value === goal.name);
      if (button.ariaPressed !== pressed) button.ariaPressed = pressed;
    }
  }
}
