"""Summarises the rounds of a comparison, and prints them as tables."""

import statistics
import textwrap

import actors
import ours

# Settings shared by all sides, for each measure.
DQN = (
    "gradient, training: DQN on the double pendulum. Plain network 8-W-W-9 with ReLU, batch of B "
    "transitions, single precision; no double, dueling or layer normalisation; one-step targets, "
    f"Huber loss (smooth L1), Adam, gradient norm clipped to {ours.MAX_GRADIENT_NORM}, discount "
    f"{ours.GAMMA}, replay memory of {ours.REPLAY:,}. In training: one environment, one update a "
    f"step from step {ours.LEARNING_STARTS} on, Polyak target at each with tau {ours.TAU}, epsilon "
    f"{ours.EPSILON}.")
SAC = (
    "sac: a step is one of the environment and one round: both critics, actor and temperature, "
    "each network with two hidden layers of W and ReLU, batch of B transitions, one-step targets, "
    f"Adam at {actors.LEARNING_RATE}, discount {actors.SAC_GAMMA}, tau {actors.TAU}, "
    f"temperature from {actors.ALPHA} towards an entropy of -1. One round for each seed.")
PPO = (
    f"ppo: a step is one of an environment with its share of learning: {actors.ENVS} environments, "
    f"rollouts of {actors.ROLLOUT:,} steps, {actors.EPOCHS} epochs, minibatch of B, actor and "
    f"critic with two hidden layers of W and ReLU, Adam at {actors.LEARNING_RATE}, discount "
    f"{actors.TASKS['pendulum-v1']['ppo_gamma']} (double pendulum: "
    f"{actors.TASKS['double-pendulum']['ppo_gamma']}), lambda {actors.LAMBDA}, clip {actors.CLIP}, "
    f"spread from {actors.INITIAL_STD:g} of the limit. One round for each seed.")
SAME = {"gradient": DQN, "training": DQN, "sac": SAC, "ppo": PPO}


def print_heading(measures, values):
    """Describes the measurements: `values` has width, batch and more of each measure."""
    for what in measures:
        if values[what]:
            chosen = ", ".join(f"{name} {value}" for name, value in values[what].items())
            print(f"{what}: {chosen}")
    for text in dict.fromkeys(SAME[what] for what in measures):
        print(textwrap.fill(text, 96))


def summarize(results, sides):
    """One row per measurement, with medians, and ratios of our rate and CPU time to theirs if we
    took part. A ratio is the median over the rounds, so that load on both sides of a round cancels
    out. The ratio of the fastest rounds estimates a machine without other load."""
    rows = []
    for (what, threads, side), rounds in results.items():
        row = {"measure": what, "threads": threads, "side": side, "rounds": rounds}
        ours = results.get((what, threads, "upswing"))
        for figure in ("steps_per_second", "cpu_seconds_per_step"):
            values = [result[figure] for result in rounds]
            row[figure] = statistics.median(values)
            row[f"{figure}_range"] = [min(values), max(values)]
            if ours and side != "upswing":
                our_values = [result[figure] for result in ours]
                row[f"{figure}_upswing_ratio"] = statistics.median(
                    mine / theirs for mine, theirs in zip(our_values, values, strict=True))
                if figure == "steps_per_second":
                    row["fastest_upswing_ratio"] = max(our_values) / max(values)
        returns = [result["mean_return"] for result in rounds if "mean_return" in result]
        if returns:
            row["mean_return"] = statistics.median(returns)
            row["mean_return_range"] = [min(returns), max(returns)]
        rows.append(row)
    return sorted(rows, key=lambda row: (row["measure"], row["threads"], sides.index(row["side"])))


def print_table(rows):
    """Prints medians, ranges and ratios."""
    line = "{:<10}{:>7}  {:<18}{:>9}{:>18}{:>10}{:>10}{:>10}{:>10}"
    print(line.format("measure", "threads", "side", "steps/s", "(range)", "CPU µs", "our rate",
                      "fastest", "our CPU"))
    print(line.format("", "", "", "", "", "a step", "/ theirs", "/ fastest", "/ theirs"))
    for row in rows:
        low, high = row["steps_per_second_range"]
        ratios = [f"{row[name]:.2f}" if name in row else "" for name in
                  ("steps_per_second_upswing_ratio", "fastest_upswing_ratio",
                   "cpu_seconds_per_step_upswing_ratio")]
        print(line.format(row["measure"], row["threads"], row["side"],
                          f"{row['steps_per_second']:,.0f}", f"({low:,.0f}-{high:,.0f})",
                          f"{1e6 * row['cpu_seconds_per_step']:,.2f}", *ratios).rstrip())


def print_returns(rows):
    """Prints the results and durations of whole trainings."""
    line = "{:<10}{:>7}  {:<18}{:>10}{:>14}  {}"
    print("\n" + line.format("measure", "threads", "side", "seconds", "mean return", "(range)"))
    for row in rows:
        seconds = statistics.median(result["seconds"] for result in row["rounds"])
        low, high = row["mean_return_range"]
        print(line.format(row["measure"], row["threads"], row["side"], f"{seconds:.1f}",
                          f"{row['mean_return']:.1f}", f"({low:.1f} to {high:.1f})"))
