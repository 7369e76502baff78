"""Where robots walk, by which rules: what all rows of a table have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from vinl.benchmark.routes import describe_routes
from vinl.benchmark.work import Row
from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes
from vinl.config.loader import dump_config
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal

Films = Literal["none", "first", "all"]


@dataclass(frozen=True, eq=False)
class Protocol:
    """What all rows of a table have in common.

    Attributes:
        plans: where they walk; names differ, see ``name_apart``.
        episodes: start/goal pairs a plan; the same for all seeds.
        seeds: repetitions; a seed changes clutter, heading and joint angles at the start.
        config: limits and rules.
        films: which episodes are filmed: none, the first of every plan, or all of the first seed.
        record: keep the poses of all episodes in files, see ``recordings``.
        routes: start/goal pairs of one's own for every plan, ``episodes`` each, see ``routes``; None: they are drawn.
    """

    plans: Sequence[FloorPlan]
    episodes: int = 10
    seeds: range = range(5)
    config: EvaluationConfig = field(default_factory=EvaluationConfig)
    films: Films = "none"
    routes: Mapping[str, Sequence[StartGoal]] | None = None
    record: bool = False

    def describe(self, row: Row) -> dict[str, Any]:
        """What the episodes of a row depend on, as plain data."""
        return {
            "evaluation": dump_config(row.apply(self.config)),
            "obstacles": {"preset": row.obstacles, **asdict(CLUTTER[row.obstacles])},
            "episodes_per_plan": self.episodes,
            "seeds": list(self.seeds),
            **({} if self.routes is None else {"routes": describe_routes(self.routes)}),
        }

    def find_routes(self, plan: FloorPlan) -> list[StartGoal]:
        """The start/goal pairs of a plan."""
        if self.routes is None:
            return draw_routes(plan, self.episodes, self.config)
        return list(self.routes[plan.name])
