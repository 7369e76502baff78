"""Warp beside torch: launches in order with torch's work, and structs from tensors and configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
import warp as wp


def find_stream(device: torch.device) -> wp.Stream | None:
    """Torch's current stream on a GPU; None on a CPU."""
    return None if device.type == "cpu" else wp.stream_from_torch(torch.cuda.current_stream(device))


def launch(
    kernel: Any, dim: int | Sequence[int], inputs: Sequence[Any], device: torch.device, outputs: Sequence[Any] = ()
) -> None:
    """Launch a kernel on Warp's arrays; on a GPU it runs in order with torch's work."""
    wp.launch(kernel, dim, inputs, outputs, device=str(device), stream=find_stream(device))


def allocate_struct(kind: Any, n: int, device: torch.device | str) -> tuple[Any, dict[str, torch.Tensor]]:
    """A struct of arrays of n rows, all zero, for kernels, and the same memory as tensors (n, ...) by the names of its
    fields."""
    record, tensors = kind(), {}
    for name, field in kind.vars.items():
        row = wp.to_torch(wp.zeros(1, dtype=field.type.dtype, device="cpu"))
        tensors[name] = torch.zeros(n, *row.shape[1:], dtype=row.dtype, device=device)
        setattr(record, name, wp.from_torch(tensors[name], dtype=field.type.dtype))
    return record, tensors


def fill_struct(kind: Any, values: Mapping[str, Any]) -> Any:
    """A struct of single numbers and pairs; values that it has no field for are left out."""
    record = kind()
    for name in kind.vars:
        if name in values:
            value = values[name]
            setattr(record, name, wp.vec2(*value) if isinstance(value, tuple) else value)
    return record
