#!/usr/bin/env python3
"""Trains RLtools' SAC or PPO on Pendulum-v1 once and prints the result as one JSON line.

  build/rltools-venv/bin/python tools/peers/rltools_actor.py sac --width 256 --batch 256
  build/rltools-venv/bin/python tools/peers/rltools_actor.py ppo --seed 3

First compiles RLtools' headers with g++ and OpenBLAS, as its own Python package does, once for each
network and minibatch. Then learns to the last step and evaluates the mean action over 100 episodes.
The clock leaves out the first steps (`unclocked_steps` in actors.py).
"""

import argparse
import hashlib
import json
import os
import sys
from importlib.metadata import distribution, version
from pathlib import Path

import scipy_openblas32

import actors
import ours

HERE = Path(__file__).resolve().parent
PROGRAMS = ours.ROOT / "build/rltools"
FLAGS = ["-std=c++17", "-O3", "-march=native", "-ffast-math"]  # same as in RLtools' Python package


def numbers(width, batch):
    """The definitions PEER_… for the sources."""
    names = ["LEARNING_RATE", "REPLAY", "SAC_GAMMA", "TAU", "ALPHA", "LEARNING_STARTS", "ENVS",
             "HORIZON", "EPOCHS", "LAMBDA", "CLIP", "INITIAL_STD"]
    return {name: getattr(actors, name) for name in names} | {
        "PPO_GAMMA": actors.TASKS["pendulum-v1"]["ppo_gamma"], "EPISODES": ours.EPISODES,
        "WIDTH": width, "BATCH": batch}


def command(what, width, batch):
    """The g++ command without the name of the program."""
    headers = distribution("rltools").locate_file("rltools/external/rl_tools/include")
    blas = scipy_openblas32.get_lib_dir()
    # This build of OpenBLAS adds a prefix to function names.
    defined = {"RL_TOOLS_DISABLE_TENSORBOARD": 1, "RL_TOOLS_BACKEND_ENABLE_OPENBLAS": 1,
               "RL_TOOLS_DISABLE_UNALIGNED_MEMORY_ALLOCATIONS": 1,
               "cblas_sgemm": "scipy_cblas_sgemm", "cblas_dgemm": "scipy_cblas_dgemm"}
    defined |= {f"PEER_{name}": value for name, value in numbers(width, batch).items()}
    return ["g++", *FLAGS, *(f"-D{name}={value}" for name, value in defined.items()),
            f"-isystem{headers}", HERE / f"rltools_{what}.cc", f"-L{blas}", "-lscipy_openblas",
            f"-Wl,-rpath,{blas}"]


def compiled(what, width, batch):
    """The path of the program, which is compiled if it is missing."""
    words = command(what, width, batch)
    sources = [HERE / "rltools_training.h", HERE / f"rltools_{what}.cc"]
    key = "\n".join([*map(str, words), *(path.read_text(encoding="utf-8") for path in sources)])
    program = PROGRAMS / f"{what}-{hashlib.sha256(key.encode()).hexdigest()[:16]}"
    if not program.is_file():
        PROGRAMS.mkdir(parents=True, exist_ok=True)
        unfinished = program.with_suffix(f".{os.getpid()}")
        ours.run([*words, "-o", unfinished])
        unfinished.rename(program)
    return program


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("measure", choices=["sac", "ppo"], help="algorithm")
    parser.add_argument("--task", choices=["pendulum-v1"], default="pendulum-v1",
                        help="task to learn (default pendulum-v1)")
    parser.add_argument("--width", type=int, help="width of both hidden layers (default 64)")
    parser.add_argument("--batch", type=int, help="transitions per minibatch (default sac 100, ppo 256)")
    parser.add_argument("--threads", type=int, choices=[1], default=1, help="number of threads (default 1)")
    parser.add_argument("--steps", type=int,
                        help="steps of the training (default sac 20000, ppo 300000)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    a = parser.parse_args()
    for name, value in actors.DEFAULTS[a.measure].items():
        if getattr(a, name) is None:
            setattr(a, name, value)
    try:
        steps = actors.all_steps(a.measure, a.steps)
        program = compiled(a.measure, a.width, a.batch)
        output = ours.run([program, a.seed, actors.unclocked_steps(a.measure), steps],
                          env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
    except ours.Failed as failed:
        sys.exit(f"rltools_actor: {failed}")
    versions = f"RLtools {version('rltools')}, OpenBLAS {version('scipy-openblas32')}"
    print(json.dumps(json.loads(output) | {"version": versions}))


if __name__ == "__main__":
    main()
