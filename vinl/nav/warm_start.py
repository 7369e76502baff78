"""What a navigator's training starts from: the network of its configuration, or the weights of an earlier run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from vinl.config.errors import InputError
from vinl.nav.config import NavConfig
from vinl.nav.recurrent_model import RecurrentActorCritic
from vinl.nav.robot_config import NavCameraConfig
from vinl.policies.card import PolicyCard
from vinl.policies.io import load_policy
from vinl.policies.nav_actor import PREVIOUS_SIZE, NavActor
from vinl.policies.own_map import MapGeometry

CRITIC = "critic.safetensors"
"""File of a run beside its policy."""


def build_actor(config: NavConfig) -> NavActor:
    """A navigator with fresh weights."""
    camera = config.camera
    image: dict[str, Any] = {"vision": "none", "height": 1, "width": 1}
    if camera is not None:
        image = {"height": camera.height, "width": camera.width, "channels": 2 if camera.missing == "plane" else 1}
    return NavActor(
        **{
            **asdict(config.network),
            **image,
            "previous": PREVIOUS_SIZE * (2 if config.previous == "both" else 1),
            "places": _map_geometry(config).describe() if config.network.places else None,
        }
    )


def _map_geometry(config: NavConfig) -> MapGeometry:
    c, robot = config.camera or NavCameraConfig(), config.robot
    return MapGeometry(
        robot.min_speed,
        robot.max_speed,
        robot.max_yaw_rate,
        robot.period,
        c.hfov,
        c.pitch_down,
        c.far,
        c.forward,
        c.mount_height,
    )


def load_start(policy: str, config: NavConfig) -> tuple[dict[str, torch.Tensor], PolicyCard]:
    """Weights and card of a trained navigator to start from.

    Raises:
        InputError: it is no navigator, or has another network than the configuration.
    """
    loaded = load_policy(policy)
    with torch.device("meta"):
        wanted = build_actor(config).describe()
    if not isinstance(loaded.network, NavActor):
        raise InputError(f"--from {policy}: a {loaded.card.kind} policy; give a navigator")
    given = loaded.network.describe()
    if given != wanted:
        other = [f"{k} {given.get(k)} instead of {wanted[k]}" for k in wanted if given.get(k) != wanted[k]]
        raise InputError(f"--from {policy}: another network than the config's: {', '.join(other)}")
    return loaded.network.state_dict(), loaded.card


def save_critic(model: RecurrentActorCritic, folder: Path) -> None:
    """What a policy folder leaves away, for ``--from``: the critic, and the spread of the actions."""
    rest = {k: v.detach().cpu().contiguous() for k, v in model.state_dict().items() if not k.startswith("actor.")}
    scratch = folder / (CRITIC + ".new")
    save_file(rest, scratch)
    scratch.replace(folder / CRITIC)


def load_critic(model: RecurrentActorCritic, folder: Path) -> bool:
    """Take up what ``save_critic`` left in a run's folder, if there is such a file and it is of the same shape."""
    file = folder / CRITIC
    if not file.is_file():
        return False
    try:
        rest = load_file(file)
    except (SafetensorError, OSError) as error:
        raise InputError(f"{file} is broken ({error}); remove it to start with a fresh critic") from None
    own = {k: v for k, v in model.state_dict().items() if not k.startswith("actor.")}
    if {k: v.shape for k, v in rest.items()} != {k: v.shape for k, v in own.items()}:
        return False
    model.load_state_dict(rest, strict=False)
    return True
