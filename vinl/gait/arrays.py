"""What numpy, jax.numpy and torch call by different names."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np


def constant(xp: Any, array: np.ndarray, like: Any) -> Any:
    """A constant array as ``xp`` has it, of the kind and on the device of another."""
    if xp is np or not hasattr(xp, "from_numpy"):
        return xp.asarray(array, dtype=like.dtype)
    return _torch_constant(array.tobytes(), array.shape, str(array.dtype), like.dtype, like.device)


@lru_cache(maxsize=256)
def _torch_constant(data: bytes, shape: tuple[int, ...], kind: str, dtype: Any, device: Any) -> Any:
    """Kept: a copy to a GPU at every control step would wait for the device."""
    import torch

    with torch.inference_mode(False):  # one made while acting would be of no use to training
        return torch.from_numpy(np.frombuffer(data, kind).reshape(shape).copy()).to(device=device, dtype=dtype)


def to_index(xp: Any, values: Any) -> Any:
    """Whole numbers that index arrays of ``xp``."""
    return values.long() if hasattr(xp, "from_numpy") else values.astype("int32")


def take_along(xp: Any, array: Any, index: Any, axis: int) -> Any:
    """``take_along_axis`` of numpy for all three array modules; what is no place (NaN) takes an end."""
    if hasattr(xp, "from_numpy"):  # its own take_along_dim divides every index, which takes longer than all the rest
        whole = [*array.shape[:axis], index.shape[axis], *array.shape[axis + 1 :]]
        return xp.gather(array, axis, index.clamp(0, array.shape[axis] - 1).expand(whole))
    return xp.take_along_axis(array, index, axis)
