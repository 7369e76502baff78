"""``report.html``: one self-contained page with table, maps and histograms."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2

from vinl.benchmark.metrics import aggregate_episodes
from vinl.benchmark.table_config import PaperFigures, TableConfig
from vinl.chain.failures import FAILURES, read_failure
from vinl.chain.records import EpisodeRecord, Results
from vinl.config.loader import load_config
from vinl.config.output import write_text
from vinl.config.versions import describe_environment
from vinl.render.drawing import POINT_DT, draw_histogram, draw_map

_SHOWN = ("vinl", "vinl_no_clutter", "rough")
"""Rows of the paper's table that every report shows."""


@dataclass(frozen=True)
class _Row:
    """One line of the table of failures or of all episodes."""

    number: int
    record: EpisodeRecord


def render_report(results: Results, command: str) -> str:
    """The page as text.

    Args:
        results: what ``evaluate`` returned.
        command: shown as the way to repeat it.
    """
    rows = [_Row(k, episode.record) for k, episode in enumerate(results.episodes)]
    rules = results.config["evaluation"]
    plans = []
    for plan in results.plans:
        mine = [row.number for row in rows if row.record.plan == plan.name]
        if not mine:
            continue
        episodes = [results.episodes[k] for k in mine]
        assert mine == list(range(mine[0], mine[0] + len(mine))), "episodes of a plan stand together"
        plans.append(
            {
                "plan": plan,
                "map": draw_map(plan, episodes, mine[0], rules["success_radius"]),
                "longest": max(e.record.time_s for e in episodes),
                "aggregate": aggregate_episodes([e.record for e in episodes], rules["min_metres"]),
                "rows": [rows[k] for k in mine],
                "notes": sorted({e.record.note for e in episodes if e.record.note}),
            }
        )
    walked = [r for r in results.records if r.distance_m >= rules["min_metres"]]
    histograms = [
        draw_histogram([r.spl for r in results.records], "SPL", 0.0, 1.0),
        draw_histogram([r.distance_m for r in results.records], "distance walked [m]"),
        draw_histogram([r.time_s for r in results.records], "time [s]"),
        draw_histogram([r.foot_steps / r.distance_m for r in walked], "foot collisions per metre"),
    ]
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vinl.render"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["figure"] = format_figure
    environment.filters["failure"] = read_failure
    environment.filters["published"] = lambda figure: f"{figure[0]:.1f} ± {figure[1]:.1f}"
    return environment.get_template("report.html.j2").render(
        aggregate=results.aggregate,
        plans=plans,
        kinds=FAILURES,
        failures=[row for row in rows if not row.record.success],
        histograms=histograms,
        paper=_read_paper(),
        config=results.config,
        policies=results.policies,
        environment=describe_environment(),
        videos=results.videos,
        point_dt=POINT_DT,
        command=command,
        wall_seconds=results.wall_seconds,
    )


def _read_paper() -> list[tuple[str, PaperFigures]]:
    """What the paper found, from the shipped table."""
    rows = load_config(TableConfig, "eval/table").rows
    return [(rows[name].title, paper) for name in _SHOWN if (paper := rows[name].paper) is not None]


def write_report(path: Path, results: Results, command: str) -> None:
    """Write the page, whole or not at all."""
    write_text(path, render_report(results, command))


def format_figure(figure: dict[str, Any], digits: int = 2, factor: float = 1.0) -> str:
    """``mean ± deviation of the seeds``, the mean alone of one seed, or a dash."""
    if figure["mean"] is None:
        return "-"
    spread = figure["std_over_seeds"]
    return f"{factor * figure['mean']:.{digits}f}" + ("" if spread is None else f" ± {factor * spread:.{digits}f}")
