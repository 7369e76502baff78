"""``vinl train-loco``: train a locomotor."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from vinl.cli.imports import kept_imports
from vinl.cli.options import parse_options, settings_first
from vinl.cli.training import INTERRUPTED, TrainingOptions, is_started, leads, start_processes
from vinl.config.errors import InputError

if TYPE_CHECKING:
    from vinl.loco.config import LocoConfig


@dataclass(frozen=True)
class Options(TrainingOptions):
    """Train a locomotion policy in MJX, with PPO or, in stage 3, from a teacher. The run's folder holds checkpoint,
    curves and, at any time, the policy.

    Ctrl-C saves and stops; --resume goes on. Any setting of the config can be given as key=value, for example
    ppo.epochs=3 or commands.forward='[0, 1]'.
    """

    config: str | None = None
    """Name of a shipped config or a YAML file; default: the stage's own."""
    stage: int | None = None
    """1: walk on rough ground (default). 2: step over blocks, to footholds that are chosen on a map. 3: the same with a
    depth camera in place of the map; learns from a policy of stage 2."""
    num_envs: int | None = None
    """Robots in parallel, on all devices together (default: the config's)."""
    devices: int = 1
    """GPUs of this machine that share the robots of stage 1 or 2 (on a CPU: processes)."""

    def check(self) -> None:
        """Refuse stages that do not exist too, and one beside --resume."""
        if self.stage not in (None, *STAGES):
            raise InputError(f"--stage {self.stage} does not exist; choose {', '.join(map(str, STAGES))}")
        if self.resume is not None and self.stage is not None:
            raise InputError("--resume goes on with the run's own stage; leave --stage out")
        super().check()


STAGES = {1: "loco/rough", 2: "loco/teacher", 3: "loco/student"}


_NEXT = "train-loco", "eval --loco"
"""Commands that go on with a run, and that look at its policy."""


def main(argv: list[str]) -> int:
    """Run the command; returns 130 after an interrupt, 1 where numbers were not finite."""
    options = parse_options(Options, settings_first(Options, argv), "train-loco")
    options.check()
    if is_started():
        _see_one_gpu()
    with kept_imports():
        device = options.choose_device()
    os.environ.setdefault("JAX_PLATFORMS", "cpu" if device == "cpu" else "cuda,cpu")

    from vinl.rl.machine import use_compile_cache

    use_compile_cache()
    from vinl.loco.config import LocoConfig
    from vinl.rl.machine import explain_out_of_memory
    from vinl.rl.nan_guard import NotFiniteError

    source = options.config or STAGES[options.stage or 1]
    folder, config, num_envs = options.open_run(LocoConfig, "locomotion", source)
    if config is not None:
        if options.stage not in (None, config.stage):
            raise InputError(f"--stage {options.stage}: {source} is a config of stage {config.stage}")
        config = replace(config, from_policy=options.from_policy or config.from_policy)
    if not is_started():
        _check_devices(options.devices, folder, config)
        if options.is_complete():
            return options.tell_end(folder, True, *_NEXT)
        if options.devices > 1:
            return start_processes(options.devices, "train-loco", argv)
    from rich.console import Console

    # some seconds; says nothing where it is piped
    with Console(stderr=True, quiet=not leads()).status("loading JAX and the simulator"), kept_imports():
        from vinl.loco.training import train_locomotor

    if leads():
        options.start_logger(folder)
    try:
        limits = {"iterations": options.iterations, "minutes": options.minutes}
        with explain_out_of_memory(num_envs):
            complete = train_locomotor(config, folder, device, save_every=options.save_every, **limits)
    except NotFiniteError as error:
        if not leads():
            return INTERRUPTED  # the first process says so, and fails
        print(f"error: {error}", file=sys.stderr)
        return 1
    return options.tell_end(folder, complete, *_NEXT)


def _see_one_gpu() -> None:
    """JAX simulates on the first GPU that it sees, so each process of a training sees its own alone. To call before
    anything asks for a GPU."""
    local, seen = int(os.environ["LOCAL_RANK"]), os.environ.get("CUDA_VISIBLE_DEVICES")
    own = [str(local)] if seen is None else seen.split(",")[local : local + 1]
    os.environ.update(CUDA_VISIBLE_DEVICES=",".join(own), LOCAL_RANK="0")


def _check_devices(devices: int, folder: str, config: LocoConfig | None) -> None:
    """Refuse devices that cannot share the robots.

    Args:
        config: of a new run; None: the run in the folder goes on, with as many devices as it was saved with.

    Raises:
        InputError: they cannot.
    """
    from vinl.config.loader import build_config
    from vinl.loco.config import LocoConfig
    from vinl.rl.parallel import count_processes
    from vinl.rl.run_folder import CONFIG, RunFolder

    run = RunFolder(folder)
    resumed = build_config(LocoConfig, run.open(), source=str(run.path / CONFIG)) if config is None else config
    resumed.separate(0, devices)
    before = count_processes(run)
    if before not in (0, devices):
        raise InputError(f"--devices {devices}: {folder} was trained on {before}; give as many")
