import type { World } from '../world';
import { Asker, rowOf } from './asker';
import type { Refusal } from './asker';

/// Lets a visitor's controller turn the motor of the pendulum on the stage. The pendulum waits for
/// each torque, so that it moves as in a score, however long an answer takes.
export class Live {
  private readonly world: World;
  private readonly asker: Asker;
  private readonly onAnswer: () => void;
  private asked: number[] | null = null;
  private known = false; // whether the motor has the torque for `asked`

  constructor(
    world: World,
    port: MessagePort,
    onAnswer: () => void,
    onRefusal: (refusal: Refusal) => void,
  ) {
    this.world = world;
    this.asker = new Asker(port, onRefusal);
    this.onAnswer = onAnswer;
  }

  /// Whether the pendulum can move on. Asks for the torque if it is due.
  ready(): boolean {
    const { world, asked } = this;
    if (!world.isAtControl || world.agentOn) return true;
    if (asked && !this.known) return false; // one question at a time
    const now = rowOf(world);
    if (asked?.every((number, i) => number === now[i])) return true;
    this.asked = now;
    this.known = false;
    void this.asker.ask(Float64Array.from(now)).then(([torque]) => {
      world.byHand = torque!;
      this.known = true;
      this.onAnswer();
    });
    return false;
  }

  close(): void {
    this.asker.close();
    this.world.byHand = 0;
  }
}
