"""Where the curves of a training go beside its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from vinl.config.errors import InputError

Logger = Literal["tensorboard", "wandb"]


def start_logger(logger: Logger, folder: str | Path) -> None:
    """Begin what the logger needs. TensorBoard's files in the run's folder are always written; Weights & Biases reads
    along.

    Raises:
        InputError: the logger is not installed.
    """
    if logger == "tensorboard":
        return
    try:
        import wandb  # pyright: ignore[reportMissingImports]  (an extra of its own)
    except ModuleNotFoundError:
        raise InputError("--logger wandb: it is not installed; pip install wandb") from None
    Path(folder).mkdir(parents=True, exist_ok=True)
    wandb.init(project="vinl", name=Path(folder).name, dir=str(folder), sync_tensorboard=True)
