"""The notebooks run from start to end, and what a cell ends with can be shown."""

import ast
import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
SAID = {"first_steps": "success: 7.0 m", "your_own_policy": "m to go", "training": "trained on 96 samples"}


def run_cell(source: str, name: str, names: dict) -> None:
    """Run a cell and show its last expression as a notebook does."""
    tree = ast.parse(source, name)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, name, "exec"), names)
    if isinstance(last, ast.Expr):
        value = eval(compile(ast.Expression(last.value), name, "eval"), names)
        shown = [show() for kind in ("html", "png") if (show := getattr(value, f"_repr_{kind}_", None)) is not None]
        assert all(shown) and repr(value)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    names: dict = {"__name__": "notebook"}
    for number, cell in enumerate(cells):
        assert not cell["outputs"], "clear the outputs before committing"
        run_cell("".join(cell["source"]), f"{path.name}[{number}]", names)
    assert SAID[path.stem] in capsys.readouterr().out


def test_there_are_notebooks() -> None:
    assert [path.stem for path in NOTEBOOKS] == sorted(SAID)
