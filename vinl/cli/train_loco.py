"""``vinl train-loco``: train a locomotor."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from typing import Annotated

import tyro

from vinl.cli.loggers import Logger, start_logger
from vinl.cli.options import Settings, parse_options, settings_first
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options:
    """Train a locomotor in MJX, with PPO or, in stage 3, from a teacher. The run's folder holds checkpoint, curves
    and, at any time, the policy.

    Ctrl-C saves and stops; --resume goes on. Any setting of the config can be given as key=value, for example
    ppo.epochs=3 or commands.forward='[0, 1]'.
    """

    overrides: Settings = ()
    """Settings of the config as key=value."""
    stage: int = 1
    """1: walk on rough ground. 2: step over blocks, to footholds that are chosen on a map. 3: the same with a depth
    camera in place of the map; learns from a policy of stage 2."""
    from_policy: Annotated[str | None, tyro.conf.arg(name="from")] = None
    """Start from the networks of this policy (a shipped name or a folder) or run; default: the config's."""
    config: str | None = None
    """Name of a shipped config or a YAML file; default: the stage's own."""
    out: str | None = None
    """Folder of the new run (default: runs/ and the config's name)."""
    resume: str | None = None
    """Folder of a run to go on with; its own config is used."""
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    num_envs: int | None = None
    """Robots in parallel (default: the config's, 4096)."""
    iterations: int | None = None
    """Updates in all (default: the config's)."""
    minutes: float | None = None
    """The training is over after so many minutes too, and what moves during it keeps to them (default: no limit)."""
    seed: int | None = None
    """Of everything random (default: the config's)."""
    save_every: float = 60.0
    """Seconds between checkpoints."""
    logger: Logger = "tensorboard"
    """Who draws the curves beside the run's own metrics.jsonl: tensorboard (its files are always written), or wandb,
    which reads along."""


STAGES = {1: "loco/rough", 2: "loco/teacher", 3: "loco/student"}


def main(argv: list[str]) -> int:
    """Run the command; returns 130 after an interrupt, 1 where numbers were not finite."""
    options = parse_options(Options, settings_first(Options, argv), "train-loco")
    if options.stage not in STAGES:
        raise InputError(f"--stage {options.stage} does not exist; choose {', '.join(map(str, STAGES))}")
    if options.save_every <= 0:
        raise InputError(f"--save-every must be positive, got {options.save_every}")
    if options.resume and options.from_policy:
        raise InputError("--from starts a new run and --resume goes on with an old one; give one of them")
    if options.resume and (options.overrides or options.config or options.out or options.num_envs or options.seed):
        raise InputError(
            "--resume goes on with the run's own config; only --iterations, --minutes and --device may be given"
        )
    from vinl.policies.device import choose_training_device

    device = choose_training_device(options.device)
    os.environ.setdefault("JAX_PLATFORMS", "cpu" if device == "cpu" else "cuda,cpu")

    from vinl.rl.compile_cache import use_compile_cache

    use_compile_cache()
    from vinl.cli.kinds import check_config, check_run, check_source
    from vinl.config.loader import load_config
    from vinl.config.output import check_out
    from vinl.loco.config import LocoConfig
    from vinl.rl.nan_guard import NotFiniteError
    from vinl.rl.out_of_memory import explain_out_of_memory
    from vinl.rl.run_folder import RunFolder

    if options.resume:
        folder, config = options.resume, None
        check_run(folder, "locomotion", options.iterations)
        num_envs = int(RunFolder(folder).open().get("num_envs", 0))
    else:
        source = options.config or STAGES[options.stage]
        check_config(source, "locomotion")
        short = {"num_envs": options.num_envs, "iterations": options.iterations, "seed": options.seed}
        overrides = [*options.overrides, *(f"{k}={v}" for k, v in short.items() if v is not None)]
        config = load_config(LocoConfig, source, overrides)
        num_envs = config.num_envs
        if options.from_policy is not None:
            check_source(options.from_policy, "locomotion")
            config = replace(config, from_policy=options.from_policy)
        if options.stage not in (1, config.stage):
            raise InputError(f"--stage {options.stage}: {source} is a config of stage {config.stage}")
        folder = options.out or f"runs/{source.removesuffix('.yaml').split('/')[-1]}"
    if options.minutes is not None and options.minutes <= 0:
        raise InputError(f"--minutes must be positive, got {options.minutes}")
    if options.iterations is not None and options.iterations < 1:
        raise InputError(f"--iterations must be at least 1, got {options.iterations}")
    check_out(folder)
    from vinl.loco.training import train_locomotor

    start_logger(options.logger, folder)
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
    return 130
