"""The memory of homes on one device: distance fields, clearance, goals, starts, and meshes for the camera."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
import torch
import warp as wp
from jaxtyping import Int

from vinl.config.errors import InputError
from vinl.nav.block_contact import BlockTable
from vinl.nav.grids import Homes
from vinl.nav.home_builder import BuiltHome

_KEPT = 64
"""Meshes of homes gone that are kept a while: launches that read them may not have run yet."""


class HomeMemory:
    """Homes one after another, each in a slot of its own size.

    Args:
        built: at least one home, all with as many goals and starts.
        device: torch device.
        tree: how Warp builds the ray trees of the meshes, see ``HomeStore``.

    Attributes:
        homes: the grids, for the kernels.
        blocks: the clutter.
        capacity: (slots,) cells of the distance fields that a slot has room for.
        device: torch device.

    Raises:
        InputError: the homes are too large together, or differ in their number of goals or starts.
    """

    def __init__(self, built: Sequence[BuiltHome], device: torch.device, tree: str | None) -> None:
        self.device = device
        self._warp_device, self._tree = str(self.device), tree
        self.capacity: Int[np.ndarray, " slots"] = np.array([home.cells for home in built])
        self._mesh: list[wp.Mesh] = [self._build_mesh(home) for home in built]
        self._gone: deque[wp.Mesh] = deque(maxlen=_KEPT)
        goals, starts = len(built[0].goals), len(built[0].starts)
        slots, cells = len(built), int(self.capacity.sum())
        if cells * 4 >= 2**31:
            raise InputError(f"{slots} homes have {cells} cells together; a store holds up to {2**29}: use fewer homes")
        first = np.concatenate([[0], np.cumsum(self.capacity)[:-1]])
        self._first = first
        self._tensors = {
            "first": torch.as_tensor(first.astype(np.int32), device=self.device),
            "shape": torch.zeros(slots, 2, dtype=torch.int32, device=self.device),
            "origin": torch.zeros(slots, 2, device=self.device),
            "clearance": torch.zeros(4 * cells, dtype=torch.float16, device=self.device),
            "fields": torch.full((cells, goals), float("inf"), dtype=torch.float16, device=self.device),
            "goals": torch.zeros(slots, goals, 2, device=self.device),
            "starts": torch.zeros(slots, starts, 2, device=self.device),
            "generation": torch.zeros(slots, dtype=torch.int32, device=self.device),
            "meshes": torch.as_tensor(np.array([mesh.id for mesh in self._mesh], np.int64), device=self.device),
        }
        vectors = {"shape": wp.vec2i, "origin": wp.vec2, "goals": wp.vec2, "starts": wp.vec2, "meshes": wp.uint64}
        self.homes = Homes()
        for name, tensor in self._tensors.items():
            setattr(self.homes, name, wp.from_torch(tensor, dtype=vectors.get(name)))
        self.blocks = BlockTable(max(len(home.blocks) for home in built), slots, self.device)
        for slot, home in enumerate(built):
            self._write(slot, home)

    def replace(self, slot: int, home: BuiltHome) -> None:
        """Put a home of no more cells than ``capacity`` in the place of another; the slot's generation grows by one."""
        self._gone.append(self._mesh[slot])
        self._mesh[slot] = self._build_mesh(home)
        self._tensors["meshes"][slot] = self._mesh[slot].id
        self._write(slot, home)
        self._tensors["generation"][slot] += 1

    def generations(self) -> Int[torch.Tensor, " slots"]:
        """(slots,) int32 on the device: how many homes were in each slot before."""
        return self._tensors["generation"]

    def count_bytes(self) -> int:
        """Device memory of all homes but their meshes' ray trees [bytes]."""
        grids = sum(t.numel() * t.element_size() for t in self._tensors.values())
        return grids + self.blocks.bytes + sum(m.points.capacity + m.indices.capacity for m in self._mesh)

    def _build_mesh(self, home: BuiltHome) -> wp.Mesh:
        stream = None
        if self.device.type == "cuda":  # in order with torch's work, which reads the mesh
            stream = wp.stream_from_torch(torch.cuda.current_stream(self.device))
        with wp.ScopedStream(stream):
            points = wp.array(home.vertices, dtype=wp.vec3, device=self._warp_device)
            faces = wp.array(home.faces.ravel(), dtype=wp.int32, device=self._warp_device)
            return wp.Mesh(points=points, indices=faces, bvh_constructor=self._tree)

    def _write(self, slot: int, home: BuiltHome) -> None:
        tensors, begin, cells = self._tensors, int(self._first[slot]), home.cells
        if home.goals.shape != tensors["goals"].shape[1:] or home.starts.shape != tensors["starts"].shape[1:]:
            raise InputError("all homes of a store need as many goals and starts")
        self._copy(tensors["fields"][begin : begin + cells], home.fields.reshape(cells, -1))
        self._copy(tensors["clearance"][4 * begin : 4 * (begin + cells)], home.clearance.reshape(-1))
        self._copy(tensors["goals"][slot], home.goals)
        self._copy(tensors["starts"][slot], home.starts)
        self._copy(tensors["shape"][slot], np.array(home.fields.shape[:2], np.int32))
        self._copy(tensors["origin"][slot], np.array(home.origin, np.float32))
        self.blocks.reserve(len(home.blocks))
        self._copy(self.blocks.rows(slot), self.blocks.encode(home.blocks))

    def _copy(self, target: torch.Tensor, values: np.ndarray) -> None:
        source = torch.from_numpy(values)
        if self.device.type == "cuda":
            source = source.pin_memory()  # otherwise the host waits for what the device has still to do
        target.copy_(source, non_blocking=True)
