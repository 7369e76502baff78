"""``vinl train-nav``: train a navigator."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.cli.imports import kept_imports
from vinl.cli.options import parse_options, settings_first
from vinl.cli.training import TrainingOptions, is_started, leads, start_processes
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options(TrainingOptions):
    """Train a navigation policy with PPO in generated homes. The run's folder holds checkpoint, curves and, at any
    time, the policy.

    Ctrl-C saves and stops; --resume goes on. Any setting of the config can be given as key=value, for example
    ppo.epochs=1 or motion.amplitude=[0,1].
    """

    config: str | None = None
    """default, blind or paper (shipped configs of nav/), or a YAML file; default: default."""
    devices: int = 1
    """GPUs of this machine to train on, each with num_envs robots and homes of its own (on a CPU: processes)."""
    memory: float | None = None
    """Use at most so much memory of each GPU [GB], as on a smaller card (default: all of it). Homes are not counted."""
    profile: bool = False
    """Write where the time of the sixth iteration goes to profile.txt in the run's folder."""


_NEXT = "train-nav", "eval-nav --policy"
"""Commands that go on with a run, and that look at its policy."""


def main(argv: list[str]) -> int:
    """Run the command; returns 130 after an interrupt."""
    options = parse_options(Options, settings_first(Options, argv), "train-nav")
    options.check()
    if options.memory is not None and options.memory <= 0:
        raise InputError(f"--memory must be positive, got {options.memory}")
    with kept_imports():
        device = options.choose_device()

    from vinl.cli.options import check_config
    from vinl.nav.config import NavConfig
    from vinl.rl.machine import explain_out_of_memory

    source = options.config or "default"
    check_config(source, "navigation")
    if not source.startswith("nav/") and not source.endswith((".yaml", ".yml")):  # bare names are those of configs/nav
        source = f"nav/{source}"
    folder, config, num_envs = options.open_run(NavConfig, "navigation", source, "nav-")
    if not is_started():
        if options.is_complete():
            return options.tell_end(folder, True, *_NEXT)
        if options.devices > 1:
            return start_processes(options.devices, "train-nav", argv)
    with kept_imports():
        from vinl.nav.training import train_navigator

    if leads():
        options.start_logger(folder)
    with explain_out_of_memory(num_envs):
        complete = train_navigator(
            config,
            folder,
            device,
            save_every=options.save_every,
            iterations=options.iterations,
            minutes=options.minutes,
            from_policy=options.from_policy,
            profile=options.profile,
            memory=options.memory,
        )
    return options.tell_end(folder, complete, *_NEXT)
