#!/usr/bin/env python3
"""Trains an agent and logs metrics and evaluations to MLflow.

    MLFLOW_TRACKING_URI=sqlite:///mlflow.db ./upswing python examples/python/log_mlflow.py
"""

import mlflow
import upswing

with mlflow.start_run():
    mlflow.log_params(settings := {"agent": "fast", "seed": 1})
    training = upswing.train(
        **settings,
        on_metrics=lambda row: mlflow.log_metrics({f"train/{k}": v for k, v in row.items()}, row["step"]),
        on_evaluation=lambda row: mlflow.log_metrics({f"eval/{k}": v for k, v in row.items()}, row["step"]))
    training.best.save("policy.safetensors")
    mlflow.log_artifact("policy.safetensors")
