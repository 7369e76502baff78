"""``vinl train-loco``: train a locomotor."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace

from vinl.cli.options import parse_options, settings_first
from vinl.cli.training import INTERRUPTED, TrainingOptions
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options(TrainingOptions):
    """Train a locomotion policy in MJX, with PPO or, in stage 3, from a teacher. The run's folder holds checkpoint,
    curves and, at any time, the policy.

    Ctrl-C saves and stops; --resume goes on. Any setting of the config can be given as key=value, for example
    ppo.epochs=3 or commands.forward='[0, 1]'.
    """

    config: str | None = None
    """Name of a shipped config or a YAML file; default: the stage's own."""
    stage: int = 1
    """1: walk on rough ground. 2: step over blocks, to footholds that are chosen on a map. 3: the same with a depth
    camera in place of the map; learns from a policy of stage 2."""


STAGES = {1: "loco/rough", 2: "loco/teacher", 3: "loco/student"}


def main(argv: list[str]) -> int:
    """Run the command; returns 130 after an interrupt, 1 where numbers were not finite."""
    options = parse_options(Options, settings_first(Options, argv), "train-loco")
    if options.stage not in STAGES:
        raise InputError(f"--stage {options.stage} does not exist; choose {', '.join(map(str, STAGES))}")
    options.check()
    from vinl.policies.device import choose_training_device

    device = choose_training_device(options.device)
    os.environ.setdefault("JAX_PLATFORMS", "cpu" if device == "cpu" else "cuda,cpu")

    from vinl.rl.machine import use_compile_cache

    use_compile_cache()
    from vinl.loco.config import LocoConfig
    from vinl.rl.machine import explain_out_of_memory
    from vinl.rl.nan_guard import NotFiniteError

    source = options.config or STAGES[options.stage]
    folder, config, num_envs = options.open_run(LocoConfig, "locomotion", source)
    if config is not None:
        if options.stage not in (1, config.stage):
            raise InputError(f"--stage {options.stage}: {source} is a config of stage {config.stage}")
        config = replace(config, from_policy=options.from_policy or config.from_policy)
    from rich.console import Console

    with Console(stderr=True).status("loading JAX and the simulator"):  # some seconds; says nothing where it is piped
        from vinl.loco.training import train_locomotor

    options.start_logger(folder)
    try:
        limits = {"iterations": options.iterations, "minutes": options.minutes}
        with explain_out_of_memory(num_envs):
            complete = train_locomotor(config, folder, device, save_every=options.save_every, **limits)
    except NotFiniteError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    if complete:
        print(f"trained: {folder}/policy  (try: vinl eval --loco {folder})")
        return 0
    print(f"stopped and saved: go on with  vinl train-loco --resume {folder}")
    return INTERRUPTED
