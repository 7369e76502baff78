"""A legged robot crosses cluttered homes it has never seen, from depth images: training and evaluation on MuJoCo.

The names below are the public ones; each part is imported when its first name is used.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vinl.benchmark.evaluate import evaluate as evaluate
    from vinl.chain.config import EvaluationConfig as EvaluationConfig
    from vinl.config.errors import InputError as InputError
    from vinl.config.loader import load_config as load_config
    from vinl.notebook.own import as_locomotor as as_locomotor
    from vinl.notebook.own import as_navigator as as_navigator
    from vinl.notebook.plans import draw_plan as draw_plan
    from vinl.notebook.plans import sample_routes as sample_routes
    from vinl.notebook.plans import scatter_clutter as scatter_clutter
    from vinl.notebook.training import Training as Training
    from vinl.notebook.training import train as train
    from vinl.notebook.walk import Film as Film
    from vinl.notebook.walk import Walk as Walk
    from vinl.notebook.walk import show_video as show_video
    from vinl.notebook.walk import walk as walk
    from vinl.policies.card import PolicyCard as PolicyCard
    from vinl.policies.io import list_policies as list_policies
    from vinl.policies.io import load_policy as load_policy
    from vinl.policies.io import save_policy as save_policy
    from vinl.robot.cameras import LOCOMOTION_CAMERA as LOCOMOTION_CAMERA
    from vinl.robot.cameras import NAVIGATION_CAMERA as NAVIGATION_CAMERA
    from vinl.robot.cameras import Camera as Camera
    from vinl.viewer.play import play as play
    from vinl.viewer.play import replay as replay
    from vinl.world.boxes import Blocks as Blocks
    from vinl.world.boxes import Boxes as Boxes
    from vinl.world.floorplan import FloorPlan as FloorPlan
    from vinl.world.homes import generate_home as generate_home
    from vinl.world.readers import load_floorplan as load_floorplan
    from vinl.world.readers import shipped_floorplans as shipped_floorplans

_WHERE = {
    "Blocks": "vinl.world.boxes",
    "Boxes": "vinl.world.boxes",
    "Camera": "vinl.robot.cameras",
    "EvaluationConfig": "vinl.chain.config",
    "Film": "vinl.notebook.walk",
    "FloorPlan": "vinl.world.floorplan",
    "InputError": "vinl.config.errors",
    "LOCOMOTION_CAMERA": "vinl.robot.cameras",
    "NAVIGATION_CAMERA": "vinl.robot.cameras",
    "PolicyCard": "vinl.policies.card",
    "Training": "vinl.notebook.training",
    "Walk": "vinl.notebook.walk",
    "as_locomotor": "vinl.notebook.own",
    "as_navigator": "vinl.notebook.own",
    "draw_plan": "vinl.notebook.plans",
    "evaluate": "vinl.benchmark.evaluate",
    "generate_home": "vinl.world.homes",
    "list_policies": "vinl.policies.io",
    "play": "vinl.viewer.play",
    "replay": "vinl.viewer.play",
    "load_config": "vinl.config.loader",
    "load_floorplan": "vinl.world.readers",
    "load_policy": "vinl.policies.io",
    "sample_routes": "vinl.notebook.plans",
    "save_policy": "vinl.policies.io",
    "scatter_clutter": "vinl.notebook.plans",
    "shipped_floorplans": "vinl.world.readers",
    "show_video": "vinl.notebook.walk",
    "train": "vinl.notebook.training",
    "walk": "vinl.notebook.walk",
}

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
