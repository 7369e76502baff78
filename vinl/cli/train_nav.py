"""``vinl train-nav``: train a navigator."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from dataclasses import dataclass

from vinl.cli.options import parse_options, settings_first
from vinl.cli.training import INTERRUPTED, TrainingOptions
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


def main(argv: list[str]) -> int:
    """Run the command; returns 130 after an interrupt."""
    options = parse_options(Options, settings_first(Options, argv), "train-nav")
    options.check()
    if options.devices < 1:
        raise InputError(f"--devices must be at least 1, got {options.devices}")
    if options.memory is not None and options.memory <= 0:
        raise InputError(f"--memory must be positive, got {options.memory}")
    device = _choose_device(options)

    from vinl.cli.options import check_config
    from vinl.nav.config import NavConfig
    from vinl.rl.machine import explain_out_of_memory

    source = options.config or "default"
    check_config(source, "navigation")
    if not source.startswith("nav/") and not source.endswith((".yaml", ".yml")):  # bare names are those of configs/nav
        source = f"nav/{source}"
    folder, config, num_envs = options.open_run(NavConfig, "navigation", source, "nav-")
    if options.devices > 1 and "RANK" not in os.environ:
        return _start_processes(options.devices, argv)
    from vinl.nav.training import train_navigator

    if int(os.environ.get("RANK", "0")) == 0:
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
    if int(os.environ.get("RANK", "0")) == 0:
        print(
            f"trained: {folder}/policy  (try: vinl eval-nav --policy {folder} --out {folder}/eval)"
            if complete
            else f"stopped and saved: go on with  vinl train-nav --resume {folder}"
        )
    return 0 if complete else INTERRUPTED


def _choose_device(options: Options) -> str:
    import torch

    from vinl.policies.device import choose_training_device

    device = choose_training_device(options.device)
    if device != "cpu" and options.devices > torch.cuda.device_count():
        raise InputError(f"--devices {options.devices}: there are only {torch.cuda.device_count()} CUDA devices")
    return device


def _start_processes(count: int, argv: list[str]) -> int:
    """This very command in several processes, as torchrun would start them."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    common = {**os.environ, "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port, "WORLD_SIZE": str(count)}
    command = [sys.executable, "-m", "vinl.cli.app", "train-nav", *argv]
    processes = [
        subprocess.Popen(command, env={**common, "RANK": str(rank), "LOCAL_RANK": str(rank)}) for rank in range(count)
    ]
    try:
        return _wait_for_all(processes)
    finally:
        for process in processes:
            if process.poll() is None:
                process.terminate()


def _wait_for_all(processes: list[subprocess.Popen[bytes]]) -> int:
    """The first exit code that is not 0, once all have ended or one has failed."""
    while True:
        try:
            codes = [process.poll() for process in processes]
            failed = [code for code in codes if code not in (None, 0, INTERRUPTED)]
            if failed:
                return failed[0] if failed[0] > 0 else 1
            if None not in codes:
                return max(code or 0 for code in codes)
            time.sleep(0.2)
        except KeyboardInterrupt:  # the processes were interrupted too: they save and end
            continue
