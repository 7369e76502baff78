"""The pages hold to the tree: links, anchors, pictures, paths and commands, and one description everywhere."""

import importlib
import json
import re
import shlex
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

import pytest

import vinl
from vinl.cli import app, options
from vinl.config.errors import InputError

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
RESEARCH = sorted((ROOT / "docs" / "research").glob("*.md"))
PAGES = [*REFERENCE, *RESEARCH, ROOT / "CHANGELOG.md"]
NAME = lambda page: page.stem  # noqa: E731


@lru_cache
def anchors(page: Path) -> set[str]:
    """The anchors that a code host makes of a page's headings."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    kept = [re.sub(r"[^\w\- ]", "", title.lower()) for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
    return {title.strip().replace(" ", "-") for title in kept}


@pytest.mark.parametrize("page", PAGES, ids=NAME)
def test_links_and_pictures_lead_somewhere(page: Path) -> None:
    broken = []
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if "://" in link:
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            broken.append(link)
    assert not broken


@pytest.mark.parametrize("page", REFERENCE, ids=NAME)
def test_files_that_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"(?:`|python )((?:vinl|scripts|configs|assets|tests|examples)/[\w./-]+)", page.read_text())
    shipped = {f"vinl/{folder.name}" for folder in (ROOT / "assets" / "policies").iterdir()}
    missing = [name for name in named if not (ROOT / name).exists() and name not in shipped]
    assert not [name for name in missing if not name.startswith(("vinl/Home-v", "vinl/Nav-v", "vinl/floorplan"))]


def test_every_package_is_on_the_page_of_the_layout() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text()
    packages = [path.parent.name for path in (ROOT / "vinl").glob("*/__init__.py")]
    assert len(packages) > 10 and not [name for name in packages if f"`vinl/{name}`" not in page]
    layers = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][0]["layers"]
    drawn = page.split("```mermaid")[1].split("```")[0]
    for layer in layers:  # packages of one layer share a box
        names = [name.removeprefix("vinl.") for name in layer.split(" | ")]
        assert " · ".join(names) in drawn, layer


def test_index_of_the_log_leads_to_every_page_of_it() -> None:
    index = (ROOT / "docs" / "research" / "README.md").read_text()
    pages = [page.name for page in RESEARCH if page.name != "README.md"]
    assert pages and not [name for name in pages if f"({name})" not in index]
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d-[a-z0-9-]+\.md", name) for name in pages)


class OptionsReadError(Exception):
    """A command understood its options, and would begin now."""


def commands(page: Path) -> list[tuple[str, bool]]:
    """Every ``vinl ...`` of a page: whole ones of its shell blocks, and inline code, which may leave options out."""
    text = page.read_text()
    blocks = "\n".join(re.findall(r"```sh\n(.*?)```", text, re.DOTALL)).replace("\\\n", " ")
    lines = [(line, True) for line in blocks.splitlines() if line.startswith("vinl ")]
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    inline = [(line, False) for line in re.findall(r"`(vinl [a-z-]+ [^`\n]+)`", prose)]
    return [(line, whole) for line, whole in lines + inline if "..." not in line]


@pytest.mark.parametrize("page", REFERENCE, ids=NAME)
def test_commands_on_the_page_have_the_options_that_it_gives(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = options.parse_options

    def parse(*args: Any) -> NoReturn:
        real(*args)
        raise OptionsReadError

    modules = {name: importlib.import_module(module) for name, (module, _) in app.COMMANDS.items()}
    for module in (options, *modules.values()):
        if hasattr(module, "parse_options"):
            monkeypatch.setattr(module, "parse_options", parse)
    for line, whole in commands(page):
        words = shlex.split(line, comments=True)[1:]
        assert words[0] in modules, line
        try:
            pytest.fail(f"{line}: ended with {modules[words[0]].main(words[1:])!r} and read no options")
        except OptionsReadError:
            continue
        except InputError as error:
            if whole or not str(error).startswith("Missing"):
                pytest.fail(f"{line}: {error}")


def test_index_has_every_command() -> None:
    index = (ROOT / "docs" / "index.md").read_text()
    assert not [name for name in app.COMMANDS if f"| `vinl {name}` |" not in index]


def test_one_description_everywhere() -> None:
    said = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["description"]
    assert said and f"{said}." in app._help()
    assert (vinl.__doc__ or "").startswith(f"{said}.")
    first = json.loads((ROOT / "notebooks" / "first_steps.ipynb").read_text())["cells"][0]["source"]
    for text in ((ROOT / "README.md").read_text(), (ROOT / "docs" / "index.md").read_text(), "".join(first)):
        assert f"{said}." in text


def test_table_on_the_page_is_the_walked_one() -> None:
    """Success, SPL and both counts of collisions of every row, as the files of docs/results have them."""
    page = (ROOT / "docs" / "results.md").read_text()
    files = [
        json.loads((ROOT / "docs" / "results" / f"{name}.json").read_text())
        for name in ("table", "oracle", "teacher", "teacher_oracle")
    ]
    walked = [row for file in files for row in file["rows"].values()]
    rows = [line for line in page.splitlines() if re.match(r"\| \**`\w+` \+ ", line)]
    assert len(rows) == len(walked)
    for line, row in zip(rows, walked, strict=True):
        cells, metrics = [cell.strip() for cell in line.strip("|").split("|")], row["aggregate"]
        legs, guide = row["policies"]["locomotion"]["name"], row["policies"]["navigation"]["name"]
        assert f"`{legs}` + " in cells[0] and guide in cells[0] and cells[1] == f"`{row['obstacles']}`"
        assert abs(float(cells[2].split()[0]) - 100 * metrics["success"]["mean"]) < 0.051
        assert abs(float(cells[3]) - metrics["spl"]["mean"]) < 0.00051
        for cell, name in zip(
            cells[4:7], ("paper_foot_collisions_per_m", "foot_collisions_per_m", "leg_contacts_per_m"), strict=True
        ):
            value = metrics[name]["mean"]
            assert abs(float(cell.split()[0]) - value) < (0.051 if value >= 1 else 0.0051)
