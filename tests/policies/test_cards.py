"""The shipped cards agree with themselves, with each other and with the walked table."""

import json
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
CARDS = {path.parent.name: json.loads(path.read_text()) for path in sorted(ROOT.glob("assets/policies/*/card.json"))}
ROWS: dict[str, dict[str, Any]] = {
    name: row
    for path in (ROOT / "docs" / "results").glob("*.json")
    for name, row in json.loads(path.read_text())["rows"].items()
}
DIGESTS = {
    policy["name"]: policy["weights_sha256"]
    for row in ROWS.values()
    for policy in row["policies"].values()
    if "weights_sha256" in policy
}
MEASURED = [
    (name, group, row)
    for name, card in CARDS.items()
    for group, figures in card["evaluation"].items()
    for _, found, row in [figures["command"].partition(", row ")]
    if found
]


@pytest.mark.parametrize("name", CARDS)
def test_lineage_adds_up_and_ends_with_the_training_of_the_card(name: str) -> None:
    card, training = CARDS[name], CARDS[name]["training"]
    lineage = training["lineage"]
    assert training["total_samples"] == sum(part["samples"] for part in lineage)
    assert (lineage[-1]["samples"], lineage[-1]["commit"]) == (card["samples"], card["commit"])
    if name in DIGESTS:
        assert lineage[-1]["weights_sha256"] == DIGESTS[name]


def test_two_cards_say_the_same_of_one_training() -> None:
    said: dict[str, dict[str, Any]] = {}
    for card in CARDS.values():
        for part in card["training"]["lineage"]:
            assert said.setdefault(part["training"], part) == part


def test_origin_is_what_the_card_of_that_policy_says() -> None:
    origin = CARDS["loco"]["training"]["origin"]
    assert origin["policy"] == "vinl/teacher"
    assert (origin["samples"], origin["commit"]) == (CARDS["teacher"]["samples"], CARDS["teacher"]["commit"])


def test_policies_of_the_table_have_its_figures_on_their_cards() -> None:
    told = {(name, row) for name, _, row in MEASURED}
    assert {("nav", "vinl"), ("nav", "vinl_no_clutter"), ("loco", "vinl"), ("loco", "vinl_oracle")} <= told
    assert {("teacher", "teacher"), ("teacher", "teacher_oracle"), ("loco", "vinl_no_clutter_oracle")} <= told


@pytest.mark.parametrize(("name", "group", "row"), MEASURED)
def test_figures_of_the_chain_are_those_of_the_table(name: str, group: str, row: str) -> None:
    figures, walked = CARDS[name]["evaluation"][group], ROWS[row]["aggregate"]
    for metric, value in figures.items():
        if metric != "command":
            mean = walked[metric]["mean"] if isinstance(walked[metric], dict) else walked[metric]
            assert value == pytest.approx(mean, abs=1e-6), metric
