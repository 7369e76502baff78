"""Data-parallel training: one process a device, gradients averaged. Started by torchrun or ``--devices``."""

from __future__ import annotations

import os
from collections.abc import Iterable

import torch
import torch.distributed as dist
from torch import Tensor, nn


class Peers:
    """The processes of one training; a single one needs no communication.

    Attributes:
        rank: number of this process.
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
