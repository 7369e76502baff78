"""Thousands of homes on one device: which they are, where they come from, and how fresh ones take their places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import torch

from vinl.config.errors import InputError
from vinl.nav.config import NavConfig
from vinl.nav.home_builder import BuiltHome, HomeRecord, prepare_home
from vinl.nav.home_memory import HomeMemory
from vinl.nav.home_stream import HomeStream, build_plans, count_workers
from vinl.sensing.depth import check_device
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import check_file, expand_paths

_TRIES = 50
"""So many homes dropped for each one kept, and the configuration is refused."""

_SPARE_ROOM = 1.3
"""A fresh home takes the place of one up to this much larger."""


class HomeStore:
    """Homes on a device, each in a slot of its own size; a slot can take another home while robots run.

    Args:
        built: at least one home, all with as many goals and starts.
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:1"``.
        dropped: how many homes were dropped on the way here, because no path led through them.
        tree: how Warp builds the ray trees of the meshes: ``"sah"`` (on the host), ``"lbvh"`` (on a GPU); Warp
            chooses by default.

    Attributes:
        records: of the home in every slot.
        homes: the grids on the device, for the kernels.
        blocks: the clutter on the device.
        device: torch device.
        dropped: homes without a path so far; they are never used.
        reasons: why those were dropped that were there when the store was built.
        replaced: homes that took another's place so far.
        skipped: fresh homes that found no slot of their size.

    Raises:
        InputError: there is no home, or no such device.
    """

    def __init__(
        self, built: Sequence[BuiltHome], device: str | torch.device = "cpu", dropped: int = 0, tree: str | None = None
    ) -> None:
        if not built:
            raise InputError("the navigation environment needs at least one home")
        self._memory = HomeMemory(built, check_device(device), tree)
        self.device, self.homes, self.blocks = self._memory.device, self._memory.homes, self._memory.blocks
        self.records = [_record(home) for home in built]
        self.dropped, self.replaced, self.skipped = dropped, 0, 0
        self.reasons: list[str] = []
        self._age = np.arange(len(built))
        self._stream: HomeStream | None = None
        self._due, self._pace = 0.0, 0.0

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
            config: of the environment.
            device: for the homes.
            progress: called with the homes built so far and how many there will be.
            tree: as for the class.

        Raises:
            InputError: hardly any home has a path of the length asked for.
        """
        device = check_device(device)  # before minutes of building
        for plan in expand_paths(config.homes.plans):
            check_file(plan)
        wanted = config.homes.count
        workers = count_workers(config, wanted)
        stream = HomeStream(config, config.homes.seed, workers)
        built: list[BuiltHome] = []
        reasons: list[str] = []
        try:
            while len(built) < wanted:
                home = stream.next()
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
            store = cls(built, device, len(reasons), tree)
            store.reasons = reasons
        except BaseException:
            stream.close()
            raise
        if config.homes.fresh > 0:
            store._stream, store._pace = stream, config.homes.fresh * wanted / 1000
        else:
            stream.close()
        return store

    @classmethod
    def from_plans(
        cls, plans: Iterable[FloorPlan], config: NavConfig, device: str | torch.device = "cpu", copies: int = 1
    ) -> HomeStore:
        """Given floor plans, each with ``config.homes.goals`` goals.

        Args:
            plans: on grids of 5 cm.
            config: of the environment; its generator is not used.
            device: for the homes.
            copies: times that every plan is there, each with other goals.

        Raises:
            InputError: none of the plans can be used; the message says why not.
        """
        homes = (
            prepare_home(plan, config.homes.seed + k * copies + copy, config)
            for k, plan in enumerate(plans)
            for copy in range(copies)
        )
        return cls._of(homes, device)

    @classmethod
    def from_paths(
        cls,
        paths: Sequence[str],
        config: NavConfig,
        device: str | torch.device = "cpu",
        copies: int = 1,
        progress: Callable[[int, int], None] | None = None,
    ) -> HomeStore:
        """Floor plans' files and ranges of plans in them, read and built by several processes where there are many.

        A plan that cannot be used is dropped and counted; ``reasons`` says why.

        Args:
            paths: see ``vinl.world.readers.expand_paths``.
            config: of the environment; its generator is not used.
            device: for the homes.
            copies: times that every plan is there, each with other goals.
            progress: called with the plans read so far and how many there are.

        Raises:
            InputError: a file is missing, or none of the plans can be used; the message says why not.
        """
        plans = expand_paths(paths)
        for plan in plans:
            check_file(plan)

        def count() -> Iterator[BuiltHome | str]:
            for done, home in enumerate(build_plans(plans, config, copies), 1):
                if progress is not None:
                    progress(done, len(plans) * copies)
                yield home

        return cls._of(count(), device)

    @classmethod
    def _of(cls, homes: Iterable[BuiltHome | str], device: str | torch.device) -> HomeStore:
        built: list[BuiltHome] = []
        reasons: list[str] = []
        for home in homes:
            if isinstance(home, str):
                reasons.append(home)
            else:
                built.append(home)
        if not built:
            raise InputError("no floor plan can be used" + (f"; the last: {reasons[-1]}" if reasons else ""))
        store = cls(built, device, len(reasons))
        store.reasons = reasons
        return store

    def __len__(self) -> int:
        """How many homes there are."""
        return len(self.records)

    @property
    def memory_bytes(self) -> int:
        """Device memory of all homes but their meshes' ray trees."""
        return self._memory.count_bytes()

    def refresh(self) -> int:
        """Put fresh homes, as far as they are due and ready, in the place of old ones; call it once a step.

        The host never waits. The slot's generation grows by one, by which the environment knows the robots that were
        there.

        Returns:
            How many homes were replaced.
        """
        if self._stream is None:
            return 0
        self._due = min(self._due + self._pace, float(len(self)))
        count = 0
        if self._due >= 1:
            for home in self._stream.take_ready():
                if isinstance(home, str):
                    self.dropped += 1
                    continue
                if self.replace(home):
                    count += 1
                    self._due -= 1
                if self._due < 1:
                    break
        return count

    def replace(self, home: BuiltHome) -> bool:
        """Put a home in the place of the oldest one whose slot is as large or a little larger.

        Returns:
            False if there is no such slot; the home is then counted in ``skipped``.
        """
        capacity = self._memory.capacity
        fitting = (capacity >= home.cells) & (capacity <= _SPARE_ROOM * home.cells)
        if not fitting.any():
            self.skipped += 1
            return False
        slot = int(np.where(fitting, self._age, np.iinfo(np.int64).max).argmin())
        self._age[slot] = self._age.max() + 1
        self.records[slot] = _record(home)
        self._memory.replace(slot, home)
        self.replaced += 1
        return True

    def generations(self) -> torch.Tensor:
        """(homes,) int32 on the device: how many homes were in each slot before."""
        return self._memory.generations()

    def save_state(self) -> dict[str, Any]:
        """Which homes are here, by their seeds."""
        return {"seeds": [record.seed for record in self.records], "names": [record.name for record in self.records]}

    def holds(self, state: dict[str, Any]) -> bool:
        """Whether the homes are those of a saved state."""
        return self.save_state() == state

    def close(self) -> None:
        """End the processes that build fresh homes."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None


def _record(home: BuiltHome) -> HomeRecord:
    return HomeRecord(home.seed, home.name, home.frame, home.floor, home.solid, home.blocks)
