"""The prediction of a training's memory: its parts, and what they grow with."""

import json
from dataclasses import replace

import pytest

from vinl.cli.app import main
from vinl.config.loader import build_config
from vinl.nav.benchmark import predict_memory
from vinl.nav.config import NavConfig

SMALL = {
    "num_envs": 8,
    "homes": {"goals": 2, "starts": 16, "count": 10},
    "camera": {"width": 32, "height": 24},
    "network": {"vision": "cnn", "hidden": 16, "layers": 1},
    "ppo": {"steps": 4, "minibatches": 2},
}


def test_it_grows_with_robots_and_homes_and_shrinks_with_minibatches():
    config = build_config(NavConfig, SMALL)
    one = predict_memory(config)
    more = predict_memory(replace(config, num_envs=16, homes=replace(config.homes, count=20)))
    finer = predict_memory(replace(config, ppo=replace(config.ppo, minibatches=4)))
    assert one["total"] == pytest.approx(sum(value for name, value in one.items() if name != "total"))
    for part in ("rollout", "activations", "homes"):
        assert more[part] == pytest.approx(2 * one[part], rel=0.1)
    assert finer["activations"] == pytest.approx(one["activations"] / 2) and finer["rollout"] == one["rollout"]
    images = 8 * 4 * 32 * 24 * 2  # float16
    assert images < one["rollout"] * 1e9 < 1.5 * images


def test_the_command_says_it(capsys):
    small = ["num_envs=8", "ppo.steps=2", "camera.width=32", "camera.height=24", "network.planes=16"]
    assert main(["bench", "memory", *small, "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["total_gb"] > figures["fixed_gb"] > 0 and figures["homes_gb"] > 1
    assert main(["bench", "memory", "num_envs=0"]) == 2
