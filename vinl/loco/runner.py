"""The training loop around rsl-rl's algorithms."""

from __future__ import annotations

import contextlib
import copy
import io
from collections.abc import Callable
from typing import Any

import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner

from vinl.rl.loop import Figures
from vinl.rl.parallel import PeerLoop, Peers
from vinl.rl.run_folder import RunFolder


class TrainingRunner(PeerLoop, OnPolicyRunner):
    """rsl-rl's runner, which builds models and algorithm, with our loop.

    Args:
        peers, env: as for ``PeerLoop``.
        settings: rsl-rl's configuration; a copy is used, because rsl-rl changes its own.
        rest: as for ``PeerLoop``.
    """

    waits = False

    def __init__(
        self,
        peers: Peers,
        env: VecEnv,
        settings: dict[str, Any],
        folder: RunFolder,
        device: str,
        export: Callable[[Any, int], None],
        figures: Figures,
        schedule: Callable[[Any, float], None],
        save_every: float = 60.0,
    ) -> None:
        with contextlib.redirect_stdout(io.StringIO()):  # rsl-rl prints its models
            OnPolicyRunner.__init__(self, env, copy.deepcopy(settings), None, device)
        steps = settings["num_steps_per_env"]
        PeerLoop.__init__(self, peers, env, self.alg, steps, folder, device, export, figures, schedule, save_every)

    def start_from(self, actor: dict[str, torch.Tensor], critic: dict[str, torch.Tensor] | None) -> None:
        """Take over trained weights; what they leave out, such as the actions' spread, stays as it was made.

        Args:
            actor: weights under the names of the actor model.
            critic: under the names of the critic; None: it stays fresh.
        """
        self.alg.load(
            {"actor_state_dict": actor, "critic_state_dict": critic},
            {"actor": True, "critic": critic is not None},
            False,
        )

    def _configure_multi_gpu(self) -> None:
        """rsl-rl's own way to several GPUs, which a CPU does not have, is not used."""
        self.cfg["multi_gpu"] = None
        self.is_distributed, self.gpu_world_size, self.gpu_local_rank, self.gpu_global_rank = False, 1, 0, 0
