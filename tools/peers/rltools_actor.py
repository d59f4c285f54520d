#!/usr/bin/env python3
"""Trains RLtools' SAC or PPO on Pendulum-v1 once and prints the result as one JSON line.

  build/rltools-venv/bin/python tools/peers/rltools_actor.py ppo --seed 3

First compiles RLtools' headers with g++ and OpenBLAS, as its own Python package does. Then learns to the last step and evaluates the mean action over 100 episodes.
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

HERE = Path(__file__).resolve().parent
PROGRAMS = actors.ROOT / "build/rltools"
FLAGS = ["-std=c++17", "-O3", "-march=native", "-ffast-math"]  # same as in RLtools' Python package
VECTORS = os.environ.get("UPSWING_VECTORS", "")  # instructions of both libraries; empty: the best
AVX2_FLAGS = ["-mno-avx512f"]
AVX2_CORE = {"OPENBLAS_CORETYPE": "Haswell"}


def numbers(what):
    """The definitions PEER_… for the sources."""
    names = ["LEARNING_RATE", "REPLAY", "SAC_GAMMA", "TAU", "ALPHA", "LEARNING_STARTS", "ENVS",
             "HORIZON", "EPOCHS", "PPO_GAMMA", "LAMBDA", "CLIP", "INITIAL_STD", "EPISODES", "WIDTH"]
    return {name: getattr(actors, name) for name in names} | {"BATCH": actors.BATCH[what]}


def command(what):
    """The g++ command without the name of the program."""
    headers = distribution("rltools").locate_file("rltools/external/rl_tools/include")
    blas = scipy_openblas32.get_lib_dir()
    # This build of OpenBLAS adds a prefix to function names.
    defined = {"RL_TOOLS_DISABLE_TENSORBOARD": 1, "RL_TOOLS_BACKEND_ENABLE_OPENBLAS": 1,
               "RL_TOOLS_DISABLE_UNALIGNED_MEMORY_ALLOCATIONS": 1,
               "cblas_sgemm": "scipy_cblas_sgemm", "cblas_dgemm": "scipy_cblas_dgemm"}
    defined |= {f"PEER_{name}": value for name, value in numbers(what).items()}
    only = AVX2_FLAGS if VECTORS == "avx2" else []
    return ["g++", *FLAGS, *only, *(f"-D{name}={value}" for name, value in defined.items()),
            f"-isystem{headers}", HERE / f"rltools_{what}.cc", f"-L{blas}", "-lscipy_openblas",
            f"-Wl,-rpath,{blas}"]


def compiled(what):
    """The path of the program, which is compiled if it is missing."""
    words = command(what)
    sources = [HERE / "rltools_training.h", HERE / f"rltools_{what}.cc"]
    key = "\n".join([*map(str, words), *(path.read_text(encoding="utf-8") for path in sources)])
    program = PROGRAMS / f"{what}-{hashlib.sha256(key.encode()).hexdigest()[:16]}"
    if not program.is_file():
        PROGRAMS.mkdir(parents=True, exist_ok=True)
        unfinished = program.with_suffix(f".{os.getpid()}")
        actors.run([*words, "-o", unfinished])
        unfinished.rename(program)
    return program


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("measure", choices=["sac", "ppo"], help="algorithm")
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    a = parser.parse_args()
    try:
        program = compiled(a.measure)
        only = AVX2_CORE if VECTORS == "avx2" else {}
        output = actors.run([program, a.seed, actors.unclocked_steps(a.measure), actors.STEPS[a.measure]],
                            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | only)
    except actors.Failed as failed:
        sys.exit(f"rltools_actor: {failed}")
    versions = f"RLtools {version('rltools')}, OpenBLAS {version('scipy-openblas32')}"
    print(json.dumps(json.loads(output) | {"version": versions}))


if __name__ == "__main__":
    main()
