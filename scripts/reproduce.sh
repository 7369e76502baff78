#!/usr/bin/env bash
# Trains all policies from nothing, in order; each is one YAML file in configs/loco or configs/nav and one command.
#
#   scripts/reproduce.sh [DEVICE]     DEVICE: cuda (default) or cpu
#
# RUNS is where the runs go (default: runs). A run that is there already is gone on with; one that is complete is left.
# Beside each: samples, and the minutes that they take at the speeds that the project holds itself to on one H200
# (stages 1 and 2: 260,000 samples/s; stage 3: 70,000). Measured last: 247,000 and 287,000 on an H100, 75,700 on an H200;
# nav 114,400 on an H200; nav-blind 109,700, 211,000 on two.
set -euo pipefail
device="${1:-cuda}"
runs="${RUNS:-runs}"

train() {  # loco or nav, name, then what a new run is started with
  local command="train-$1" name="$2"; shift 2
  if [ -d "$runs/$name" ]; then
    vinl "$command" --resume "$runs/$name" --device "$device"
  else
    vinl "$command" "$@" --device "$device" --out "$runs/$name"
  fi
}

train loco rough --stage 1                                                     #  39 M   2.5 min
train loco teacher --stage 2 --from "$runs/rough"                              # 295 M  18.9 min
train loco student --stage 3 --from "$runs/teacher"                            #  15 M   3.5 min

# baselines [paper IV-B]: the same samples in each stage
train loco blind --config loco/blind --from "$runs/rough"                      # 295 M  18.9 min
train loco no_pretraining --config loco/no_pretraining                         # 295 M  18.9 min
train loco mlp --config loco/mlp --from "$runs/teacher"                        #  15 M   3.5 min

# navigation, and what it is held against
train nav nav --iterations 836                                                 # 164 M  24.0 min
train nav nav-blind --config nav/blind --iterations 1000                       #  98 M   9.0 min
