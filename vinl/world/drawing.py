"""Top views of floor plans."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan
from vinl.world.start_goal import StartGoal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FLOOR, WALL, FURNITURE, EDGE, PANE, DOOR = "#f6f1e7", "#2f3437", "#d3c1a5", "#9c8767", "#8fc1dd", "#b07a4a"
START, GOAL, PATH, BLOCK = "#2a7f62", "#c8553d", "#1f5fa8", "#c8553d"


def draw_floorplan(
    plan: FloorPlan,
    axes: Axes | None = None,
    blocks: Blocks | None = None,
    start_goals: Sequence[StartGoal] = (),
    paths: Sequence[Float[np.ndarray, "k 2"]] = (),
    title: str | None = None,
) -> Figure:
    """Draw a plan from above: floor, furniture, walls, panes and room names; and, if given, clutter, a dot with its
    heading for each start, a ring for each goal, and paths [m].

    Without ``axes`` a figure of its own is made, to scale. ``title`` is the plan's name and free area by default, ""
    leaves it away. The figure is not yet saved and belongs to no window system.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    x, y = plan.frame.centres()
    half = plan.frame.resolution / 2
    extent = (x[0] - half, x[-1] + half, y[0] - half, y[-1] + half)
    if axes is None:
        scale = 9.0 / max(extent[1] - extent[0], extent[3] - extent[2])
        size = ((extent[1] - extent[0]) * scale, (extent[3] - extent[2]) * scale + 0.6)
        axes = Figure(figsize=(max(size[0], 3.0), max(size[1], 2.0)), layout="constrained").add_subplot()
    floor = np.where(plan.inside, 1.0, np.nan)
    axes.imshow(floor, extent=extent, origin="lower", cmap=ListedColormap([FLOOR]), interpolation="nearest")

    def add(boxes: Boxes, face: str, edge: str, width: float, order: float) -> None:
        if len(boxes):
            outlines = list(boxes.corners()[np.argsort(boxes.rows[:, 6], kind="stable")])
            drawn = PolyCollection(outlines, facecolors=face, edgecolors=edge, linewidths=width, zorder=order)
            axes.add_collection(drawn)

    add(plan.furniture, FURNITURE, EDGE, 0.7, 2)
    add(plan.walls.below(BODY_HEIGHT), WALL, WALL, 0.3, 3)
    shut = plan.windows.rows[:, 5] == 0.0
    add(plan.windows[~shut], PANE, "white", 0.6, 4)
    add(plan.windows[shut], DOOR, "white", 0.6, 4)
    if blocks is not None:
        add(blocks.boxes(), BLOCK, "white", 0.4, 5)
    for path in paths:
        axes.plot(path[:, 0], path[:, 1], color=PATH, linewidth=1.6, zorder=6)
    for pair in start_goals:
        ahead = 0.5 * np.array([np.cos(pair.yaw), np.sin(pair.yaw)])
        axes.plot(*np.stack([pair.start, pair.start + ahead]).T, color=START, linewidth=2, zorder=7)
        axes.plot(*pair.start, "o", color=START, markersize=7, zorder=7)
        axes.plot(*pair.goal, "o", color=GOAL, markersize=8, fillstyle="none", markeredgewidth=2, zorder=7)
    for label in plan.labels:
        box = {"facecolor": FLOOR, "edgecolor": "none", "alpha": 0.7, "pad": 1.0}
        axes.text(
            label.x, label.y, label.name, ha="center", va="center", fontsize=8, color="#555555", bbox=box, zorder=8
        )
    if title is None:
        title = f"{plan.name.replace('_', ' ')}: {plan.area_m2:.0f} m² of free floor"
    axes.set(xlim=extent[:2], ylim=extent[2:], aspect="equal", title=title)
    left, low = extent[0] + 0.1, extent[2] + 0.08  # a scale bar, in the strip of outside that every grid keeps
    axes.plot([left, left + 2], [low, low], color=WALL, linewidth=2, zorder=9)
    axes.text(left + 2.1, low, "2 m", ha="left", va="center", fontsize=7, color=WALL, zorder=9)
    axes.set_axis_off()
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure


def encode_floorplan(plan: FloorPlan, dpi: int = 90, **drawn) -> bytes:
    """Draw a plan (arguments as in ``draw_floorplan``): the content of a PNG file."""
    file = io.BytesIO()
    draw_floorplan(plan, **drawn).savefig(file, format="png", dpi=dpi)
    return file.getvalue()


def save_floorplan(plan: FloorPlan, out: str | Path, dpi: int = 100, **drawn) -> Path:
    """Draw a plan (arguments as in ``draw_floorplan``) and save it as PNG; folders are made as needed. Raises
    ``InputError`` if the file cannot be written."""
    return _save(draw_floorplan(plan, **drawn), out, dpi)


def _save(figure: Figure, out: str | Path, dpi: int) -> Path:
    out = Path(out)
    if out.suffix.lower() != ".png":
        raise InputError(f"--out {out}: give a name that ends in .png")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(out, dpi=dpi)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written ({error.strerror}); choose another place") from None
    return out


def save_contact_sheet(plans: Sequence[FloorPlan], out: str | Path, columns: int = 5, dpi: int = 80) -> Path:
    """Draw many plans beside one another, each to its own scale, and save them as one PNG. Raises ``InputError`` if the
    file cannot be written, or there are no plans."""
    from matplotlib.figure import Figure

    if not plans:
        raise InputError("a contact sheet needs at least one plan")
    columns = min(columns, len(plans))
    rows = -(-len(plans) // columns)
    figure = Figure(figsize=(3.6 * columns, 3.3 * rows), layout="constrained")
    for k, plan in enumerate(plans):
        draw_floorplan(plan, figure.add_subplot(rows, columns, k + 1), title=f"{plan.name}: {plan.area_m2:.0f} m²")
    return _save(figure, out, dpi)
