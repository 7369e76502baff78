"""Data-parallel training: one process a device, gradients averaged; the first one writes the run, all stop together.
Started by torchrun or --devices."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import torch
import torch.distributed as dist
from torch import Tensor, nn

from vinl.config.output import write_text
from vinl.rl.loop import TrainingLoop
from vinl.rl.run_folder import CHECKPOINT, RunFolder


class Peers:
    """The processes of one training; a single one needs no communication.

    Attributes:
        count: how many there are.
    """

    def __init__(self, rank: int = 0, count: int = 1) -> None:
        self.rank, self.count = rank, count

    @property
    def leads(self) -> bool:
        """Whether this process writes the run's files."""
        return self.rank == 0

    def average(self, *values: Tensor) -> None:
        """Replace tensors by their means over the processes."""
        if self.count > 1:
            for value in values:
                dist.all_reduce(value)
                value /= self.count

    def average_gradients(self, parameters: Iterable[nn.Parameter]) -> None:
        """Replace all gradients by their means over the processes, in one message."""
        if self.count == 1:
            return
        gradients = [p.grad for p in parameters if p.grad is not None]
        flat = torch.cat([g.flatten() for g in gradients])
        self.average(flat)
        torch._foreach_copy_(  # type: ignore[attr-defined]
            gradients,
            [part.view_as(g) for part, g in zip(flat.split([g.numel() for g in gradients]), gradients, strict=True)],
        )

    def share(self, module: nn.Module) -> None:
        """Give every process the weights of the first."""
        if self.count > 1:
            for weight in module.state_dict().values():
                dist.broadcast(weight, 0)

    def any(self, flag: bool, device: torch.device | str = "cpu") -> bool:
        """Whether the flag is set in any process."""
        if self.count == 1:
            return flag
        value = torch.tensor(float(flag), device=device)
        dist.all_reduce(value)
        return bool(value > 0)

    def first(self, number: float, device: torch.device | str = "cpu") -> float:
        """The number that the first process gave."""
        if self.count == 1:
            return number
        value = torch.tensor(number, dtype=torch.float64, device=device)
        dist.broadcast(value, 0)
        return float(value)

    def close(self) -> None:
        """The end of the training."""
        if self.count > 1 and dist.is_initialized():
            dist.destroy_process_group()


def join_peers(device: str) -> tuple[Peers, str]:
    """The processes that torchrun started, and the device of this one: its own GPU where the device is ``"cuda"``."""
    count = int(os.environ.get("WORLD_SIZE", "1"))
    if count == 1:
        return Peers(), device
    rank, local = int(os.environ["RANK"]), int(os.environ["LOCAL_RANK"])
    on_gpu = device.startswith("cuda")
    if on_gpu:
        torch.cuda.set_device(local)
        device = f"cuda:{local}"
    if not dist.is_initialized():
        dist.init_process_group("nccl" if on_gpu else "gloo", rank=rank, world_size=count)
    return Peers(rank, count), device


_PROFILED = 6


class PeerLoop(TrainingLoop):
    """``TrainingLoop`` for the processes of one training.

    Args:
        arguments: as for ``TrainingLoop``; ``folder`` is what ``peer_folder`` returns.
        profile: write where the time of one iteration goes to ``profile.txt`` in the folder.

    Attributes:
        waits: whether a GPU is waited for once an iteration, so that the curves tell roll-out from update.
    """

    waits = True

    def __init__(self, peers: Peers, *arguments: Any, profile: bool = False, **rest: Any) -> None:
        self.peers, self._asked, self._agreed = peers, False, False
        self._profile, self._profiler, self._rounds = profile and peers.leads, None, 0
        super().__init__(*arguments, **rest)

    @property
    def _stop(self) -> bool:
        """Whether to stop; processes that stopped at different iterations would wait for each other for ever."""
        return self._asked if self.peers.count == 1 else self._agreed

    @_stop.setter
    def _stop(self, asked: bool) -> None:
        self._asked = asked

    def resume(self) -> bool:
        """Take up the checkpoint; the first process's weights count."""
        found = super().resume()
        self.peers.share(self.alg.get_policy())
        return found

    def train(self, iterations: int, minutes: float | None = None) -> bool:
        """See ``TrainingLoop.train``; only the first process shows its progress."""
        if self.peers.leads:
            return super().train(iterations, minutes)
        with contextlib.redirect_stderr(io.StringIO()):
            return super().train(iterations, minutes)

    def _fraction_done(self, iterations: int, begun: float, minutes: float | None) -> float:
        """The first process's clock counts: all must end after the same iteration, with the same settings."""
        fraction = super()._fraction_done(iterations, begun, minutes)
        return fraction if minutes is None else self.peers.first(fraction, self.device)

    @property
    def samples_per_iteration(self) -> int:
        """Robot steps between updates, of the robots of all processes."""
        return super().samples_per_iteration * self.peers.count

    def describe_policy(self) -> dict[str, float]:
        """Mean standard deviation of the actions."""
        return {"action_std": float(self.alg.get_policy().output_std.detach().mean())}

    def _judge(self, measures: dict[str, float], iteration: int) -> str | None:
        """Where the robots of one process went wrong, all end."""
        wrong = super()._judge(measures, iteration)
        if self.peers.any(wrong is not None, self.device):
            return wrong or f"too many robots of another process were not finite in iteration {iteration}"
        return None

    def _roll_out(self, observation: Any) -> Any:
        self._take_profile()
        observation = super()._roll_out(observation)
        self._agreed = self.peers.any(self._asked, self.device)
        if self.waits and str(self.device).startswith("cuda"):
            torch.cuda.synchronize()
        return observation

    def _take_profile(self) -> None:
        """Profile the round ``_PROFILED``, roll-out and update; compiling and setting up are over by then."""
        if self._profiler is not None:
            self._profiler.stop()
            on_gpu = str(self.device).startswith("cuda")
            key = "self_device_time_total" if on_gpu else "self_cpu_time_total"
            table = self._profiler.key_averages().table(sort_by=key, row_limit=40, max_name_column_width=70)
            write_text(self.folder.path / "profile.txt", table)
            self._profiler, self._profile = None, False
        self._rounds += 1
        if self._profile and self._rounds == _PROFILED:
            self._profiler = torch.profiler.profile()
            self._profiler.start()


class FollowerFolder(RunFolder):
    """Where a process that is not the first keeps what only it knows: its robots. It lies inside the run."""

    def __init__(self, run: RunFolder, rank: int) -> None:
        super().__init__(Path(run.path) / f"rank{rank}")
        self._run = run

    def append_metrics(self, row: dict[str, float]) -> None:
        """The first process writes the curves."""

    def cut_metrics(self, iteration: int) -> None:
        """The first process writes the curves."""

    def save_lost(self, state: dict[str, Any]) -> Path | None:
        """See ``RunFolder``; all processes save to the run itself."""
        return self._run.save_lost(state)

    def load_checkpoint(self) -> dict[str, Any] | None:
        """The run's checkpoint with this process's own robots; without any they begin anew.

        Raises:
            InputError: a file is broken.
        """
        checkpoint = self._run.load_checkpoint()
        if checkpoint is None:
            return None
        own = super().load_checkpoint()
        if own is None:
            return {**checkpoint, "environment": None, "random": {"cpu": torch.get_rng_state()}}
        of_robots = {k: own["algorithm"][k] for k in ("memory", "fresh") if k in own["algorithm"]}
        algorithm = {**checkpoint["algorithm"], **of_robots}
        return {**checkpoint, "algorithm": algorithm, "environment": own["environment"], "random": own["random"]}


def peer_folder(run: RunFolder, peers: Peers) -> RunFolder:
    """The folder that a process writes to."""
    return run if peers.leads else FollowerFolder(run, peers.rank)


def count_processes(run: RunFolder) -> int:
    """How many processes have trained a run so far, by their folders; 0 before its first checkpoint."""
    return 1 + len(list(run.path.glob("rank*/"))) if (run.path / CHECKPOINT).exists() else 0
