#!/bin/sh
# A worker of a study as a task of a Slurm job array. The words after the script are the worker:
#
#   sbatch --array=1-20 --time=2:00:00 examples/slurm.sh ./upswing --no-setup study --work runs/my
#
#SBATCH --array=1
#SBATCH --job-name=upswing
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:USR2@120

# Lets the worker write a checkpoint and end with 75. INT, because Slurm may send TERM to the worker as
# well, and a second TERM ends it without a checkpoint.
stop() {
  trap '' TERM USR2
  kill -INT "$worker"
  wait "$worker"
}

task=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID
"$@" &
worker=$!
# Slurm sends TERM to a task that is cancelled, or preempted and queued again by Slurm. It sends USR2
# two minutes before the time limit: the task then queues itself again.
trap 'stop; exit $?' TERM
trap 'stop; code=$?; [ $code != 75 ] || scontrol requeue "$task"; exit $code' USR2
wait "$worker"
