"""Versions of what figures may depend on."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

_PACKAGES = ("vinl", "mujoco", "numpy", "scipy", "scikit-image", "torch", "warp-lang")


def describe_environment() -> dict[str, str]:
    """Versions that figures may depend on."""
    return {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        **list_packages(),
    }


def list_packages() -> dict[str, str]:
    """Versions of the packages that figures may depend on."""
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
