"""Pictures for docs/floorplans.md: one of our homes written as PNG, ROS map and ProcTHOR house, read back and drawn.

python scripts/draw_reader_pictures.py
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imread
from PIL import Image

from vinl.config.paths import assets_dir
from vinl.world.drawing import draw_floorplan
from vinl.world.floorplan import FloorPlan
from vinl.world.raster import paint_boxes
from vinl.world.readers import load_floorplan

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "images" / "floorplans"
HOME = "garden_bungalow"


def write_png(plan: FloorPlan, file: Path, resolution: float = 0.12) -> None:
    """Walls one pixel wide by opacity; the front door stands open."""
    columns, rows = (int(n * plan.frame.resolution / resolution) + 1 for n in plan.frame.shape[::-1])
    opaque = np.zeros((rows, columns), np.uint8)
    for x, y, yaw, length, _, bottom, _ in plan.walls.rows:
        if bottom > 0:
            continue
        along = np.arange(-length / 2 + 0.05, length / 2 - 0.05, 0.02)
        column = ((x + along * np.cos(yaw) - plan.frame.x0) / resolution).astype(int)
        row = ((y + along * np.sin(yaw) - plan.frame.y0) / resolution).astype(int)
        opaque[rows - 1 - row, column] = 255
    for x, y, yaw, length, *_ in plan.windows.rows[plan.windows.rows[:, 5] == 0]:
        along = np.arange(-length / 2, length / 2, 0.02)
        column = ((x + along * np.cos(yaw) - plan.frame.x0) / resolution).astype(int)
        row = ((y + along * np.sin(yaw) - plan.frame.y0) / resolution).astype(int)
        opaque[rows - 1 - row, column] = 0
    black = np.zeros_like(opaque)
    Image.fromarray(np.stack([black, black, black, opaque], -1)).save(file)


def write_ros_map(plan: FloorPlan, file: Path, rng: np.random.Generator) -> None:
    """Free where a laser scanner saw floor, occupied where its rays ended, a tenth of the walls missed."""
    solid = paint_boxes(plan.boxes, plan.frame) | ~plan.inside
    grey = np.full(plan.frame.shape, 205, np.uint8)
    spots = np.argwhere(plan.free)
    reach = np.arange(0, 200, 0.7)
    for spot in spots[rng.integers(len(spots), size=300)]:
        for angle in np.linspace(0, 2 * np.pi, 360, endpoint=False):
            ray = np.rint(spot + reach[:, None] * [np.sin(angle), np.cos(angle)]).astype(int)
            ray = ray[((ray >= 0) & (ray < plan.frame.shape)).all(1)]
            hits = np.flatnonzero(solid[ray[:, 0], ray[:, 1]])
            end = hits[0] if len(hits) else len(ray)
            seen = ray[:end]
            grey[seen[:, 0], seen[:, 1]] = 254
            if len(hits):
                grey[ray[end, 0], ray[end, 1]] = 0
    grey[(grey == 0) & (rng.random(grey.shape) < 0.1)] = 205
    Image.fromarray(grey[::-1]).save(file.with_suffix(".pgm"))
    entries = f"image: {file.stem}.pgm\nresolution: {plan.frame.resolution}\norigin: [0.0, 0.0, 0.0]\n"
    file.write_text(entries + "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")


def write_procthor(file: Path) -> None:
    """The same home in ProcTHOR's words, furniture with its sizes beside it."""
    home = json.loads((assets_dir() / "floorplans" / f"{HOME}.json").read_text())

    def point(xz: list[float], y: float = 0.0) -> dict[str, float]:
        return {"x": xz[0], "y": y, "z": xz[1]}

    walls, doors, objects, sizes = [], [], [], {}
    for k, wall in enumerate(home["walls"]):
        a, b = np.array(wall["from"]), np.array(wall["to"])
        corners = [point(list(p), y) for y in (0.0, home["height"]) for p in (a, b)]
        walls.append({"id": f"wall|{k}", "polygon": corners})
        length = np.linalg.norm(b - a)
        for door in home["doors"]:
            ends = (np.array([door["from"], door["to"]]) - a) @ (b - a) / length
            off = abs(np.cross([*(b - a), 0], [*(np.array(door["from"]) - a), 0])[2]) / length
            if off < 0.01 and ends.min() >= 0 and ends.max() <= length:
                hole = [point([ends.min(), 0]), point([ends.max(), 0], door["height"])]
                doors.append({"room0": "a", "room1": "b", "wall0": f"wall|{k}", "wall1": "-", "holePolygon": hole})
    for k, thing in enumerate(home["furniture"]):
        low, high = thing["span"]
        sizes[f"Thing_{k}"] = {"bbox": [thing["size"][0], high - low, thing["size"][1]]}
        turn = {"x": 0, "y": -thing.get("turn", 0.0), "z": 0}
        objects.append({"assetId": f"Thing_{k}", "position": point(thing["at"], (low + high) / 2), "rotation": turn})
    rooms = [{"roomType": r["name"], "floorPolygon": [point(p) for p in r["outline"]]} for r in home["rooms"]]
    file.write_text(json.dumps({"rooms": rooms, "walls": walls, "doors": doors, "objects": objects}))
    (file.parent / "asset_bbox.json").write_text(json.dumps(sizes))


def main() -> None:
    plan = load_floorplan(HOME)
    with tempfile.TemporaryDirectory() as folder:
        png, ros, house = (Path(folder) / name for name in ("drawing.png", "scan.yaml", "house.json"))
        write_png(plan, png)
        write_ros_map(plan, ros, np.random.default_rng(0))
        write_procthor(house)
        for name, file, picture in (
            ("png", png, png),
            ("ros", ros, ros.with_suffix(".pgm")),
            ("procthor", house, None),
        ):
            figure = Figure(figsize=(9.0 if picture else 4.5, 3.4), layout="constrained")
            axes = np.atleast_1d(figure.subplots(1, 2 if picture else 1))
            if picture is not None:
                axes[0].imshow(imread(picture), cmap="gray", interpolation="nearest")
                axes[0].set(title=f"the file: {picture.name}", facecolor="white")
                axes[0].set_axis_off()
            read = load_floorplan(file, resolution=0.12, min_speck=3)
            draw_floorplan(
                read, axes[-1], title=f"what is read: {read.area_m2:.0f} m² free, {len(read.walls)} wall boxes"
            )
            figure.savefig(PICTURES / f"read_{name}.png", dpi=80)


if __name__ == "__main__":
    main()
