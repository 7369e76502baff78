"""``results.json``: everything that was measured and what is needed to repeat it; written whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vinl.benchmark.metrics import aggregate_episodes
from vinl.chain.records import Results, plain_record
from vinl.config.output import SCHEMA
from vinl.config.versions import describe_environment


def results_as_dict(results: Results, command: Sequence[str]) -> dict[str, Any]:
    """Results as plain data. Two runs with the same seed differ in ``timing`` and ``aggregate.wall_seconds`` only."""
    records = results.records
    min_metres = results.config["evaluation"]["min_metres"]
    plans = [
        {
            "name": plan.name,
            "source": plan.source,
            "area_m2": round(plan.area_m2, 2),
            "aggregate": aggregate_episodes([r for r in records if r.plan == plan.name], min_metres),
        }
        for plan in results.plans
    ]
    wall = round(results.wall_seconds, 2)
    return {
        "schema": SCHEMA,
        "command": list(command),
        "config": results.config,
        "policies": results.policies,
        "environment": describe_environment(),
        "plans": plans,
        "aggregate": {**results.aggregate, "wall_seconds": wall},
        "episodes": [plain_record(r) for r in records],
        "timing": {"wall_seconds": wall, "workers": results.workers},
    }
