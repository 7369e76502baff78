"""Episodes walked on a Ray cluster in place of the worker processes of one machine."""

from __future__ import annotations

import contextlib
import logging
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import torch

from vinl.chain.workers import Context
from vinl.config.errors import InputError
from vinl.config.output import list_packages

T = TypeVar("T")

LOCAL = "local"
"""In place of an address: a cluster that is started on this machine, and ends with the run."""

_REACH = 5.0
"""Seconds in which the port of a cluster must answer. Ray itself tries for minutes."""


@dataclass(frozen=True)
class Cluster:
    """A cluster that this process has joined.

    Attributes:
        workers: jobs that run at a time, one CPU each.
    """

    workers: int

    def run(
        self, shared: Any, work: Callable[[Context, Any], T], jobs: list[Any], on_piece: Callable[..., None]
    ) -> list[T]:
        """All jobs, as ``WorkerPool.run`` does it; but pieces are heard of when their job has ended: Ray begins a job
        anew whose machine is lost, and nothing must count twice.

        Raises:
            InputError: a machine has other versions of what figures depend on, or what the job itself raised.
        """
        import ray
        from ray.exceptions import RayError, RayTaskError

        answers: dict[int, T] = {}
        waiting: dict[Any, int] = {}
        luggage = ray.put((shared, list_packages()))
        remote = ray.remote(num_cpus=1)(_run_job)
        left = list(enumerate(jobs))[::-1]
        while left or waiting:
            while left and len(waiting) < self.workers:
                number, job = left.pop()
                waiting[remote.remote([luggage], work, job)] = number
            (done,), _ = ray.wait(list(waiting))
            try:
                answers[waiting.pop(done)], pieces = ray.get(done)
            except RayTaskError as error:
                raise error.cause from error
            except RayError as error:
                raise InputError(
                    f"--cluster: a job was lost ({_first_line(error)}); give the same command again"
                ) from error
            for piece in pieces:
                on_piece(*piece)
        return [answers[k] for k in range(len(jobs))]


@contextlib.contextmanager
def join_cluster(address: str, workers: int | None) -> Iterator[Cluster]:
    """A Ray cluster until the end of the context.

    Args:
        address: ``host:port`` from one of its machines, ``ray://host:port`` from elsewhere, ``auto``, or ``local``.
        workers: jobs at a time; None: as many as it has CPUs.

    Raises:
        InputError: Ray is not installed, or the cluster cannot be reached.
    """
    try:
        import ray
    except ModuleNotFoundError:
        raise InputError('--cluster needs ray; install it: pip install "vinl[cluster]"') from None
    _check_port(address)
    options = {"num_cpus": workers, "include_dashboard": False} if address == LOCAL else {}
    try:
        ray.init(address, logging_level=logging.ERROR, log_to_driver=False, **options)
    except (ConnectionError, ValueError, RuntimeError, OSError) as error:
        raise InputError(f"--cluster {address} cannot be joined: {_first_line(error)}") from error
    try:
        yield Cluster(workers or max(int(ray.cluster_resources().get("CPU", 1)), 1))
    finally:
        ray.shutdown()


def _check_port(address: str) -> None:
    """Refuse an address where nobody listens."""
    if address in (LOCAL, "auto"):
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdigit() or int(port) > 65535:
        raise InputError(f"--cluster {address!r} is no address; give host:port, ray://host:port, auto or {LOCAL}")
    try:
        socket.create_connection((host, int(port)), timeout=_REACH).close()
    except OSError as error:
        raise InputError(
            f"--cluster {address} cannot be reached ({error.strerror or error}); start one with ray start "
            f"--head, or take {LOCAL}"
        ) from None


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


_opened: dict[str, Any] = {}
"""What this process has unpacked of the last run: the next job need not do it again."""


def _run_job(luggage: list[Any], work: Callable[[Context, Any], T], job: Any) -> tuple[T, list[tuple[Any, ...]]]:
    """A job in a process of the cluster: its answer, and the pieces that it reported."""
    name = luggage[0].hex()
    if name not in _opened:
        import ray

        shared, packages = ray.get(luggage[0])
        if packages != list_packages():
            raise InputError(
                f"--cluster: {socket.gethostname()} has {list_packages()}, this machine {packages}; install the same"
            )
        torch.set_num_threads(1)
        _opened.clear()
        _opened[name] = shared
    pieces: list[tuple[Any, ...]] = []
    return work(Context(_opened[name], lambda *piece: pieces.append(piece), lambda: False), job), pieces
