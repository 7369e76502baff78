"""docs/policies.md says what the code does."""

import re
from pathlib import Path

import numpy as np

import vinl
from vinl.robot.observation import TABLE

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "policies.md").read_text()


def test_observation_table_is_that_of_the_code():
    rows = re.findall(r"^\| (\d+) \| .* \| (.*) \| ([\d., ]+) \|$", PAGE, re.MULTILINE)
    said = [(int(size), unit, tuple(float(x) for x in scale.split(","))) for size, unit, scale in rows]
    assert said == [(term.size, term.unit, term.scale) for term in TABLE]


def test_code_on_the_page_runs(tmp_path: Path):
    use, save, see = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names = {"vinl": vinl}
    exec(save, names)
    assert (tmp_path / "my_policy" / "card.json").exists()
    exec(use.replace("vinl/rough", "my_policy"), names)
    exec(see, names)
    assert vinl.load_policy("moth").camera == names["camera"]
    assert isinstance(names["actions"], np.ndarray) and names["actions"].shape == (8, 12)
