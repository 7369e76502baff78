"""The notebooks run from start to end, and what a cell ends with can be shown."""

import ast
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from run_notebooks import digest_code

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
SAID = {"first_steps": "success: 6.6 m", "your_own_policy": "m to go", "training": "trained on 96 samples"}


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
        run_cell("".join(cell["source"]), f"{path.name}[{number}]", names)
    assert SAID[path.stem] in capsys.readouterr().out


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_show_what_their_code_gave(path: Path) -> None:
    """Outputs are kept with the digest of the code that gave them; ``scripts/run_notebooks.py`` writes both."""
    notebook = json.loads(path.read_text())
    assert notebook["metadata"]["code"] == digest_code(notebook), "run scripts/run_notebooks.py"
    outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", [])]
    assert outputs and all(output["output_type"] != "error" for output in outputs)
    shown = json.dumps(outputs)
    assert SAID[path.stem] in shown and "image/png" in shown and "Traceback" not in shown
    assert not re.search(r"/(tmp|root|work|home)/", shown), "no place of this machine"
    assert path.stat().st_size < 3_000_000


def test_notebooks_hold_a_film_and_tables() -> None:
    whole = "".join(path.read_text() for path in NOTEBOOKS)
    assert "data:video/mp4;base64," in whole and whole.count("<table") >= 4


def test_notebooks_need_nothing_that_their_extra_leaves_out() -> None:
    """Of what cells import, and what they train with."""
    project = tomllib.loads((NOTEBOOKS[0].parents[1] / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert "vinl[train]" in extras["notebooks"]
    wanted = [*project["dependencies"], *extras["train"], *extras["notebooks"]]
    installed = {re.split(r"[^\w-]", package)[0].lower() for package in wanted} | {"pil"}  # pillow
    for path in NOTEBOOKS:
        code = "\n".join(
            "".join(c["source"]) for c in json.loads(path.read_text())["cells"] if c["cell_type"] == "code"
        )
        named = set(re.findall(r"^(?:import|from) (\w+)", code, re.MULTILINE))
        assert {name.lower() for name in named} - set(sys.stdlib_module_names) <= installed, path.name


def test_there_are_notebooks() -> None:
    assert [path.stem for path in NOTEBOOKS] == sorted(SAID)
