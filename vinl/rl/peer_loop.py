"""The training loop in several processes: the first one writes the run, all stop together."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import torch

from vinl.rl.loop import TrainingLoop
from vinl.rl.parallel import Peers
from vinl.rl.run_folder import RunFolder, write_text

_PROFILED = 6


class PeerLoop(TrainingLoop):
    """``TrainingLoop`` for the processes of one training.

    Args:
        peers: of this training.
        arguments: as for ``TrainingLoop``; ``folder`` is what ``peer_folder`` returns.
        profile: write where the time of one iteration goes to ``profile.txt`` in the folder.
    """

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

    def describe_policy(self) -> dict[str, float]:
        """Mean standard deviation of the actions."""
        return {"action_std": float(self.alg.get_policy().output_std.detach().mean())}

    def _roll_out(self, observation: Any) -> Any:
        self._take_profile()
        observation = super()._roll_out(observation)
        self._agreed = self.peers.any(self._asked, self.device)
        if str(self.device).startswith("cuda"):  # one wait an iteration: the curves tell roll-out from update
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
    """Where a process that is not the first keeps what only it knows: its robots. It lies inside the run.

    Args:
        run: folder of the run.
        rank: of the process.
    """

    def __init__(self, run: RunFolder, rank: int) -> None:
        super().__init__(Path(run.path) / f"rank{rank}")
        self._run = run

    def append_metrics(self, row: dict[str, float]) -> None:
        """The first process writes the curves."""

    def cut_metrics(self, iteration: int) -> None:
        """The first process writes the curves."""

    def save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Robots, their memory, and random numbers."""
        self.path.mkdir(parents=True, exist_ok=True)
        super().save_checkpoint(checkpoint)

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
        algorithm = {**checkpoint["algorithm"], **{k: own["algorithm"][k] for k in ("memory", "fresh")}}
        return {**checkpoint, "algorithm": algorithm, "environment": own["environment"], "random": own["random"]}


def peer_folder(run: RunFolder, peers: Peers) -> RunFolder:
    """The folder that a process writes to."""
    return run if peers.leads else FollowerFolder(run, peers.rank)
