"""Where results go if nobody says so."""

from __future__ import annotations

import re
from pathlib import Path


def default_out(command: str, *names: str) -> Path:
    """``runs/eval-loco-nav`` for the command ``eval`` and these policies; of a folder, its name counts."""
    words = []
    for name in names:
        path = Path(name.rstrip("/"))
        last = path.parent.name if path.name == "policy" and path.parent.name else path.name
        words.append(re.sub(r"[^\w.-]+", "_", last) or "run")
    return Path("runs") / "-".join((command, *words))
