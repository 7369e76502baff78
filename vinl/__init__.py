"""A legged robot crosses homes it has never seen and steps over their clutter, seeing only through depth cameras.

The names below are the public ones; each part is imported when its first name is used.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vinl.config.errors import InputError as InputError
    from vinl.config.loader import load_config as load_config
    from vinl.evaluation.evaluate import evaluate as evaluate
    from vinl.policies.card import PolicyCard as PolicyCard
    from vinl.policies.io import list_policies as list_policies
    from vinl.policies.io import load_policy as load_policy
    from vinl.policies.io import save_policy as save_policy
    from vinl.world.blocks import Blocks as Blocks
    from vinl.world.boxes import Boxes as Boxes
    from vinl.world.floorplan import FloorPlan as FloorPlan
    from vinl.world.readers import load_floorplan as load_floorplan
    from vinl.world.readers import shipped_floorplans as shipped_floorplans

_WHERE = {
    "Blocks": "vinl.world.blocks",
    "Boxes": "vinl.world.boxes",
    "FloorPlan": "vinl.world.floorplan",
    "InputError": "vinl.config.errors",
    "PolicyCard": "vinl.policies.card",
    "evaluate": "vinl.evaluation.evaluate",
    "list_policies": "vinl.policies.io",
    "load_config": "vinl.config.loader",
    "load_floorplan": "vinl.world.readers",
    "load_policy": "vinl.policies.io",
    "save_policy": "vinl.policies.io",
    "shipped_floorplans": "vinl.world.readers",
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
