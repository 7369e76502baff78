"""Which version of the code made a policy."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path


def find_commit() -> str:
    """The git commit of this checkout, with ``+`` when it was changed; empty outside a checkout.

    The environment variable ``VINL_COMMIT`` names it where the code runs without its repository, as in a container.
    """
    if given := os.environ.get("VINL_COMMIT"):
        return given
    here = Path(__file__).resolve().parent
    try:
        commit = _git(here, "rev-parse", "--short", "HEAD")
        return commit + ("+" if _git(here, "status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


def _git(folder: Path, *command: str) -> str:
    done = subprocess.run(["git", "-C", str(folder), *command], capture_output=True, text=True, check=True)
    return done.stdout.strip()
