#!/usr/bin/env python3
"""Trains an agent and logs metrics and evaluations to Weights & Biases.

    WANDB_MODE=offline ./upswing python examples/python/log_wandb.py
"""

import upswing
import wandb

with wandb.init(project="upswing", config={"agent": "fast", "seed": 1}) as run:
    training = upswing.train(
        **run.config,
        on_metrics=lambda row: run.log({f"train/{k}": v for k, v in row.items()}, step=row["step"]),
        on_evaluation=lambda row: run.log({f"eval/{k}": v for k, v in row.items()}, step=row["step"]))
    training.best.save("policy.safetensors")
    run.log_artifact("policy.safetensors", type="model")
