"""Two processes of one training, for all tests of trainings on several devices.

A module of its own: the processes import it by its name.
"""

import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
import torch.multiprocessing as mp

from vinl.rl.parallel import Peers, join_peers


def run_two(work: Callable[[Peers], Any], folder: Path) -> tuple[Any, Any]:
    """What a function gives in each of two processes that have joined on the CPU."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    mp.spawn(_run, (work, port, str(folder)), nprocs=2)
    first, second = (torch.load(folder / f"{rank}.pt", weights_only=True) for rank in (0, 1))
    return first, second


def _run(rank: int, work: Callable[[Peers], Any], port: int, folder: str) -> None:
    os.environ.update(
        WORLD_SIZE="2", RANK=str(rank), LOCAL_RANK=str(rank), MASTER_ADDR="127.0.0.1", MASTER_PORT=str(port)
    )
    peers, device = join_peers("cpu")
    assert device == "cpu" and peers.rank == rank and peers.leads == (rank == 0)
    torch.save(work(peers), f"{folder}/{rank}.pt")
    peers.close()
