"""docs/policies.md and the observation table of docs/robot.md say what the code does."""

import re
from pathlib import Path

import numpy as np

import vinl
from vinl.robot.observation import TABLE

PAGE = Path(__file__).resolve().parents[2] / "docs" / "policies.md"


def test_observation_table_is_that_of_the_code():
    page = PAGE.with_name("robot.md").read_text()
    rows = re.findall(r"^\| (\w+) \| (\d+) \| (.*) \| ([\d., ]+) \| ([\d.]+) \|$", page, re.MULTILINE)
    said = [
        (name, int(size), tuple(float(x) for x in scale.split(",")), float(noise))
        for name, size, _, scale, noise in rows
    ]
    assert said == [(term.name, term.size, term.scale, term.noise) for term in TABLE]
    for (_, _, unit, _, _), term in zip(rows, TABLE, strict=True):
        assert set(term.unit.split(", ")) <= set(re.split(r"[,:]? ", unit))


def test_code_on_the_page_runs(tmp_path: Path):
    use, save, see = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    names = {"vinl": vinl}
    exec(save, names)
    assert (tmp_path / "my_policy" / "card.json").exists()
    exec(use.replace("vinl/rough", "my_policy"), names)
    exec(see, names)
    assert vinl.load_policy("moth").camera == names["camera"]
    assert isinstance(names["actions"], np.ndarray) and names["actions"].shape == (8, 12)
