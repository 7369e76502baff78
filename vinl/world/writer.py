"""Floor plans to files that this package reads again, cell for cell."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import FloorPlan
from vinl.world.raster import split_rectangles
from vinl.world.readers.own import BOXES_SCHEMA


def write_floorplan(plan: FloorPlan, file: str | Path) -> Path:
    """Write any floor plan as JSON (schema ``vinl/floorplan-boxes/1``, described in docs/floorplans.md).

    Args:
        plan: the floor plan.
        file: where to; must end in ``.json``. Folders are made as needed.

    Raises:
        InputError: if the name has another ending or the file cannot be written.
    """
    file = Path(file)
    if file.suffix.lower() != ".json":
        raise InputError(f"{file}: give a name that ends in .json")
    frame = plan.frame
    edges = split_rectangles(plan.inside)[:, [1, 0, 3, 2]] - 0.5
    inside = np.array([frame.x0, frame.y0] * 2) + edges * frame.resolution
    grid = {"x0": frame.x0, "y0": frame.y0, "resolution": frame.resolution}
    grid |= {"rows": frame.shape[0], "columns": frame.shape[1]}
    lists = {
        "inside": [[round(float(v), 6) for v in row] for row in inside],
        "walls": _list(plan.walls),
        "furniture": _list(plan.furniture),
        "windows": _list(plan.windows),
        "labels": [{"name": label.name, "at": [label.x, label.y]} for label in plan.labels],
    }
    parts = [f'  "schema": "{BOXES_SCHEMA}"', f'  "name": {json.dumps(plan.name)}', f'  "grid": {json.dumps(grid)}']
    for key, entries in lists.items():
        lines = ",\n".join("    " + json.dumps(entry) for entry in entries)
        parts.append(f'  "{key}": [\n{lines}\n  ]' if entries else f'  "{key}": []')
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file}: cannot be written ({error.strerror}); choose another place") from None
    return file


def _list(boxes: Boxes) -> list[list[float]]:
    return boxes.rows.tolist()
