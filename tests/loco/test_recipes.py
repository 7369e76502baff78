"""One command per policy: every config can be trained, and a card's training is its YAML."""

import re
from dataclasses import asdict
from pathlib import Path

import pytest

from vinl.cli.train_loco import STAGES
from vinl.config.loader import build_config, dump_config, load_config
from vinl.loco.config import LocoConfig, LocoPpoConfig
from vinl.policies.io import list_policies, load_policy
from vinl.world.terrain import build_terrain

ROOT = Path(__file__).resolve().parents[2]
CONFIGS = sorted(path.stem for path in (ROOT / "configs" / "loco").glob("*.yaml"))
SCRIPT = (ROOT / "scripts" / "reproduce.sh").read_text()


@pytest.mark.parametrize("name", CONFIGS)
def test_every_config_can_be_built(name: str) -> None:
    config = load_config(LocoConfig, f"loco/{name}")
    kinds = set(config.terrain.column_kinds())
    assert kinds == {
        kind for kind, part in config.terrain.fractions().items() if part > 0
    }  # none is too small to occur
    small = load_config(LocoConfig, f"loco/{name}", ["terrain.levels=2", "terrain.columns=20"])
    assert set(build_terrain(small.terrain).kinds) == kinds
    assert config.terrain.ghost == 0 or config.stage == 2


def test_rows_of_the_table_differ_by_what_their_names_say() -> None:
    configs = {name: load_config(LocoConfig, f"loco/{name}") for name in CONFIGS}
    teacher, student = configs["teacher"], configs["student"]
    late = {"noise_from": (0.0, 0.0), "start_xy": 0.0}
    for config in configs.values():
        assert asdict(config.randomisation) | late == asdict(teacher.randomisation) | late
        assert (config.ppo.actor, config.kp, config.kd) == (teacher.ppo.actor, teacher.kp, teacher.kd)
    for name in ("blind", "no_pretraining"):
        same = ("num_envs", "iterations", "terrain", "commands", "rewards", "randomisation", "curriculum", "anneal")
        assert all(getattr(configs[name], field) == getattr(teacher, field) for field in same)
    assert (configs["mlp"].num_envs, configs["mlp"].iterations) == (student.num_envs, student.iterations)


def test_the_script_trains_every_config_in_order_and_says_for_how_long() -> None:
    commands = re.findall(r"^train loco (\w+) (.*?)  +# +(\d+) M +([\d.]+) min$", SCRIPT, re.MULTILINE)
    assert [name for name, *_ in commands] == ["rough", "teacher", "student", "blind", "no_pretraining", "mlp"]
    assert sorted(name for name, *_ in commands) == CONFIGS
    trained: set[str] = set()
    for name, options, millions, minutes in commands:
        stage, config = re.search(r"--stage (\d)", options), re.search(r"--config (\S+)", options)
        source = config.group(1) if config else STAGES[int(stage.group(1))] if stage else ""
        assert source == f"loco/{name}"
        loaded = load_config(LocoConfig, source)
        begun = re.search(r'--from "\$runs/(\w+)"', options)
        assert (begun.group(1) if begun else None) == loaded.from_policy
        assert begun is None or begun.group(1) in trained
        trained.add(name)
        steps = loaded.ppo.steps if loaded.student is None else loaded.student.distillation.steps
        samples = loaded.num_envs * loaded.iterations * steps
        assert round(samples / 1e6) == int(millions)
        speed = 70_000 if loaded.stage == 3 else 260_000
        assert round(samples / speed / 60, 1) == float(minutes)


def test_the_learning_rate_cools_to_its_last() -> None:
    ppo = LocoPpoConfig(cool_from=0.6, cool_rates=(3e-4, 1e-5))
    assert [ppo.highest_rate(f) for f in (0.0, 0.59)] == [None, None]
    assert [ppo.highest_rate(f) for f in (0.6, 0.8, 1.0)] == pytest.approx([3e-4, 1.55e-4, 1e-5])
    assert LocoPpoConfig().highest_rate(1.0) is None


RECORD = ("origin", "lineage", "total_samples")
"""What a card says of a training beside its settings."""


def trainings() -> list[str]:
    """Shipped policies that the recipes here trained: those with a gait, of the card or of the network."""
    cards = {name: load_policy(name).card for name in list_policies()}
    return [n for n, c in cards.items() if c.kind == "locomotion" and (c.gait or c.network.get("gait"))]


def test_the_training_of_every_shipped_card_is_its_yaml() -> None:
    """Those that ship from before there was a gait are held to nothing: no command trains them any more."""
    for name in trainings():
        card = load_policy(name).card
        config = load_config(LocoConfig, f"loco/{'student' if name == 'loco' else name}")
        given = {key: value for key, value in card.training.items() if key not in RECORD}
        built = build_config(LocoConfig, given | {"from_policy": config.from_policy}, source=name)
        assert dump_config(built) == dump_config(config), name
