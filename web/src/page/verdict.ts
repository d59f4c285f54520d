/// The result of a race of two agents in the tour.

const WON = 5; // s upright that win a race
const LONGEST = 20; // s, of a race
export const HELD = 2; // s upright that count as balanced

/// Who balances: one of both, both, or none.
export interface Verdict {
  readonly one: boolean;
  readonly many: boolean;
}

/// The result of a race; null while it goes on. `one` and `many`: how long (s) each has been upright;
/// `raced`: duration (s). An agent that is upright now has not lost yet.
export function verdictOf(one: number, many: number, raced: number): Verdict | null {
  const [oneWins, manyWins] = [one > WON, many > WON];
  if (oneWins && manyWins) return { one: true, many: true };
  if (manyWins && one === 0) return { one: false, many: true };
  if (oneWins && many === 0) return { one: true, many: false };
  if (raced < LONGEST || (one > 0 && !oneWins) || (many > 0 && !manyWins)) return null;
  return { one: oneWins, many: manyWins };
}

export const LOST = 'You lost';

/// A verdict in words, for a bet on the agent of many pendulums, or on the other.
export function textOf({ one, many }: Verdict, onMany: boolean): string {
  if (one && many) return 'A draw: both balance it.';
  if (!one && !many) return `A draw: neither balances it within ${LONGEST} s.`;
  const result = many === onMany ? 'You were right' : LOST;
  if (one) return `${result}: only the agent that learned on one balances it.`;
  return `${result}: only the agent that learned on many balances it. It estimates the mass from the motion.`;
}

/// The change since the verdict, so that it agrees with the pendulums; empty: none.
export function laterOf(verdict: Verdict, one: number, many: number): string {
  if ((!verdict.one && one > HELD) || (!verdict.many && many > HELD)) {
    return ' Later the other one got up, too.';
  }
  return '';
}
