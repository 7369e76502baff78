"""``vinl eval --table``: rows side by side, rows left out, tables put together."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from vinl.benchmark.table import TableConfig
from vinl.cli.app import main
from vinl.config.loader import load_config
from vinl.policies.io import save_policy
from vinl.policies.policy import LocomotionPolicy

COMMON = (
    "--table --table-file rows.yaml --floorplans harbour_flat --episodes 2 --seeds 2 --workers 1 --set time_limit=0.3"
)


@pytest.fixture
def rows(standing: LocomotionPolicy, trotting: LocomotionPolicy) -> None:
    """A table of two robots that are there and one that is not."""
    for policy in (standing, trotting):
        save_policy(policy.card.name, policy.network, policy.card)
    paper = {"success": [73.6, 5.85], "distance_m": [8.19, 0.34], "foot_collisions_per_m": [12.08, 0.72]}
    table = {
        "reference": "trotting",
        "rows": {
            "standing": {"title": "It stands", "loco": "standing", "nav": "oracle", "obstacles": "paper"},
            "trotting": {
                "title": "It <trots>",
                "loco": "trotting",
                "nav": "oracle",
                "obstacles": "paper",
                "paper": paper,
            },
            "bare": {"title": "No clutter", "loco": "trotting", "nav": "oracle", "obstacles": "none"},
            "dreaming": {"title": "Not trained", "loco": "vinl/not_there", "nav": "oracle"},
        },
    }
    Path("rows.yaml").write_text(yaml.safe_dump(table, sort_keys=False))


def read(folder: str) -> dict:
    data = json.loads((Path(folder) / "results.json").read_text())
    del data["timing"]
    return data


@pytest.mark.usefixtures("rows")
def test_rows_side_by_side(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", *COMMON.split(), "--out", "table"]) == 0
    said = capsys.readouterr().out
    assert "left out: row dreaming: policy vinl/not_there is not shipped with this version" in said
    data = read("table")
    assert list(data["rows"]) == ["standing", "trotting", "bare"] and list(data["left_out"]) == ["dreaming"]
    assert data["rows"]["trotting"]["paper"]["success"] == [73.6, 5.85]
    assert data["rows"]["bare"]["by_plan"]["harbour_flat"]["episodes"] == 4
    pairs = {(c["one"], c["other"]): c for c in data["comparisons"]}
    assert pairs["standing", "trotting"]["same_clutter"] and not pairs["trotting", "bare"]["same_clutter"]
    assert "episodes" not in data and len(Path("table/results.json").read_bytes()) < 60_000
    page = Path("table/report.html").read_text().replace("<!DOCTYPE html>\n", "")
    ids = {element.get("id") for element in ET.fromstring(page).iter()}
    assert {"table", "row-standing", "row-bare", "failures", "compared", "left-out", "command"} <= ids
    for name in data["rows"]:
        assert (Path("table") / name / "report.html").exists()
    # drawn again from its folder, and put together from two tables of different rows
    assert main(["report", "table", "--out", "again"]) == 0
    assert read("again") == data
    for names in (["standing"], ["trotting", "bare"]):
        assert main(["eval", *COMMON.split(), "--out", f"only_{names[0]}", "--rows", *names]) == 0
    assert main(["report", "only_standing", "only_trotting", "--out", "both", "--reference", "trotting"]) == 0
    assert {**read("both"), "command": 0, "left_out": 0} == {**data, "command": 0, "left_out": 0}
    capsys.readouterr()
    # the same folder again: nothing is walked; another kind of evaluation is refused
    assert main(["eval", *COMMON.split(), "--out", "table"]) == 0
    assert read("table") == data
    assert main(["eval", "--out", "table", "--loco", "standing", "--set", "time_limit=0.1"]) == 2
    assert "holds a table" in capsys.readouterr().err


@pytest.mark.usefixtures("rows")
def test_chosen_rows_and_what_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", *COMMON.split(), "--rows", "bare", "--out", "bare"]) == 0
    assert list(read("bare")["rows"]) == ["bare"] and not read("bare")["comparisons"]
    capsys.readouterr()
    for more, words in (
        ("--strict", "row dreaming: policy vinl/not_there"),
        ("--rows dreaming", "row dreaming: policy vinl/not_there"),
        ("--rows standig", "did you mean 'standing'"),
        ("--loco standing", "--loco does not go with --table"),
        ("--obstacles none", "--obstacles does not go with --table"),
        ("--nav nobody", "unknown navigator"),
        ("--table-file nowhere.yaml", "nowhere.yaml"),
    ):
        code = main(["eval", *COMMON.split(), "--out", "refused", *more.split()])
        if more == "--nav nobody":  # only learned navigators are replaced, and no row has one
            assert code == 0
            continue
        error = capsys.readouterr().err
        assert code == 2 and error.startswith("error: ") and error.count("\n") == 1 and words in error
    assert main(["eval", "--out", "x", "--rows", "blind"]) == 2


def test_the_shipped_table() -> None:
    table = load_config(TableConfig, "eval/table")
    assert len(table.rows) == 11 and table.reference == "vinl"
    paper = [row for row in table.rows.values() if row.paper is not None]
    assert len(paper) == 6 and all(row.nav == "vinl/nav" for row in paper)
    assert sum(row.nav == "oracle" for row in table.rows.values()) == 3
    assert [name for name, row in table.rows.items() if row.recovery] == ["vinl_recovery"]
    with_oracle = table.choose((), "oracle")
    assert len(with_oracle.rows) == 7  # rows that differ in the navigator alone stand once
    assert with_oracle.reference == "vinl"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"reference": "vinyl"}, "did you mean 'vinl'"),
        ({"rows": {}}, "at least one row"),
        ({"rows": {"vinl": {"title": "a", "loco": "b", "nav": "c", "obstacles": "papr"}}}, "did you mean 'paper'"),
        ({"rows": {"../vinl": {"title": "a", "loco": "b", "nav": "c"}}}, "small letters"),
        ({"rows": {"vinl": {"title": "a", "loco": "b", "nav": "c", "colour": "red"}}}, "colour"),
    ],
)
def test_a_broken_table(change: dict, words: str) -> None:
    whole = {"reference": "vinl", "rows": {"vinl": {"title": "a", "loco": "b", "nav": "c"}}}
    Path("broken.yaml").write_text(yaml.safe_dump(whole | change))
    with pytest.raises(ValueError, match=words):
        load_config(TableConfig, "broken.yaml")
