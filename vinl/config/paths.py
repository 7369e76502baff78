"""Where the files live that travel with the package: configs, robot, floor plans, trained policies."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent.parent


def _bundled(folder: str) -> Path:
    """The wheel carries the folder inside the package; a checkout has it beside the package."""
    inside = _PACKAGE / folder
    return inside if inside.is_dir() else _PACKAGE.parent / folder


def assets_dir() -> Path:
    """The folder with ``aliengo/``, ``floorplans/`` and ``policies/``."""
    return _bundled("assets")


def configs_dir() -> Path:
    """The folder with ``loco/*.yaml``, ``nav/*.yaml`` and ``eval/*.yaml``."""
    return _bundled("configs")
