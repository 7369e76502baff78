"""Policy folders: what is written comes back, what is broken says so in one line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import torch

from vinl.config.errors import InputError
from vinl.policies.card import locomotion_card
from vinl.policies.io import WEIGHTS_FILE, find_policy, list_policies, load_policy, save_policy
from vinl.policies.networks import StepActor


def small_actor() -> StepActor:
    torch.manual_seed(0)
    return StepActor(actor=(16,))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    network = small_actor()
    return save_policy(
        tmp_path / "mine", network, locomotion_card("mine", network.describe(), gait={}, seed=3, samples=10)
    )


def edit_card(folder: Path, **changes: object) -> None:
    path = folder / "card.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_policy_comes_back(folder: Path):
    policy = load_policy(folder)
    observation = torch.randn(5, 111)
    torch.testing.assert_close(policy.act(observation), small_actor()(observation), rtol=0, atol=0)
    assert (policy.card.name, policy.card.seed, policy.card.samples) == ("mine", 3, 10)
    assert policy.card.action["scale"] == 0.25


def test_half_precision_weights_are_smaller_and_act_alike(folder: Path):
    network = small_actor()
    half = save_policy(folder.parent / "half", network, locomotion_card("half", network.describe(), gait={}), half=True)
    assert (half / WEIGHTS_FILE).stat().st_size < 0.7 * (folder / WEIGHTS_FILE).stat().st_size
    observation = np.linspace(-1, 1, 222, dtype=np.float32).reshape(2, 111)
    np.testing.assert_allclose(load_policy(half).act(observation), load_policy(folder).act(observation), atol=2e-3)


def test_loading_leaves_the_random_numbers_alone(folder: Path):
    torch.manual_seed(5)
    before, threads = torch.get_rng_state(), torch.get_num_threads()
    load_policy(folder)
    assert torch.equal(before, torch.get_rng_state())
    assert torch.get_num_threads() == threads


def test_saving_again_replaces_and_leaves_nothing_behind(folder: Path):
    network = small_actor()
    save_policy(folder, network, locomotion_card("second", network.describe(), gait={}))
    assert load_policy(folder).card.name == "second"
    assert [p.name for p in folder.parent.iterdir()] == ["mine"]


def test_saving_fails_whole(folder: Path, monkeypatch: pytest.MonkeyPatch):
    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("vinl.policies.io.save_file", fail)
    network = small_actor()
    with pytest.raises(OSError, match="disk full"):
        save_policy(folder, network, locomotion_card("second", network.describe(), gait={}))
    assert load_policy(folder).card.name == "mine"
    assert [p.name for p in folder.parent.iterdir()] == ["mine"]


def test_saving_refuses_a_folder_of_other_things(tmp_path: Path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").touch()
    network = small_actor()
    with pytest.raises(InputError, match=r"holds chapter\.tex"):
        save_policy(tmp_path / "thesis", network, locomotion_card("x", network.describe(), gait={}))


def test_run_folder_leads_to_its_policy(folder: Path):
    run = folder.parent / "run"
    run.mkdir()
    folder.rename(run / "policy")
    assert load_policy(run).card.name == "mine"


def test_shipped_names(tmp_path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("vinl.policies.io.assets_dir", lambda: tmp_path / "assets")
    (tmp_path / "assets" / "policies").mkdir(parents=True)
    folder.rename(tmp_path / "assets" / "policies" / "rough")
    assert list_policies() == ["rough"]
    assert find_policy("vinl/rough") == find_policy("rough")
    with pytest.raises(InputError, match=r"unknown policy 'vinl/ruogh', did you mean 'rough'\?; shipped: rough"):
        load_policy("vinl/ruogh")


def test_bad_policies(folder: Path, tmp_path: Path):
    def refused(pattern: str) -> None:
        with pytest.raises(InputError, match=pattern) as caught:
            load_policy(folder)
        assert "\n" not in str(caught.value)

    card = json.loads((folder / "card.json").read_text())
    weights = (folder / WEIGHTS_FILE).read_bytes()

    edit_card(folder, network=card["network"] | {"actor": [18]})
    refused(r"actor\.0\.\w+ is \(18(, 111)?,?\) by card\.json and \(16(, 111)?,?\) in policy\.safetensors")
    edit_card(folder, network=card["network"] | {"class": "StepActr"})
    refused("unknown network class 'StepActr', did you mean 'StepActor'")
    edit_card(folder, network=card["network"] | {"class": "MapActor"})  # of versions that had a height scan
    refused("unknown network class 'MapActor'")
    edit_card(folder, network=card["network"] | {"layers": 3})
    refused("StepActor cannot be built")
    edit_card(folder, network=card["network"] | {"actor": [10**12, 10**12]})
    refused(r"does not fit the weights: actor\.\d\.\w+ is \(1000000000000|cannot be built")
    edit_card(folder, network=card["network"] | {"actor": [0]})
    refused("must be a positive whole number, got 0")
    edit_card(folder, network=card["network"], observation=card["observation"][:-1])
    refused("network takes 111 numbers, the observation table has 109")
    edit_card(folder, observation=[card["observation"][0] | {"scale": [1.0]}, *card["observation"][1:]])
    refused("'base_linear_velocity'.* is not what this version fills")
    edit_card(folder, observation=card["observation"], kind="navigation")
    refused("is a navigation policy")
    edit_card(folder, kind="flying")
    refused(r"card.json: kind must be .*'locomotion'")
    edit_card(folder, kind="locomotion", colour="red")
    refused("card.json: unknown key 'colour'")
    (folder / "card.json").write_text(json.dumps(card | {"schema": 99}))
    refused("schema 99 is not known")
    (folder / "card.json").write_text("{")
    refused("card.json is not valid JSON")
    (folder / "card.json").write_text("[]")
    refused("must hold a JSON object")
    (folder / "card.json").unlink()
    refused("is no policy folder: card.json is missing")
    (folder / "card.json").write_text(json.dumps(card))

    for cut in (0, 4, 100, len(weights) // 2, len(weights) - 1):
        (folder / WEIGHTS_FILE).write_bytes(weights[:cut])
        refused("policy.safetensors is broken or cut off")
    (folder / WEIGHTS_FILE).unlink()
    refused("policy.safetensors is missing")


def test_weights_that_are_not_finite_are_refused(folder: Path):
    from safetensors.torch import load_file, save_file

    weights = load_file(folder / WEIGHTS_FILE)
    weights["actor.0.bias"][1] = float("nan")
    save_file(weights, folder / WEIGHTS_FILE)
    with pytest.raises(InputError, match=r"'actor\.0\.bias' are not finite"):
        load_policy(folder)
    del weights["actor.0.bias"]
    save_file(weights, folder / WEIGHTS_FILE)
    with pytest.raises(InputError, match=re.escape("needs weights 'actor.0.bias'")):
        load_policy(folder)
    network = small_actor()
    with torch.no_grad():
        network.actor[0].bias[0] = float("inf")  # type: ignore[index]
    with pytest.raises(InputError, match="not finite"):
        save_policy(folder.parent / "bad", network, locomotion_card("bad", network.describe(), gait={}))
    assert not (folder.parent / "bad").exists()


def test_device_that_is_not_there(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InputError, match="no CUDA device is available"):
        load_policy(folder, device="cuda")
    with pytest.raises(InputError, match="unknown device 'gpu'"):
        load_policy(folder, device="gpu")
