"""The rules of a navigator's evaluation, and what they are carried out with: the navigator, the environment's
configuration, the homes."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vinl.chain.navigators.base import ORACLE
from vinl.config.errors import InputError
from vinl.config.limits import check_fields, check_number
from vinl.config.loader import build_config, load_config
from vinl.nav.config import EpisodeConfig, NavConfig
from vinl.nav.home_store import HomeStore
from vinl.nav.robot_config import NavCameraConfig
from vinl.policies.card import PolicyCard, find_previous
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.velocity_range import VelocityRange
from vinl.sensing.odometry_config import OdometryConfig
from vinl.sensing.sensor_config import load_sensors
from vinl.world.homes.generate import find_judging_set
from vinl.world.readers import expand_paths, shipped_floorplans

MOTIONS = {
    "walking": "nav/motion/walking",
    "cancelled": "nav/motion/cancelled",
    "level": "nav/motion/level",
    "steady": "nav/motion/steady",
    "paper": "nav/paper",
}
"""How camera and robot move, and the config that says it: as recorded from the walking robot on clutter, the same with
every step that touches cancelled as a whole, as recorded on level ground, not at all, or redrawn at each step [paper].
"""


@dataclass(frozen=True)
class NavEvaluation:
    """The rules.

    Attributes:
        episodes: of each kind of home.
        seed: of starts, goals, headings and the camera's motion.
        motion: a key of ``MOTIONS``.
        sensors: errors of the camera: ``ideal``, ``realistic``, ``training``, or a YAML file, see ``load_sensors``.
        drift: relative error of the distances that the robot measures on its way, see ``OdometryConfig``.
        distance: range of the geodesic distance at the start [m].
        steps: an episode ends after so many decisions of 0.5 s [paper code: 250].
        goals: in each home.
        clutter: fraction of the homes with blocks that are seen but stop no robot.
        start_clearance: starts keep this distance from walls and furniture [m]; the rectangle turns on the spot with
            0.36 m, and starts lie up to 0.07 m off the cells' centres. In ``vinl eval`` it is 0.5 m [paper].
    """

    episodes: int = 1000
    seed: int = 0
    motion: str = "walking"
    sensors: str = "ideal"
    drift: float = 0.0
    distance: tuple[float, float] = (5.0, 30.0)
    steps: int = 250
    goals: int = 8
    clutter: float = 0.0
    start_clearance: float = 0.45

    def __post_init__(self) -> None:
        check_number("--episodes", self.episodes, 1, 65536)
        check_number("--seed", self.seed, 0, 2**31 - 1)
        if self.motion not in MOTIONS:
            raise InputError(f"--motion must be one of {', '.join(MOTIONS)}, got {self.motion!r}")
        check_number("--drift", self.drift, 0.0, 0.5)
        check_fields(self, "--", counts=("steps",), fractions=("clutter",))


def load_navigator(name: str, device: str) -> DepthPolicy | None:
    """A trained navigator, or None for the oracle.

    Raises:
        InputError: there is no such policy, or it is no navigator.
    """
    if name == ORACLE:
        return None
    policy = load_policy(name, device)
    if not isinstance(policy, DepthPolicy) or policy.card.kind != "navigation":
        raise InputError(f"--policy {name}: a {policy.card.kind} policy; give a navigator, or oracle")
    return policy


def name_kind(path: str) -> str:
    """What kind of floor plan a path leads to, for the tables: the file's stem where it holds many."""
    if path in shipped_floorplans():
        return "shipped"
    file = re.sub(r":\d+$", "", path).lower()
    for kind, endings in (("ros_map", (".yaml", ".yml")), ("picture", (".png", ".pgm"))):
        if file.endswith(endings):
            return kind
    return Path(file).name.split(".")[0]


def describe_episodes(card: PolicyCard | None, rules: NavEvaluation) -> NavConfig:
    """The environment of an evaluation: the policy's camera, velocities and memory of its last step, the motion and
    execution of ``rules.motion``. The walking robot carries the camera as high as it walks, whatever the training took.

    Args:
        card: of the navigator; None: blind (the oracle).
        rules: of the evaluation.

    Raises:
        InputError: the card's velocities are none that the environment knows.
    """
    config = load_config(NavConfig, MOTIONS[rules.motion])
    camera = None
    if card is not None and card.camera is not None:
        trained = card.training.get("camera") or {}
        known = {k: card.camera[k] for k in ("pitch_down", "hfov", "width", "height", "far")}
        known["missing"] = card.camera.get("missing", "as_is")
        assert config.camera is not None
        mount = {"mount_height": config.camera.mount_height}
        if rules.motion == "paper" and "mount_height" in trained:
            mount = {"mount_height": trained["mount_height"]}
        camera = build_config(NavCameraConfig, {**known, "forward": card.camera["position"][0], **mount}, source="card")
    episodes: EpisodeConfig = replace(
        config.episodes, distance=rules.distance, steps=rules.steps, start_speed=(0.0, 0.0)
    )
    homes = replace(
        config.homes,
        goals=rules.goals,
        starts=512,
        layouts={},
        start_clearance=rules.start_clearance,
        plans=(),
        plans_share=0.0,
    )
    robot = config.robot
    if card is not None:
        span = VelocityRange.of(card)
        if span.forward_speed[0] > 0 or span.yaw_rate[0] != -span.yaw_rate[1]:
            raise InputError(
                f"{card.name}: its card has forward_speed {list(span.forward_speed)}, yaw_rate {list(span.yaw_rate)}; "
                "in the kinematic environment a robot can stand still and turns to both sides alike"
            )
        low, high = span.forward_speed
        robot = replace(robot, min_speed=low, max_speed=high, max_yaw_rate=span.yaw_rate[1])
    return replace(
        config,
        robot=robot,
        num_envs=rules.episodes,
        seed=rules.seed,
        previous="action" if card is None else find_previous(card),
        camera=camera,
        sensors=load_sensors(rules.sensors),
        odometry=OdometryConfig((rules.drift, rules.drift)),
        episodes=episodes,
        homes=homes,
        clutter=replace(config.clutter, share=rules.clutter),
        ppo=replace(config.ppo, places=0.0),  # a training's loss: nobody asks for it here
    )


def build_homes(
    config: NavConfig,
    count: int,
    homes_seed: int,
    plans: Sequence[str],
    device: str,
    progress: Callable[[int, int], None] | None = None,
    sets: Sequence[str] = (),
) -> dict[str, HomeStore]:
    """Homes by kind.

    Args:
        config: of the environment.
        count: generated homes; 0: none.
        homes_seed: of the first one; training starts from seed 1, so choose one far above its number of homes.
        plans: floor plans, see ``vinl.world.readers.expand_paths``.
        device: for the homes.
        progress: called with homes done and wanted, of each kind anew.
        sets: names of ``vinl.world.homes.generate.JUDGING_SETS``.

    Raises:
        InputError: there are no homes, or none of a kind can be used.
    """
    stores: dict[str, HomeStore] = {}
    if count:
        generated = replace(config, homes=replace(config.homes, count=count, seed=homes_seed))
        stores["generated"] = HomeStore.build(generated, device, progress)
    for name, judged in {name: find_judging_set(name) for name in sets}.items():
        own = replace(config, homes=replace(config.homes, seed=judged.first_seed))
        stores[name] = HomeStore.from_plans(judged.generate(), own, device)
    groups: dict[str, list[str]] = {}
    for path in expand_paths(plans):
        groups.setdefault(name_kind(path), []).append(path)
    for kind, paths in groups.items():
        own = replace(config, homes=replace(config.homes, seed=homes_seed))
        stores[kind] = HomeStore.from_paths(paths, own, device, progress=progress)
    if not stores:
        raise InputError("there are no homes: give --homes N, --sets NAME or --floorplans FILE")
    return stores


def describe_policy(policy: DepthPolicy | None) -> dict[str, Any]:
    """What the results say of a navigator."""
    if policy is None:
        return {"name": ORACLE}
    card = policy.card
    homes = card.training.get("homes", {})
    return {
        "name": card.name,
        "samples": card.samples,
        "commit": card.commit,
        "camera": card.camera,
        "trained_in": {k: homes[k] for k in ("count", "seed", "plans", "plans_share") if k in homes},
    }
