"""What ``vinl train-loco`` and ``vinl train-nav`` have in common: options, their checks, where the curves go, and one
process a device."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

import tyro

from vinl.cli.options import Settings, check_config, check_run, check_source
from vinl.config.errors import InputError
from vinl.config.limits import check_fields

if TYPE_CHECKING:
    from vinl.loco.config import LocoConfig
    from vinl.nav.config import NavConfig

    AnyConfig = TypeVar("AnyConfig", LocoConfig, NavConfig)

INTERRUPTED = 130
"""Exit code after an interrupt that saved."""

_PATIENCE = 10.0
"""Seconds that a process has to end after another one failed."""


@dataclass(frozen=True)
class TrainingOptions:
    """Options of every training."""

    overrides: Settings = ()
    """Settings of the config as key=value."""
    config: str | None = None
    """Name of a shipped config or a YAML file."""
    from_policy: Annotated[str | None, tyro.conf.arg(name="from")] = None
    """Start from the networks of this policy (a shipped name or a folder) or run; their sizes must be the config's
    (default: fresh ones, or what the config names)."""
    out: str | None = None
    """Folder of the new run (default: below runs/, by the config's name)."""
    resume: str | None = None
    """Folder of a run to go on with; its own config is used."""
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    devices: int = 1
    """GPUs of this machine to train on (on a CPU: processes)."""
    num_envs: int | None = None
    """Robots in parallel on each device (default: the config's)."""
    iterations: int | None = None
    """Updates in all (default: the config's)."""
    minutes: float | None = None
    """The training is over after so many minutes too, and what moves during it keeps to them (default: no limit)."""
    seed: int | None = None
    """Of everything random, but for the homes of navigation (default: the config's)."""
    save_every: float = 60.0
    """Seconds between checkpoints."""
    logger: Literal["tensorboard", "wandb"] = "tensorboard"
    """Who draws the curves beside the run's own metrics.jsonl: tensorboard (its files are always written), or wandb,
    which reads along."""

    def check(self) -> None:
        """Refuse numbers out of range, and what does not go together.

        Raises:
            InputError: there is such.
        """
        if self.save_every <= 0:
            raise InputError(f"--save-every must be positive, got {self.save_every}")
        check_fields(self, "--", counts=("iterations", "devices"), positive=("minutes",))
        if self.resume is not None and self.from_policy is not None:
            raise InputError("--from starts a new run and --resume goes on with an old one; give one of them")
        new = (self.config, self.out, self.num_envs, self.seed)
        if self.resume is not None and (self.overrides or any(given is not None for given in new)):
            raise InputError(
                "--resume goes on with the run's own config; only --iterations, --minutes, --device and "
                "--devices may be given"
            )

    def choose_device(self) -> str:
        """The kind of device that is trained on.

        Raises:
            InputError: there is none of it here, or there are fewer than asked for.
        """
        import torch

        from vinl.policies.device import choose_training_device

        device = choose_training_device(self.device)
        if device != "cpu" and self.devices > torch.cuda.device_count() and not is_started():
            raise InputError(f"--devices {self.devices}: there are only {torch.cuda.device_count()} CUDA devices")
        return device

    def open_run(
        self, kind: type[AnyConfig], policy: str, source: str, prefix: str = ""
    ) -> tuple[str, AnyConfig | None, int]:
        """The run's folder, its config (None: it goes on with its own), and how many robots it has on each device.

        Args:
            kind: of the config.
            policy: kind of policy that is trained.
            source: of the config of a new run.
            prefix: before the config's name in the folder's, if none is given.

        Raises:
            InputError: config, run or policy to start from are of another kind, or the folder cannot be written to.
        """
        from vinl.config.loader import load_config
        from vinl.config.output import check_out
        from vinl.rl.run_folder import RunFolder

        if self.resume is not None:
            check_run(self.resume, policy, self.iterations)
            folder, config, robots = self.resume, None, int(RunFolder(self.resume).open().get("num_envs", 0))
        else:
            check_config(source, policy)
            if self.from_policy is not None:
                check_source(self.from_policy, policy)
            short = {"num_envs": self.num_envs, "iterations": self.iterations, "seed": self.seed}
            given = [f"{name}={value}" for name, value in short.items() if value is not None]
            config = load_config(kind, source, [*self.overrides, *given])
            name = source.removesuffix(".yaml").split("/")[-1]
            folder, robots = f"runs/{prefix}{name}" if self.out is None else self.out, config.num_envs
        check_out(folder)
        return folder, config, robots

    def is_complete(self) -> bool:
        """Whether the run that is to go on has come to its end, which is told before anything is built.

        Raises:
            InputError: its configuration is broken.
        """
        from vinl.rl.run_folder import RunFolder

        return self.resume is not None and self.iterations is None and RunFolder(self.resume).is_complete()

    def tell_end(self, folder: str, complete: bool, command: str, look: str) -> int:
        """Say how a training ended and what comes next: to look at the policy, or to go on with the ``command``.

        Returns:
            The exit code.
        """
        if leads():
            more = f" --devices {self.devices}" if self.devices > 1 else ""
            print(
                f"trained: {folder}/policy  (try: vinl {look} {folder})"
                if complete
                else f"stopped and saved: go on with  vinl {command} --resume {folder}{more}"
            )
        return 0 if complete else INTERRUPTED

    def start_logger(self, folder: str) -> None:
        """Begin what the logger needs. TensorBoard's files in the run's folder are always written; Weights & Biases
        reads along.

        Raises:
            InputError: the logger is not installed.
        """
        _hush_writer()
        if self.logger == "tensorboard":
            return
        try:
            import wandb  # pyright: ignore[reportMissingImports]  (an extra of its own)
        except ModuleNotFoundError:
            raise InputError('--logger wandb: it is not installed; pip install "vinl[wandb]"') from None
        Path(folder).mkdir(parents=True, exist_ok=True)
        wandb.init(project="vinl", name=Path(folder).name, dir=folder, sync_tensorboard=True)


def _hush_writer() -> None:
    """A thread writes TensorBoard's files. What stops it, such as a full disk, is raised at the next figure too and
    told in one line: the thread need not print a traceback of its own."""
    before = threading.excepthook

    def tell(what: threading.ExceptHookArgs) -> None:
        if not isinstance(what.exc_value, OSError):
            before(what)

    threading.excepthook = tell


def is_started() -> bool:
    """Whether this is one of the processes of a training, which ``start_processes`` or torchrun started."""
    return "RANK" in os.environ


def leads() -> bool:
    """Whether this process speaks for the training: its first, or its only one."""
    return int(os.environ.get("RANK", "0")) == 0


def start_processes(count: int, command: str, argv: list[str]) -> int:
    """This very command in several processes, as torchrun would start them; returns the exit code of the training."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    common = {**os.environ, "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port, "WORLD_SIZE": str(count)}
    line = [sys.executable, "-m", "vinl.cli.app", command, *argv]
    processes = [
        subprocess.Popen(line, env={**common, "RANK": str(rank), "LOCAL_RANK": str(rank)}) for rank in range(count)
    ]
    try:
        return _wait_for_all(processes)
    finally:
        for process in processes:
            if process.poll() is None:
                process.terminate()
        for process in processes:
            try:
                process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:  # it waits on its GPU for one that is gone, and hears no signal
                process.kill()


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
