"""The notebooks run from start to end."""

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    names: dict = {"__name__": "notebook"}
    for number, cell in enumerate(cells):
        assert not cell["outputs"], "clear the outputs before committing"
        exec(compile("".join(cell["source"]), f"{path.name}[{number}]", "exec"), names)
    if path.stem == "first_steps":
        assert capsys.readouterr().out.count("success: ") == 2


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS
