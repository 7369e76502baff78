"""The figures of a snapshot as HTML for the page's panel."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from vinl.viewer.snapshot import Snapshot

_COLOURS = {
    "standing": "#64748b",
    "walking": "#2563eb",
    "driven": "#b45309",
    "reached": "#16a34a",
    "fallen": "#dc2626",
    "recorded": "#7c3aed",
}
_ROW = (
    '<tr><td style="color:#64748b;padding:1px 8px 1px 0">{0}</td>'
    '<td id="vinl-{1}" style="text-align:right;font-weight:600">{2}</td></tr>'
)


def describe_state(snapshot: Snapshot) -> str:
    """What the robot is about, in a few words."""
    if snapshot.state == "fallen":
        return "fallen: press Reset"
    return f"{snapshot.state}, paused" if snapshot.paused else snapshot.state


def list_figures(snapshot: Snapshot) -> list[tuple[str, str, str]]:
    """Name, key and text of each figure."""
    goal = "none: click the floor" if snapshot.duration_s is None else "-"
    if snapshot.goal is not None:
        goal = f"{np.linalg.norm(snapshot.goal - snapshot.qpos[:2]):.2f} m away"
    time = f"{snapshot.time_s:.2f} s"
    if snapshot.duration_s is not None:
        time += f" of {snapshot.duration_s:.1f} s"
    foot, leg, trunk = snapshot.contact_steps
    speed, turn = snapshot.velocity[0], math.degrees(snapshot.velocity[2])
    x, y = snapshot.qpos[:2]
    figures = [
        ("goal", "goal", goal),
        ("time", "time", time),
        ("robot at x, y", "place", f"{x:.2f}, {y:.2f} m"),
        ("walked", "distance", f"{snapshot.distance_m:.2f} m"),
        ("commanded", "command", f"{snapshot.command[0]:.2f} m/s, {math.degrees(snapshot.command[2]):+.0f} °/s"),
        ("measured", "velocity", f"{speed:.2f} m/s, {turn:+.0f} °/s"),
        ("blocks", "blocks", str(len(snapshot.world.blocks))),
        ("contact steps: foot, leg, trunk", "contacts", f"{foot}, {leg}, {trunk}"),
    ]
    if snapshot.paused:
        figures.append(("real-time factor", "factor", "paused"))
    else:
        factor = f"{snapshot.real_time:.2f}, {snapshot.step_ms:.1f} ms a step"
        figures.append(("real-time factor", "factor", factor))
    return figures


def render_status(snapshot: Snapshot) -> str:
    """State and figures as a table. Every figure's cell has an id, ``vinl-`` and its key."""
    colour = _COLOURS[snapshot.state]
    badge = (
        f'<div id="vinl-state" style="background:{colour};color:white;border-radius:6px;padding:3px 10px;'
        f'font-weight:600;margin-bottom:6px">{escape(describe_state(snapshot))}</div>'
    )
    rows = "".join(_ROW.format(escape(name), key, escape(text)) for name, key, text in list_figures(snapshot))
    table = (
        '<table style="width:100%;border-collapse:collapse;font-size:12.5px;font-variant-numeric:tabular-nums">'
        f"{rows}</table>"
    )
    return f'<div style="padding:0 0.75em 0.3em">{badge}{table}</div>'
