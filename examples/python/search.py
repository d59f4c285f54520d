#!/usr/bin/env python3
"""Searches settings of an agent with Optuna, in several processes on one journal file.

    ./upswing python examples/python/search.py --trials 30 --processes 2

A trial trains three seeds. Its score is the mean time to solve in thousands of steps; a run that is
not solved counts as twice its steps. Trials report after each evaluation, and Optuna stops bad ones. The
same command continues the search, on any machine that shares the file. `--show` prints the results.
"""

import argparse
import multiprocessing

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

import upswing

SEEDS = (1, 2, 3)


def worth(trial, agent, steps):
    """The objective that Optuna minimises."""
    settings = {
        "learning_rate": trial.suggest_float("learning_rate", 3e-4, 1e-2, log=True),
        "gamma": 1 - trial.suggest_float("one_minus_gamma", 5e-3, 5e-2, log=True),
        "n_step": trial.suggest_int("n_step", 1, 5),
        "random_start_share": trial.suggest_float("random_start_share", 0, 1, step=0.1),
    }
    total = 0.0
    for number, seed in enumerate(SEEDS):

        def report(row, number=number):
            at = number * steps + row["step"]
            trial.report(-row["mean_return"], at)
            if trial.should_prune():
                raise optuna.TrialPruned

        training = upswing.train(agent, seed=seed, steps=steps, threads=1, progress=False,
                                 on_evaluation=report, **settings)
        total += training.solved_step if training.solved else 2 * steps
    return total / len(SEEDS) / 1000


def study_of(a):
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    storage = JournalStorage(JournalFileBackend(a.journal))
    return optuna.create_study(
        study_name=f"upswing-{a.agent}", storage=storage, load_if_exists=True,
        sampler=optuna.samplers.TPESampler(seed=None),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=5))


def search(a):
    """Runs one process of the search."""
    study_of(a).optimize(lambda trial: worth(trial, a.agent, a.steps),
                         n_trials=-(-a.trials // a.processes))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--journal", default="search.log", help="journal file (default search.log)")
    parser.add_argument("--agent", default="fast", help="named agent (default fast)")
    parser.add_argument("--steps", type=int, default=200_000, help="budget of each training (default 200,000)")
    parser.add_argument("--trials", type=int, default=20, help="number of new trials (default 20)")
    parser.add_argument("--processes", type=int, default=2,
                        help="number of processes (default 2)")
    parser.add_argument("--show", action="store_true", help="print the results and exit")
    a = parser.parse_args()
    if not a.show:
        # Spawned, not forked: a forked process lacks its parent's threads.
        context = multiprocessing.get_context("spawn")
        processes = [context.Process(target=search, args=(a,)) for _ in range(a.processes)]
        for process in processes:
            process.start()
        for process in processes:
            process.join()
        if any(process.exitcode != 0 for process in processes):
            raise SystemExit("search: a process failed (see above)")
    study = study_of(a)
    states = [trial.state.name for trial in study.trials]
    print(f"{len(states)} trials: {states.count('COMPLETE')} complete, "
          f"{states.count('PRUNED')} stopped early")
    if states.count("COMPLETE") > 0:
        print(f"best: {study.best_value:,.0f} thousand steps to solve, in the mean of "
              f"{len(SEEDS)} seeds")
        for name, value in study.best_params.items():
            print(f"  {name} = {value:.4g}")


if __name__ == "__main__":
    main()
