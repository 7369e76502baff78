"""One command per policy: a card's training is its YAML."""

import re
from pathlib import Path

import pytest

from vinl.benchmark.journal import list_differences
from vinl.config.loader import dump_config, load_config
from vinl.nav.config import NavConfig
from vinl.policies.io import load_policy

RECORD = {"lineage", "total_samples", "ppo.compiled", "network.places", "ppo.places"}
"""What a card says beside its settings, or what makes no other policy: how the network is computed, and an output that
was off, with the weight of its loss."""


@pytest.mark.parametrize(("name", "config"), [("nav", "nav/default"), ("nav-blind", "nav/blind")])
def test_the_training_of_every_shipped_card_is_its_yaml(name: str, config: str) -> None:
    """What a card does not name was not there when it was trained, and is neutral."""
    settings, card = dump_config(load_config(NavConfig, config)), load_policy(name).card.training
    not_neutral = {at for at, *_ in list_differences(settings, dump_config(NavConfig()))}
    for at, wanted, trained in list_differences(settings, card):
        none_of_them = at.startswith("homes.layouts.") and wanted == 0
        assert at in RECORD or (trained is None and (none_of_them or at not in not_neutral)), at


def test_the_script_trains_them_on_one_gpu_with_as_many_samples() -> None:
    script = (Path(__file__).resolve().parents[2] / "scripts" / "reproduce.sh").read_text()
    commands = re.findall(r"^train nav (\S+) (.*?)  +# +(\d+) M", script, re.MULTILINE)
    assert [name for name, *_ in commands] == ["nav", "nav-blind"]
    for name, options, millions in commands:
        config = re.search(r"--config (\S+)", options)
        loaded = load_config(NavConfig, config.group(1) if config else "nav/default")
        iterations = int(re.search(r"--iterations (\d+)", options).group(1))
        samples = loaded.num_envs * iterations * loaded.ppo.steps
        assert round(samples / 1e6) == int(millions)
        assert load_policy(name).card.training["total_samples"] == pytest.approx(samples, rel=0.04)
