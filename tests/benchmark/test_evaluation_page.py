"""The navigator on docs/howto_own_policy.md walks."""

import re
from pathlib import Path

import numpy as np

from vinl.benchmark.evaluate import evaluate
from vinl.chain.config import EvaluationConfig
from vinl.world.floorplan import FloorPlan

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "howto_own_policy.md").read_text()


def test_navigator_on_the_page(two_rooms: FloorPlan) -> None:
    code = next(block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "class Careful" in block)
    names: dict = {"__name__": "page"}
    exec(code, names)
    config = EvaluationConfig(time_limit=30.0, min_distance=2.0, success_radius=1.0)
    results = evaluate([two_rooms], "rough", names["Careful"](), episodes=1, seeds=1, config=config)
    assert results.policies["navigation"] == {"name": "Careful"}
    assert np.isfinite(results.records[0].distance_m) and results.records[0].distance_m > 1.0
