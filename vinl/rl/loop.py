"""The training loop of every learner: curves, checkpoints, an interrupt that saves."""

from __future__ import annotations

import contextlib
import math
import signal
import time
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Any, Protocol, runtime_checkable

import torch
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column
from torch.utils.tensorboard import SummaryWriter

from vinl.config.errors import InputError
from vinl.rl.nan_guard import NotFiniteError, is_finite, judge_losses
from vinl.rl.run_folder import RunFolder
from vinl.rl.stopwatch import Stopwatch

_LINE_EVERY = 60.0
"""Seconds between lines when the output is no terminal."""

_SHOWN = 3
"""Figures in the bar: what fits into 80 columns."""

_FIRST = "compiling: a minute or two"


class TrainingProgress:
    """Shows iterations done, the time left and the first three figures; before the first iteration, that programs are
    compiled.

    Args:
        total: iterations of the whole run, or its seconds.
        unit: what is counted.
    """

    def __init__(self, total: int, done: int = 0, console: Console | None = None, unit: str = "iteration") -> None:
        self.console = console or Console(stderr=True)
        self._bar = Progress(
            TextColumn(unit + " {task.completed}/{task.total}", table_column=Column(no_wrap=True)),
            BarColumn(bar_width=4),
            TimeRemainingColumn(compact=True, table_column=Column(no_wrap=True)),
            TextColumn("left"),
            TextColumn("{task.fields[figures]}", table_column=Column(no_wrap=True, overflow="ellipsis")),
            console=self.console,
            disable=not self.console.is_terminal,
        )
        self._task = self._bar.add_task("", total=total, completed=done, figures=_FIRST)
        self._total, self._last, self._unit = total, -_LINE_EVERY, unit

    def __enter__(self) -> TrainingProgress:
        self._bar.start()
        if not self.console.is_terminal:
            self.console.print(_FIRST, highlight=False, soft_wrap=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def show(self, iteration: int, figures: dict[str, str]) -> None:
        """Move on to ``iteration`` (or second)."""
        text = "  ".join(f"{name} {value}" for name, value in figures.items())
        shown = "  ".join(
            f"{value}/s" if name == "samples/s" else f"{name} {value}" for name, value in list(figures.items())[:_SHOWN]
        )
        self._bar.update(self._task, completed=iteration, figures=shown)
        now = time.monotonic()
        if not self.console.is_terminal and (now - self._last >= _LINE_EVERY or iteration == self._total):
            self._last = now
            self.console.print(f"{self._unit} {iteration}/{self._total}  {text}", highlight=False, soft_wrap=True)


Figures = Callable[[dict[str, float]], dict[str, str]]


@runtime_checkable
class Algorithm(Protocol):
    """A learner with the names of rsl-rl's algorithms; ``update`` gives the losses by name, ``get_policy`` what is
    exported, and ``load`` takes back what ``save`` gave."""

    learning_rate: float

    def train_mode(self) -> None: ...
    def act(self, obs: Any) -> torch.Tensor: ...
    def process_env_step(self, obs: Any, rewards: Any, dones: Any, extras: Any) -> None: ...
    def compute_returns(self, obs: Any) -> None: ...
    def update(self) -> dict[str, float]: ...
    def get_policy(self) -> Any: ...
    def save(self) -> dict[str, Any]: ...
    def load(self, loaded_dict: dict[str, Any], load_cfg: dict | None, strict: bool) -> Any: ...


class TrainingLoop:
    """Roll out, learn, write down, again; nothing waits for the device inside a roll-out.

    Args:
        env: rsl-rl's ``VecEnv``, with ``read_measures`` (means since the last call), ``save_state`` and ``load_state``.
        algorithm: the learner.
        steps: control steps of each robot between updates.
        export: called after every checkpoint with the policy and the samples so far; writes the policy.
        figures: picks what the progress bar shows from an iteration's measures.
        schedule: called before every iteration with the algorithm and the fraction of the training that is done.
        save_every: seconds between checkpoints.
        stopwatch: whose parts go into the curves where it ran.
    """

    def __init__(
        self,
        env: Any,
        algorithm: Algorithm,
        steps: int,
        folder: RunFolder,
        device: str,
        export: Callable[[Any, int], None],
        figures: Figures,
        schedule: Callable[[Any, float], None],
        save_every: float = 60.0,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        self.env, self.alg, self.device, self.steps = env, algorithm, device, steps
        self.folder, self.export, self.figures = folder, export, figures
        self.schedule, self.save_every, self._stopwatch = schedule, save_every, stopwatch
        self.current_learning_iteration, self.samples = 0, 0
        self._stop = False

    @property
    def samples_per_iteration(self) -> int:
        """Robot steps between updates, of all robots that are learned from."""
        return self.steps * self.env.num_envs

    def describe_policy(self) -> dict[str, float]:
        """Figures of the policy for the curves."""
        return {}

    def resume(self) -> bool:
        """Take up the folder's checkpoint, if there is one.

        Raises:
            InputError: the checkpoint is broken or of another network.
        """
        checkpoint = self.folder.load_checkpoint()
        if checkpoint is None:
            self.folder.cut_metrics(-1)
            return False
        try:
            self.alg.load(checkpoint["algorithm"], None, True)
            if checkpoint["environment"] is not None:
                self.env.load_state(checkpoint["environment"])
            self.current_learning_iteration, self.samples = checkpoint["iteration"], checkpoint["samples"]
            _set_random_state(checkpoint["random"])
        except (KeyError, RuntimeError, ValueError) as error:
            raise InputError(
                f"{self.folder.path}: the checkpoint does not fit this run ({str(error).splitlines()[0]})"
            ) from None
        self.folder.cut_metrics(self.current_learning_iteration)
        return True

    def checkpoint(self) -> None:
        """Write the checkpoint and the policy."""
        random = _random_state()
        self.folder.save_checkpoint(
            {
                "algorithm": self.alg.save(),
                "environment": self.env.save_state(),
                "iteration": self.current_learning_iteration,
                "samples": self.samples,
                "random": random,
            }
        )
        self.export(self.alg.get_policy(), self.samples)
        # networks that are built to be written draw weights, and when a run saves is up to the clock
        _set_random_state(random)

    def train(self, iterations: int, minutes: float | None = None) -> bool:
        """Go on until ``iterations`` are done in all, time is up or an interrupt asks to stop; all of them save.

        Args:
            minutes: from now on, after which the training is over too; settings then move with whichever is further.

        Returns:
            Whether the training is over.

        Raises:
            NotFiniteError: more than one robot step in a thousand of an iteration was not finite. The checkpoint is
                written before, unless the policy itself is not finite.
        """
        wrong, sound = None, True
        first = self.current_learning_iteration
        writer = SummaryWriter(str(self.folder.path / "tensorboard"), purge_step=first)
        observation = self.env.get_observations().to(self.device)
        self.alg.train_mode()
        saved = begun = time.monotonic()
        bar = (
            TrainingProgress(iterations, first)
            if minutes is None
            else TrainingProgress(round(60 * minutes), unit="second")
        )
        with bar as progress, self._interruptible(progress):
            while (
                (fraction := self._fraction_done(iterations, begun, minutes)) < 1 and not self._stop and wrong is None
            ):
                start = time.perf_counter()
                self.schedule(self.alg, fraction)
                observation = self._roll_out(observation)
                collected = time.perf_counter()
                losses = self._learn()
                sound = all(map(math.isfinite, losses.values()))
                self.current_learning_iteration += 1
                self.samples += self.samples_per_iteration
                measures = self.env.read_measures()
                end = time.perf_counter()
                row = {
                    "iteration": self.current_learning_iteration,
                    "samples": self.samples,
                    "samples_per_second": self.samples_per_iteration / (end - start),
                    "update_seconds": end - collected,
                    "seconds": end - start,
                    "learning_rate": self.alg.learning_rate,
                    **self.describe_policy(),
                    **{f"loss/{name}": value for name, value in losses.items()},
                    **measures,
                    **({f"seconds/{k}": v for k, v in self._stopwatch.read().items()} if self._stopwatch else {}),
                }
                self.folder.append_metrics(
                    {k: float(f"{v:.6g}") if isinstance(v, float) else v for k, v in row.items()}
                )
                for name, value in row.items():
                    writer.add_scalar(name if "/" in name else f"train/{name}", value, self.current_learning_iteration)
                count = self.current_learning_iteration
                if minutes is None:
                    progress.show(count, self.figures(row))
                else:
                    progress.show(round(time.monotonic() - begun), {"iteration": f"{count}", **self.figures(row)})
                wrong = self._judge(measures, count)
                if wrong is None and sound and time.monotonic() - saved > self.save_every:
                    self.checkpoint()
                    saved = time.monotonic()
            kept = (wrong is None and sound) or is_finite(self.alg.get_policy())
            if kept:
                self.checkpoint()
        writer.close()
        if wrong is not None:
            raise NotFiniteError(wrong if kept else f"{wrong}; the policy is not finite either: the checkpoint is old")
        return fraction >= 1

    def _fraction_done(self, iterations: int, begun: float, minutes: float | None) -> float:
        """Of iterations or of the time since ``begun``, whichever is more."""
        fraction = self.current_learning_iteration / iterations
        return fraction if minutes is None else max(fraction, (time.monotonic() - begun) / (60 * minutes))

    def _roll_out(self, observation: Any) -> Any:
        with torch.inference_mode():
            for _ in range(self.steps):
                actions = self.alg.act(observation)
                observation, rewards, dones, extras = self.env.step(actions)
                self.alg.process_env_step(observation, rewards, dones, extras)
            self.alg.compute_returns(observation)
        return observation

    def _learn(self) -> dict[str, float]:
        """The losses of an update. One that breaks down over numbers that are not finite says so."""
        try:
            return {name: float(value) for name, value in self.alg.update().items()}
        except (RuntimeError, ValueError) as error:
            # of this process alone: another one may be anywhere
            wrong = TrainingLoop._judge(self, self.env.read_measures(), self.current_learning_iteration + 1)
            if wrong is None:
                raise
            raise NotFiniteError(f"{wrong}; the policy is not finite either: the checkpoint is old") from error

    def _judge(self, measures: dict[str, float], iteration: int) -> str | None:
        """Why the training must end after an iteration, see ``judge_losses``."""
        return judge_losses(self.env, measures, self.steps * self.env.num_envs, iteration, self.folder)

    @contextlib.contextmanager
    def _interruptible(self, progress: TrainingProgress) -> Iterator[None]:
        """The first Ctrl-C (or SIGTERM) ends the loop after the iteration; a second Ctrl-C ends it at once."""

        def ask(number: int, frame: FrameType | None) -> None:
            if self._stop:
                raise KeyboardInterrupt
            self._stop = True
            progress.console.print("stopping after this iteration and saving (Ctrl-C again stops at once)")

        numbers = (signal.SIGINT, signal.SIGTERM)
        try:
            before = {number: signal.signal(number, ask) for number in numbers}
        except ValueError:  # not in the main thread: the caller handles interrupts
            before = {}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def _random_state() -> dict[str, torch.Tensor]:
    state = {"cpu": torch.get_rng_state()}
    if torch.cuda.is_available():
        state["cuda"] = torch.cuda.get_rng_state()
    return state


def _set_random_state(state: dict[str, torch.Tensor]) -> None:
    torch.set_rng_state(state["cpu"])
    if "cuda" in state and torch.cuda.is_available():
        torch.cuda.set_rng_state(state["cuda"])
