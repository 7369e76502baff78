"""README and how-to pages: their Python runs, the index leads to every page, all public names are documented."""

import re
from pathlib import Path

import pytest

import vinl

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TAUGHT = [
    page for page in PAGES if page.stem in ("README", "index", "navigation", "robot") or page.stem.startswith("howto_")
]
SLOW = {"README", "howto_floorplan", "howto_gymnasium", "howto_own_policy", "howto_train"}  # they walk, or train


def find_code(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[pytest.mark.slow] if p.stem in SLOW else []) for p in TAUGHT], ids=lambda p: p.stem
)
def test_python_on_the_page_runs(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict = {"__name__": "page"}
    for number, code in enumerate(find_code(page)):
        exec(compile(code, f"{page.name}[{number}]", "exec"), names)
    assert find_code(page)
    if page.stem == "README":
        assert re.search(r"success [6-8]\.\d m", capsys.readouterr().out) and Path("path.png").stat().st_size > 10_000


def test_index_leads_to_every_page() -> None:
    index = (ROOT / "docs" / "index.md").read_text()
    assert not [page.name for page in PAGES[1:] if page.stem != "index" and f"({page.name})" not in index]
    assert not [book.name for book in (ROOT / "notebooks").glob("*.ipynb") if f"{book.name})" not in index]


def test_public_names_are_documented() -> None:
    page = (ROOT / "docs" / "api.md").read_text()
    assert not [name for name in vinl.__all__ if not re.search(rf"`{name}\b", page)]
    for name in re.findall(r"^\| `(\w+)\(", page, re.MULTILINE):
        assert name in vinl.__all__
