import type { GoalName, Parameter, Plant, State } from '../pendulum';
import type { Label } from '../view/labels';
import type { Moment, World } from '../world';
import { prefersStill } from './motion';
import { OWN } from './share';
import type { Shared } from './share';
import type { Slider } from './sliders';

/// What a step of the tour is, and what it can use of the page.

/// The parts of the page that steps use.
export interface Stage {
  readonly world: World;
  /// Sets agent and settings; all others get their initial values. The pendulum moves on. False if
  /// a later request replaced this one.
  take(shared: Partial<Shared>): Promise<boolean>;
  /// The same as take(), and hangs the pendulum.
  begin(shared: Partial<Shared>): Promise<boolean>;
  /// Changes only the agent. False if it cannot be loaded or a later request replaced it.
  choose(agent: string): Promise<boolean>;
  readonly agents: {
    has(id: string): boolean;
    /// Whether the visitor's own agent was learned in this page.
    readonly ownIsLearned: boolean;
    /// The part of an address with which that agent learns again; empty if it is unknown.
    readonly ownRecipe: string;
  };
  setAgentOn(on: boolean): void;
  setSpeed(speed: number): void;
  setPlant(plant: Plant): void;
  setGoal(name: GoalName): void;
  /// A slider of the pendulum. Each call makes another one; all show the same value.
  plantSlider(name: Parameter | 'size', id: string): Slider;
  /// Hangs the pendulum.
  reset(): void;
  /// Sets the map's first quantity.
  resetMap(): void;
  readonly learn: {
    start(): void;
    /// Starts, pauses or resumes the training.
    toggle(): void;
    show(): void;
    readonly running: boolean;
    readonly paused: boolean;
    readonly story: { readonly count: string; readonly milestone: string };
    readonly keeps: boolean;
    readonly begun: boolean;
    /// Whether there is an update to ask about.
    readonly asks: boolean;
    /// Trains an agent with another reward, next to the visitor's own training.
    tryReward(reward: string): void;
    /// Ends that training, and goes back to the visitor's own one.
    endTry(): void;
  };
}

export interface Step {
  readonly id: string; // its element is "step-ID"
  readonly agents: readonly string[]; // needed for this step; without them it is left out
  readonly keys?: readonly string[]; // the page's keys that it names; all others do nothing
  readonly labels?: (world: World) => Label[]; // on the stage
  /// Whether it shows the visitor's own agent, once there is one.
  readonly yours?: boolean;
  /// Called when the step is shown. `ghost`: a try in the address; empty: none.
  begin(ghost: string): Promise<void>;
  /// Called when another step is shown.
  end?(): void;
  /// Whether its pendulum moves at once. With reduced motion it waits for a button.
  readonly moves?: boolean;
  /// A pendulum to draw behind the first one.
  readonly ghost?: () => State | null;
  /// The try in the page's address; empty: none.
  readonly code?: () => string;
  /// Called at each control step.
  moment?(moment: Moment): void;
  /// Called after a click on the map started the pendulum somewhere.
  started?(): void;
  /// The answer to the visitor's actions, asked for ten times a second; empty: none.
  answer?(world: World): string;
}

export const NOMINAL_AGENT = 'd3qn';
/// The first screen's agent. Its file is a twentieth of the default agent's.
export const SMALL_AGENT = 'fast';
export const ADAPTIVE_AGENT = 'd3qn-adaptive';
export const ANY_POSE_AGENT = 'any-pose';
export const ARROWS = ['ArrowLeft', 'ArrowRight'];
export const GOAL: Label = { at: 'goal', text: 'both links in here' };

export const heldFor = (world: World) => world.uprightFor ?? 0;

/// The agent of a step about the visitor's own agent: that one, or else the large one.
export function yoursOf({ agents }: Stage): string {
  return agents.ownIsLearned ? OWN : NOMINAL_AGENT;
}

/// Swings at once; with reduced motion the pendulum hangs and waits.
export function enter(stage: Stage, shared: Partial<Shared>): Promise<boolean> {
  return prefersStill() ? stage.begin({ ...shared, on: false }) : stage.take(shared);
}
