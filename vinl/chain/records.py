"""What an evaluation returns: one record an episode, its trace for the drawings, and the whole."""

from __future__ import annotations

import html
import re
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.output import round_numbers
from vinl.config.words import count_things
from vinl.world.floorplan import FloorPlan

Key = tuple[str, int, int]
"""What tells an episode from all others of a row: name of the plan, seed, number of the start/goal pair."""


def name_episode(plan: str, seed: int, episode: int) -> str:
    """Name of the files that are kept of an episode, without what they end in."""
    return re.sub(r"[^\w.-]+", "_", f"{plan}_episode{episode}_seed{seed}")


@dataclass(frozen=True)
class RouteRecord:
    """What every evaluation records of an episode from a start to a goal.

    Attributes:
        plan: floor plan.
        episode: number of the start/goal pair.
        seed: repetition.
        start, goal: x, y [m].
        yaw: heading at the start [rad].
        straight_m, geodesic_m: straight and shortest distance from start to goal [m].
        success: came within the success radius.
        end_reason: one of ``endings.END_REASONS``.
        time_s: length [s].
        distance_m: path length [m].
        spl: success x shortest / max(shortest, walked).
        soft_spl: fraction of the shortest distance that was covered, x the same ratio.
    """

    plan: str
    episode: int
    seed: int
    start: tuple[float, float]
    goal: tuple[float, float]
    yaw: float
    straight_m: float
    geodesic_m: float
    success: bool
    end_reason: str
    time_s: float
    distance_m: float
    spl: float
    soft_spl: float


@dataclass(frozen=True)
class EpisodeRecord(RouteRecord):
    """One episode of the chain, as it stands in ``results.json``. The path is the trunk's, summed at 50 Hz; ``*_steps``
    count control steps of 0.02 s.

    Attributes:
        blocks: how many blocks lay in the plan.
        fell: ended in a fall.
        foot_steps: at least one foot on a block or a wall.
        foot_block_steps, foot_wall_steps: the same for blocks and for walls with furniture.
        leg_contact_steps: a hip, thigh or shank on a block or a wall.
        trunk_contact_steps: the trunk on a block or a wall.
        paper_foot_steps: the paper's own rule, from foot height and force [ViNL code].
        speed_rmse: root mean square of the error of the horizontal velocity [m/s].
        yaw_rate_rmse: the same of the yaw rate [rad/s].
        end_at: ``block``, ``wall`` or ``free``: what a robot fell over, or was stuck at; empty for other ends.
        note: why start and goal are nearer than asked for, if they are.
    """

    blocks: int
    fell: bool
    foot_steps: int
    foot_block_steps: int
    foot_wall_steps: int
    leg_contact_steps: int
    trunk_contact_steps: int
    paper_foot_steps: int
    speed_rmse: float
    yaw_rate_rmse: float
    end_at: str = ""
    note: str = ""

    @property
    def key(self) -> Key:
        """Plan, seed and number."""
        return self.plan, self.seed, self.episode


@dataclass(frozen=True, eq=False)
class EpisodeTrace:
    """What drawings and videos need of an episode.

    Attributes:
        path: (k, 2) the trunk every 0.1 s [m], to the millimetre.
        contacts: (m, 4) time [s], index into ``contact.KINDS``, x, y [m] to the millimetre; one row a control step and
            kind.
        blocks: (b, 6) rows of ``Blocks``.
        poses: (f, 19) qpos every 0.04 s, of episodes that a video was asked for; otherwise (0, 19).
        commands: (f, 3) command at those times.
    """

    def __repr__(self) -> str:
        return f"EpisodeTrace({len(self.path)} points, {len(self.contacts)} contacts, {len(self.poses)} poses)"

    path: Float[np.ndarray, "k 2"]
    contacts: Float[np.ndarray, "m 4"]
    blocks: Float[np.ndarray, "b 6"]
    poses: Float[np.ndarray, "f 19"]
    commands: Float[np.ndarray, "f 3"]


@dataclass(frozen=True, eq=False)
class Episode:
    """Record and trace."""

    record: EpisodeRecord
    trace: EpisodeTrace

    def __repr__(self) -> str:
        r = self.record
        return f"Episode({r.plan}, episode {r.episode}, seed {r.seed}: {r.end_reason}, {r.distance_m:.1f} m)"


@dataclass(frozen=True, eq=False)
class Results:
    """A whole evaluation.

    Attributes:
        episodes: ordered by plan, seed, episode.
        aggregate: the figures, see ``metrics.aggregate_episodes``.
        plans: the floor plans, for the drawings.
        policies: card digests of the locomotor and the navigator's name.
        config: everything that the run depends on.
        wall_seconds: how long it took [s].
        videos: files that were written.
        workers: that walked it; None: it was read from a folder.
    """

    episodes: list[Episode]
    aggregate: dict[str, Any]
    plans: list[FloorPlan]
    policies: dict[str, Any]
    config: dict[str, Any]
    wall_seconds: float
    videos: list[str] = field(default_factory=list)
    workers: int | None = None

    @property
    def records(self) -> list[EpisodeRecord]:
        """The records alone."""
        return [episode.record for episode in self.episodes]

    def __repr__(self) -> str:
        who = " + ".join(str(policy["name"]) for policy in self.policies.values())
        n, plans = len(self.episodes), len(self.plans)
        success = 100 * self.aggregate["success"]["mean"]
        walked = f"{count_things(n, 'episode')} in {count_things(plans, 'floor plan')}"
        return f"Results({who}: {walked}, success {success:.1f} %)"

    def _repr_html_(self) -> str:
        """Means by floor plan."""
        titles = ("floor plan", "episodes", "success [%]", "SPL", "distance [m]", "time [s]", "falls")
        rows = []
        for name in [*dict.fromkeys(r.plan for r in self.records), "all"]:
            those = [r for r in self.records if name in (r.plan, "all")]
            means = np.mean([(100 * r.success, r.spl, r.distance_m, r.time_s) for r in those], 0)
            shown = [f"{mean:.{digits}f}" for mean, digits in zip(means, (1, 3, 2, 1), strict=True)]
            rows.append((html.escape(name), str(len(those)), *shown, str(sum(r.fell for r in those))))
        head = "".join(f"<th>{title}</th>" for title in titles)
        body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
        return f"<p>{html.escape(repr(self))}</p><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def plain_record(record: EpisodeRecord) -> dict[str, Any]:
    """A record as plain data, numbers rounded to six digits after the point."""
    return round_numbers(asdict(record))
