"""What ``vinl train-loco`` and ``vinl train-nav`` have in common: options, their checks, and where the curves go."""

from __future__ import annotations

import threading
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
        check_fields(self, "--", counts=("iterations",), positive=("minutes",))
        if self.resume and self.from_policy:
            raise InputError("--from starts a new run and --resume goes on with an old one; give one of them")
        if self.resume and (self.overrides or self.config or self.out or self.num_envs or self.seed):
            raise InputError(
                "--resume goes on with the run's own config; only --iterations, --minutes and --device may be given"
            )

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

        if self.resume:
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
            folder, robots = self.out or f"runs/{prefix}{name}", config.num_envs
        check_out(folder)
        return folder, config, robots

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
