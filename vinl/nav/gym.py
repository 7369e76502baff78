"""The navigation environment for gymnasium: many robots as a ``VectorEnv``, one as ``gymnasium.make("vinl/Nav-v0")``.

Importing this module registers the single one; ``gymnasium.make("vinl.nav.gym:vinl/Nav-v0")`` imports it by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.nav.config import NavConfig, RobotConfig
from vinl.nav.environment import EpisodeEnd, NavEnvironment
from vinl.nav.home_store import HomeRecord, HomeStore
from vinl.sensing.preparation import MARK
from vinl.world.boxes import Blocks, Boxes

HEIGHT = 360
"""Of the picture [pixels]."""

_MARGIN = 0.4
_PAPER, _WALL, _LOW, _BLOCK = "#f6f1e7", "#2f3437", "#d3c1a5", "#c8a24a"
_PATH, _ROBOT, _GOAL = "#1f5fa8", "#2a7f62", "#c8553d"
_TALL = 2.0
_LINTEL = 0.6


def draw_robot(
    home: HomeRecord,
    path: Float[np.ndarray, "k 2"],
    yaw: float,
    goal: Float[np.ndarray, " 2"],
    depth: Float[np.ndarray, "height width"] | None,
    robot: RobotConfig,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """Draw a home from above and the depth image beside it.

    Args:
        path: places so far [m], the last one is the robot's.
        yaw: heading [rad].
        goal: [m].
        depth: in [0, 1], near is dark; None or empty: the plan alone.
    """
    solid = home.solid[home.solid[:, 5] < _LINTEL].astype(np.float64)
    corners = Boxes(solid).corners()
    low, high = corners.min((0, 1)) - _MARGIN, corners.max((0, 1)) + _MARGIN
    scale = (HEIGHT - 1) / float((high - low)[1])
    image = Image.new("RGB", (max(math.ceil(float((high - low)[0]) * scale), 1), HEIGHT), _PAPER)
    pen = ImageDraw.Draw(image)

    def pixels(points: np.ndarray) -> list[tuple[float, float]]:
        at = (np.atleast_2d(points) - low) * scale
        return [(float(x), HEIGHT - 1 - float(y)) for x, y in at]

    for k in np.argsort(solid[:, 6]):  # the highest on top
        pen.polygon(pixels(corners[k]), fill=_WALL if solid[k, 6] > _TALL else _LOW)
    if len(home.blocks):
        for corner in Blocks(home.blocks.astype(np.float64)).boxes().corners():
            pen.polygon(pixels(corner), fill=_BLOCK)
    ((x, y),) = pixels(goal)
    radius = 0.325 * scale
    pen.ellipse((x - radius, y - radius, x + radius, y + radius), outline=_GOAL, width=3)
    if len(path) > 1:
        pen.line(pixels(path), fill=_PATH, width=2)
    body = Boxes(np.array([[*path[-1], yaw, robot.length, robot.width, 0.0, 1.0]])).corners()[0]
    pen.polygon(pixels(body), fill=_ROBOT)
    nose = path[-1] + robot.length / 2 * np.array([math.cos(yaw), math.sin(yaw)])
    pen.line(pixels(np.stack([path[-1], nose])), fill=_PAPER, width=2)
    picture = np.asarray(image)
    if depth is None or depth.size == 0:
        return picture.copy()
    width = round(HEIGHT / 2 * depth.shape[1] / depth.shape[0])
    grey = Image.fromarray((np.sqrt(depth) * 255).astype(np.uint8)).resize((width, HEIGHT // 2))
    side = np.zeros((HEIGHT, width, 3), np.uint8)
    side[: HEIGHT // 2] = np.asarray(grey)[:, :, None]
    return np.concatenate([picture, side], axis=1)


ID = "vinl/Nav-v0"
_HOMES = 8

_FARTHEST = 200.0
"""Distances in the observation are held to this, in units of 5 m: spaces need a bound."""


class NavVectorEnv(VectorEnv):
    """Many robots in many homes. An episode that ends is followed by the next in the same step; its last observation
    is in ``info["final_obs"]``, its figures in ``info["record"]``, both valid where ``info["_final_obs"]``.

    Args:
        config: name of a shipped config, a YAML file, or a ``NavConfig``.
        num_envs: robots; default: 16.
        homes: how many homes are generated; default: 8.
        plans: floor plans (files or names) instead of generated homes.
        device: ``"cpu"`` or ``"cuda"``; observations and actions are numpy arrays all the same.
        overrides: settings of the config as ``key=value``.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 - gymnasium's own

    def __init__(
        self,
        config: str | NavConfig = "nav/default",
        num_envs: int = 16,
        homes: int = _HOMES,
        plans: Sequence[str] = (),
        device: str = "cpu",
        overrides: Sequence[str] = (),
    ) -> None:
        self.environment = _build(config, num_envs, homes, plans, device, overrides)
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = _describe_spaces(self.environment)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin new episodes of all robots; the same seed gives the same ones."""
        super().reset(seed=seed, options=options)
        self.environment.restart(seed=seed)
        return _observation(self.environment), {}

    def step(self, actions: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Actions (n, 2) in [-1, 1] to observations, rewards, terminations (goal reached), truncations and info."""
        environment = self.environment
        reward, done, timeout = environment.advance(torch.as_tensor(actions, dtype=torch.float32))
        info: dict[str, Any] = {}
        if done.any():
            ended = done.cpu().numpy()
            info = {"final_obs": _observation(environment), "record": _figures(environment.ended)}
            info |= {"_final_obs": ended, "_record": ended}
            environment.restart(done)
        success = (done & ~timeout).cpu().numpy()
        return _observation(environment), reward.cpu().numpy(), success, timeout.cpu().numpy(), info


class NavEnv(gymnasium.Env):
    """One robot. Observations are a dictionary of ``depth`` (height, width) in [0, 1] and ``vector`` (5,), float32.

    Args:
        render_mode: ``"rgb_array"`` or None.
        config, homes, plans, device, overrides: as for ``NavVectorEnv``.
        store: homes that are there already, in the place of ``homes`` and ``plans``.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2}  # noqa: RUF012 - gymnasium's own

    def __init__(
        self,
        render_mode: str | None = None,
        config: str | NavConfig = "nav/default",
        homes: int = _HOMES,
        plans: Sequence[str] = (),
        device: str = "cpu",
        overrides: Sequence[str] = (),
        store: HomeStore | None = None,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise InputError(f"render_mode is 'rgb_array' or None, not {render_mode!r}")
        self.render_mode = render_mode
        self.environment = _build(config, 1, homes, plans, device, overrides, store)
        self.observation_space, self.action_space = _describe_spaces(self.environment)
        self._path: list[np.ndarray] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin a new episode; the same seed gives the same one."""
        super().reset(seed=seed, options=options)
        self.environment.restart(seed=int(self.np_random.integers(2**31)))
        self._path = [self._position()]
        return _first(_observation(self.environment)), self._info()

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """An action (2,) in [-1, 1] to observation, reward, whether the goal is reached, whether time is out, info."""
        reward, done, timeout = self.environment.advance(torch.as_tensor(np.asarray(action), dtype=torch.float32)[None])
        self._path.append(self._position())
        info, out = self._info(), bool(timeout)
        if bool(done):
            info["record"] = {name: value[0].item() for name, value in _figures(self.environment.ended).items()}
        return _first(_observation(self.environment)), float(reward), bool(done) and not out, out, info

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """The home from above with the path so far, beside what the camera sees: (height, width, 3) uint8."""
        if self.render_mode is None:
            return None
        environment, state = self.environment, self.environment.state
        depth, _ = environment.observe()
        return draw_robot(
            environment.homes.records[int(state["home"])],
            np.array(self._path or [self._position()]),
            float(state["yaw"]),
            environment.goals()[0].cpu().numpy(),
            depth[0].float().clamp(min=0.0).cpu().numpy(),
            environment.config.robot,
        )

    def _position(self) -> np.ndarray:
        return self.environment.state["position"][0].cpu().numpy().copy()

    def _info(self) -> dict[str, Any]:
        return {
            "distance": float(self.environment.distance[0]),
            "home": self.environment.homes.records[int(self.environment.state["home"])].name,
        }


def _build(
    config: str | NavConfig,
    num_envs: int,
    homes: int,
    plans: Sequence[str],
    device: str,
    overrides: Sequence[str],
    store: HomeStore | None = None,
) -> NavEnvironment:
    if isinstance(config, NavConfig):
        if overrides:
            raise InputError("overrides go with the name of a config, not with a NavConfig")
    else:
        config = load_config(NavConfig, config, overrides)
    config = replace(config, num_envs=num_envs, homes=replace(config.homes, count=homes))
    if store is not None:
        return NavEnvironment(config, store, device)
    store = HomeStore.from_paths(plans, config, device) if plans else HomeStore.build(config, device)
    return NavEnvironment(config, store, device)


def _describe_spaces(environment: NavEnvironment) -> tuple[Any, Any]:
    """Observation and action space of one robot."""
    size = environment.observe()[1].shape[1]
    low, high = np.full(size, -1, np.float32), np.ones(size, np.float32)
    low[0], high[0] = 0, _FARTHEST
    parts: dict[str, spaces.Space[Any]] = {"vector": spaces.Box(low, high, dtype=np.float32)}
    if environment.camera is not None:
        least = MARK if environment.camera.missing == "plane" else 0.0
        parts["depth"] = spaces.Box(least, 1.0, (environment.camera.height, environment.camera.width), np.float32)
    return spaces.Dict(parts), spaces.Box(-1.0, 1.0, (2,), np.float32)


def _observation(environment: NavEnvironment) -> dict[str, np.ndarray]:
    depth, vector = environment.observe()
    seen = vector.cpu().numpy()
    seen = np.hstack([seen[:, :1].clip(0, _FARTHEST), seen[:, 1:].clip(-1, 1)])  # a cosine may be 1 + 1e-7
    parts = {"vector": seen}
    if environment.camera is not None:
        parts["depth"] = depth.float().cpu().numpy()
    return parts


def _first(observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: values[0] for name, values in observation.items()}


def _figures(ended: EpisodeEnd | None) -> dict[str, np.ndarray]:
    assert ended is not None
    return {name: values.cpu().numpy() for name, values in ended._asdict().items() if name not in ("counted", "home")}


if ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point="vinl.nav.gym:NavEnv", vector_entry_point="vinl.nav.gym:NavVectorEnv")
