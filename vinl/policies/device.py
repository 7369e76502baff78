"""The torch device that an option names."""

from __future__ import annotations

import torch

from vinl.config.errors import InputError


def choose_training_device(name: str) -> str:
    """The device of a training, or of a measurement of one: ``"auto"`` is the GPU where there is one.

    Raises:
        InputError: no such device here.
    """
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    return str(choose_device(name))


def choose_device(name: str) -> torch.device:
    """``"cpu"``, ``"cuda"`` or ``"cuda:1"`` as a torch device. ``"auto"`` is the CPU, the only one that repeats bit for
    bit.

    Raises:
        InputError: no such device here.
    """
    try:
        device = torch.device("cpu" if name == "auto" else name)
    except RuntimeError:
        raise InputError(f"unknown device {name!r}; use cpu, cuda or cuda:N") from None
    if device.type not in ("cpu", "cuda"):
        raise InputError(f"device {name!r} is not supported; use cpu, cuda or cuda:N")
    if device.type == "cuda":
        if not torch.cuda.is_available():
            raise InputError(f"device {name!r}: no CUDA device is available here; use --device cpu")
        if (device.index or 0) >= torch.cuda.device_count():
            raise InputError(f"device {name!r}: there are only {torch.cuda.device_count()} CUDA devices")
    return device
