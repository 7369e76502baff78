"""A legged robot crosses cluttered homes it has never seen, from depth images: training and evaluation on MuJoCo.

The names below are the public ones; each part is imported when its first name is used.
"""

# ruff: noqa: F401 - the names are for others

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the same as _NAMES, for editors
    from vinl.benchmark.evaluate import evaluate
    from vinl.chain.config import EvaluationConfig
    from vinl.config.errors import InputError
    from vinl.config.loader import load_config
    from vinl.notebook.own import as_locomotor, as_navigator
    from vinl.notebook.plans import draw_plan, sample_routes, scatter_clutter
    from vinl.notebook.training import Training, train
    from vinl.notebook.walk import Film, Walk, show_video, walk
    from vinl.policies.card import PolicyCard
    from vinl.policies.io import list_policies, load_policy, save_policy
    from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
    from vinl.viewer.play import play, replay
    from vinl.world.boxes import Blocks, Boxes
    from vinl.world.floorplan import FloorPlan
    from vinl.world.homes import generate_home
    from vinl.world.readers import load_floorplan, shipped_floorplans

_NAMES = {
    "vinl.benchmark.evaluate": ("evaluate",),
    "vinl.chain.config": ("EvaluationConfig",),
    "vinl.config.errors": ("InputError",),
    "vinl.config.loader": ("load_config",),
    "vinl.notebook.own": ("as_locomotor", "as_navigator"),
    "vinl.notebook.plans": ("draw_plan", "sample_routes", "scatter_clutter"),
    "vinl.notebook.training": ("Training", "train"),
    "vinl.notebook.walk": ("Film", "Walk", "show_video", "walk"),
    "vinl.policies.card": ("PolicyCard",),
    "vinl.policies.io": ("list_policies", "load_policy", "save_policy"),
    "vinl.robot.cameras": ("LOCOMOTION_CAMERA", "NAVIGATION_CAMERA", "Camera"),
    "vinl.viewer.play": ("play", "replay"),
    "vinl.world.boxes": ("Blocks", "Boxes"),
    "vinl.world.floorplan": ("FloorPlan",),
    "vinl.world.homes": ("generate_home",),
    "vinl.world.readers": ("load_floorplan", "shipped_floorplans"),
}
_WHERE = {name: module for module, names in _NAMES.items() for name in names}

__all__ = sorted([*_WHERE, "__version__"])  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a public name at its first use (PEP 562), so that ``import vinl`` takes milliseconds."""
    if name == "__version__":
        from importlib.metadata import version

        return version("vinl")
    if name not in _WHERE:
        raise AttributeError(f"module 'vinl' has no attribute {name!r}")
    value = getattr(import_module(_WHERE[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


if "gymnasium" in sys.modules:  # its registry takes names alone: nothing else is imported
    import_module("vinl.gym")
