"""The trainings behind a policy are on its card, from the first to the last, whoever writes it."""

from dataclasses import replace
from pathlib import Path

import pytest

from vinl.policies.card import PolicyCard, locomotion_card
from vinl.policies.identity import digest_weights
from vinl.policies.io import list_policies, load_policy, save_policy
from vinl.policies.lineage import find_commit, trace_lineage
from vinl.policies.networks import StepActor


def make(name: str, samples: int, **training: object) -> tuple[StepActor, PolicyCard]:
    network = StepActor(actor=(16,))
    card = locomotion_card(
        name, network.describe(), gait={}, samples=samples, commit=f"of {name}", training=dict(training)
    )
    return network, card


def test_a_policy_that_starts_from_another_counts_both_trainings(tmp_path: Path) -> None:
    save_policy(tmp_path / "first", *make("first", 100))
    first = load_policy(tmp_path / "first")
    origin = {"policy": "first", "lineage": trace_lineage(first.card, first.network.state_dict())}
    save_policy(tmp_path / "second", *make("second", 30, origin=origin))
    second = load_policy(tmp_path / "second")
    save_policy(tmp_path / "third", *make("third", 7, origin={"lineage": trace_lineage(second.card, {})}))
    training = load_policy(tmp_path / "third").card.training
    assert [(row["training"], row["samples"]) for row in training["lineage"]] == [
        ("first", 100),
        ("second", 30),
        ("third", 7),
    ]
    assert training["total_samples"] == 137
    assert [row["weights_sha256"] for row in training["lineage"]][:2] == [
        digest_weights(first.network),
        digest_weights(second.network),
    ]
    assert second.card.training["origin"] == {"policy": "first"}  # what lay behind it stands once, under lineage


def test_a_policy_that_is_written_again_has_the_digest_of_what_is_loaded(tmp_path: Path) -> None:
    network, card = make("mine", 5)
    save_policy(tmp_path / "one", network, card)
    known = load_policy(tmp_path / "one")
    save_policy(tmp_path / "two", known.network, replace(known.card, name="other"), half=True)
    again = load_policy(tmp_path / "two")
    (row,) = again.card.training["lineage"]
    assert row["weights_sha256"] == digest_weights(again.network) != digest_weights(known.network)
    assert (row["training"], again.card.training["total_samples"]) == ("mine", 5)


def test_weights_that_no_training_made_have_no_lineage(tmp_path: Path) -> None:
    network = StepActor(actor=(16,))
    save_policy(tmp_path / "mine", network, locomotion_card("mine", network.describe(), gait={}))
    assert load_policy(tmp_path / "mine").card.training == {}


def test_shipped_digests_are_those_of_the_weights() -> None:
    for name in list_policies():
        policy = load_policy(name)
        assert policy.card.training["lineage"][-1]["weights_sha256"] == digest_weights(policy.network)


def test_code_outside_its_repository_is_told_its_commit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VINL_COMMIT", "0123abc")
    assert find_commit() == "0123abc"
