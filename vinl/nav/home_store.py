"""Thousands of homes on one device: grids for the kernels, meshes for the camera; built by several processes."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import closing
from itertools import count, repeat
from typing import Any

import numpy as np
import torch
import warp as wp

from vinl.config.errors import InputError
from vinl.nav.config import NavConfig
from vinl.nav.home_builder import BuiltHome, HomeRecord, build_home, build_plan, prepare_home
from vinl.nav.home_grids import Homes
from vinl.sensing.depth import build_mesh, check_device
from vinl.sensing.torch_warp import find_stream
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import check_file, expand_paths

_TRIES = 50
"""So many homes dropped for each one kept, and the configuration is refused."""

_FEW = 24
"""So few homes are built sooner in place than processes start."""


class HomeStore:
    """Homes on a device, one after another.

    Args:
        built: at least one home, all with as many goals and starts.
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:1"``.
        reasons: why others were dropped on the way here.
        tree: how Warp builds the ray trees of the meshes: ``"sah"`` (on the host), ``"lbvh"`` (on a GPU); Warp
            chooses by default.

    Raises:
        InputError: there is no home, or no such device; the homes are too large together, or differ in their number of
            goals or starts.
    """

    def __init__(
        self,
        built: Sequence[BuiltHome],
        device: str | torch.device = "cpu",
        reasons: Sequence[str] = (),
        tree: str | None = None,
    ) -> None:
        if not built:
            raise InputError("no home can be used" + (f"; the last: {reasons[-1]}" if reasons else ""))
        self.device, self.reasons = check_device(device), list(reasons)
        self.records = [HomeRecord(h.seed, h.name, h.frame, h.floor, h.solid, h.blocks) for h in built]
        with wp.ScopedStream(find_stream(self.device)):  # in order with torch's work, which reads the meshes
            self._meshes = [build_mesh(home.vertices, home.faces, str(self.device), tree) for home in built]
        count, ends = len(built), np.cumsum([home.cells for home in built])
        cells, first = int(ends[-1]), np.concatenate([[0], ends[:-1]]).astype(np.int32)
        if cells * 4 >= 2**31:
            raise InputError(f"{count} homes have {cells} cells together; a store holds up to {2**29}: use fewer homes")
        shapes = {(home.goals.shape, home.starts.shape) for home in built}
        if len(shapes) > 1:
            raise InputError("all homes of a store need as many goals and starts")

        def put(values: list[Any], kind: type) -> torch.Tensor:
            return torch.as_tensor(np.array(values, kind), device=self.device)

        self._tensors = {
            "first": put(list(first), np.int32),
            "shape": put([home.fields.shape[:2] for home in built], np.int32),
            "origin": put([home.origin for home in built], np.float32),
            "clearance": torch.empty(4 * cells, dtype=torch.float16, device=self.device),
            "fields": torch.empty(cells, len(built[0].goals), dtype=torch.float16, device=self.device),
            "goals": put([home.goals for home in built], np.float32),
            "starts": put([home.starts for home in built], np.float32),
            "meshes": put([mesh.id for mesh in self._meshes], np.int64),
        }
        for begin, end, home in zip(first, ends, built, strict=True):
            self._tensors["fields"][begin:end] = torch.from_numpy(home.fields).flatten(0, 1)
            self._tensors["clearance"][4 * begin : 4 * end] = torch.from_numpy(home.clearance).flatten()
        self.homes = Homes()
        for name, tensor in self._tensors.items():
            setattr(self.homes, name, wp.from_torch(tensor, dtype=Homes.vars[name].type.dtype))

    @classmethod
    def build(
        cls,
        config: NavConfig,
        device: str | torch.device = "cpu",
        progress: Callable[[int, int], None] | None = None,
        tree: str | None = None,
    ) -> HomeStore:
        """The homes that a configuration asks for, built by several processes.

        Args:
            progress: called with the homes built so far and how many there will be.

        Raises:
            InputError: hardly any home has a path of the length asked for.
        """
        device = check_device(device)  # before minutes of building
        for plan in expand_paths(config.homes.plans):
            check_file(plan)
        wanted, built, reasons = config.homes.count, list[BuiltHome](), list[str]()
        with closing(_stream_homes(config, _count_workers(config, wanted))) as stream:
            for home in stream:
                if isinstance(home, str):
                    reasons.append(home)
                    if len(reasons) > _TRIES * (len(built) + 1):
                        raise InputError(
                            f"{len(reasons)} homes were dropped for {len(built)} that can be used; the last: {home}"
                        )
                    continue
                built.append(home)
                if progress is not None:
                    progress(len(built), wanted)
                if len(built) == wanted:
                    break
        return cls(built, device, reasons, tree)

    @classmethod
    def from_plans(cls, plans: Iterable[FloorPlan], config: NavConfig, device: str | torch.device = "cpu") -> HomeStore:
        """Given floor plans, each with ``config.homes.goals`` goals.

        Args:
            plans: on grids of 5 cm.
            config: of the environment; its generator is not used.

        Raises:
            InputError: none of the plans can be used; the message says why not.
        """
        return cls._of((prepare_home(plan, config.homes.seed + k, config) for k, plan in enumerate(plans)), device)

    @classmethod
    def from_paths(
        cls,
        paths: Sequence[str],
        config: NavConfig,
        device: str | torch.device = "cpu",
        progress: Callable[[int, int], None] | None = None,
    ) -> HomeStore:
        """Floor plans' files and ranges of plans in them, read and built by several processes where there are many.

        A plan that cannot be used is dropped and counted; ``reasons`` says why.

        Args:
            paths: see ``vinl.world.readers.expand_paths``.
            config: of the environment; its generator is not used.
            progress: called with the plans read so far and how many there are.

        Raises:
            InputError: a file is missing, or none of the plans can be used; the message says why not.
        """
        plans = expand_paths(paths)
        for plan in plans:
            check_file(plan)

        def show() -> Iterator[BuiltHome | str]:
            for done, home in enumerate(_build_plans(plans, config), 1):
                if progress is not None:
                    progress(done, len(plans))
                yield home

        return cls._of(show(), device)

    @classmethod
    def _of(cls, homes: Iterable[BuiltHome | str], device: str | torch.device) -> HomeStore:
        found = list(homes)
        built = [home for home in found if not isinstance(home, str)]
        return cls(built, device, [home for home in found if isinstance(home, str)])

    def __len__(self) -> int:
        """How many homes there are."""
        return len(self.records)

    @property
    def memory_bytes(self) -> int:
        """Device memory of all homes but their meshes' ray trees."""
        grids = sum(tensor.nbytes for tensor in self._tensors.values())
        return grids + sum(mesh.points.capacity + mesh.indices.capacity for mesh in self._meshes)

    def save_state(self) -> dict[str, Any]:
        """Which homes are here, by their seeds."""
        return {"seeds": [record.seed for record in self.records], "names": [record.name for record in self.records]}


def _count_workers(config: NavConfig, homes: int) -> int:
    """Processes that building so many homes is worth; 0: build in place."""
    wanted = config.homes.workers
    if wanted is None:
        wanted = (os.cpu_count() or 1) - 1 if homes > _FEW else 0
    return min(wanted, homes)


def _stream_homes(config: NavConfig, workers: int) -> Generator[BuiltHome | str, None, None]:
    """The homes of a configuration in the order of their seeds, without end: each home, or why there is none."""
    if workers == 0:
        for seed in count(config.homes.seed):
            yield build_home(seed, config)
    pool = _open_pool(workers)
    try:
        waiting: deque[Future[BuiltHome | str]] = deque()
        for seed in count(config.homes.seed):
            waiting.append(pool.submit(build_home, seed, config))
            if len(waiting) == 4 * workers:
                yield waiting.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _build_plans(plans: Sequence[str], config: NavConfig) -> Iterator[BuiltHome | str]:
    """The homes of floor plans' files in their order, by several processes where there are many."""
    seeds, workers = range(config.homes.seed, config.homes.seed + len(plans)), _count_workers(config, len(plans))
    if workers == 0:
        yield from map(build_plan, plans, seeds, repeat(config))
        return
    with _open_pool(workers) as pool:
        yield from pool.map(build_plan, plans, seeds, repeat(config), chunksize=4)


def _open_pool(workers: int) -> ProcessPoolExecutor:
    # fresh processes: a fork of one that uses a GPU, or has threads, may hang
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_start_worker)


def _start_worker() -> None:
    """A worker has no use for the GPU, and leaves an interrupt to the process that started it."""
    import signal

    os.environ["CUDA_VISIBLE_DEVICES"] = ""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
