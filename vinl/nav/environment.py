"""The kinematic navigation environment: thousands of robots in many homes at once, in torch and Warp on one device; and
what is counted while they drive: sums over the episodes that ended, and over all steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch
import warp as wp
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vinl.config.errors import InputError
from vinl.nav.config import NavConfig
from vinl.nav.home_store import HomeStore
from vinl.nav.kernels import Robots, aim_cameras, draw_keys, move_robots, place_robots, render_interior, write_rules
from vinl.policies.nav_actor import DISTANCE_UNIT
from vinl.robot.cameras import Camera
from vinl.sensing.depth import check_device
from vinl.sensing.odometry import Odometry
from vinl.sensing.preparation import settle_missing
from vinl.sensing.sensor import DepthSensor
from vinl.sensing.torch_warp import allocate_struct, launch
from vinl.world.endings import LOOPING_PATHS

_DRAWN_AT_START, _DRAWN_AT_LOOK = 1, 3
"""Rows of random numbers of a step: what the cameras are drawn from, and their images' errors."""

STUCK_STEPS = 10
"""An episode that runs out of time after at least so many cancelled steps in a row counts as stuck."""


class EpisodeEnd(NamedTuple):
    """The figures of the episodes that ended in the last step; other rows mean nothing.

    Attributes:
        counted: an episode ended there.
        home: slot of the home.
        success: 1 where the goal was reached.
        spl: success weighted by path length [Anderson et al. 2018].
        soft_spl: the fraction of the path that was made, weighted likewise [habitat].
        collisions: cancelled steps.
        steps: of the episode.
        path: path moved [m].
        start_distance, end_distance: geodesic distance to the goal [m].
        stuck, looping, out_of_time: 1 for the reason why the goal was not reached.
    """

    counted: Bool[Tensor, " n"]
    home: Int[Tensor, " n"]
    success: Float[Tensor, " n"]
    spl: Float[Tensor, " n"]
    soft_spl: Float[Tensor, " n"]
    collisions: Float[Tensor, " n"]
    steps: Float[Tensor, " n"]
    path: Float[Tensor, " n"]
    start_distance: Float[Tensor, " n"]
    end_distance: Float[Tensor, " n"]
    stuck: Float[Tensor, " n"]
    looping: Float[Tensor, " n"]
    out_of_time: Float[Tensor, " n"]


def end_episodes(state: Mapping[str, Tensor], counted: Bool[Tensor, " n"], success: Bool[Tensor, " n"]) -> EpisodeEnd:
    """The figures of the episodes of robots in a state, see ``NavEnvironment``.

    SPL compares with the distance at the start, as habitat does, so that the last metres, within the radius of success,
    are given to the robot.
    """
    start, path, end = state["start_distance"], state["path"], state["distance"]
    reached = success.float()
    efficiency = start / torch.maximum(path, start)
    progress = (1.0 - end / start).clamp(0.0, 1.0)
    late = 1.0 - reached
    stuck = late * (state["in_a_row"] >= STUCK_STEPS)
    looping = late * (1.0 - stuck) * (path > LOOPING_PATHS * start)
    return EpisodeEnd(
        counted=counted,
        home=state["home"].clone(),
        success=reached,
        spl=reached * efficiency,
        soft_spl=torch.where(success, 1.0, progress) * efficiency,
        collisions=state["collisions"].clone(),
        steps=state["steps"].clone(),
        path=path.clone(),
        start_distance=start.clone(),
        end_distance=end.clone(),
        stuck=stuck,
        looping=looping,
        out_of_time=late - stuck - looping,
    )


_NAMES = ("episodes", *EpisodeEnd._fields[2:])
_OF_STEPS = ("reward", "blocked", "near", "step_length")


class Measures:
    """Sums since they were last read."""

    def __init__(self, device: torch.device) -> None:
        self._ended = torch.zeros(len(_NAMES), dtype=torch.float64, device=device)
        self._steps = torch.zeros(1 + len(_OF_STEPS), dtype=torch.float64, device=device)

    def add(
        self,
        end: EpisodeEnd,
        reward: Float[Tensor, " n"],
        blocked: Float[Tensor, " n"],
        near: Float[Tensor, " n"],
        moved: Float[Tensor, " n"],
    ) -> None:
        """Count a step of all robots."""
        rows = torch.stack([end.counted.float(), *(getattr(end, name) for name in _NAMES[1:])])
        self._ended += torch.where(end.counted, rows, 0.0).sum(1, dtype=torch.float64)
        step = torch.stack([torch.ones_like(reward), reward, blocked, near, moved])
        self._steps += step.sum(1, dtype=torch.float64)

    def read(self, unplaced: Tensor) -> dict[str, float]:
        """Means, and set everything to zero; the host waits once for the device.

        Args:
            unplaced: (n,) starts that no good place was found for; set to zero too.
        """
        values = torch.cat([self._ended, self._steps, unplaced.sum(dtype=torch.float64)[None]]).tolist()
        for sums in (self._ended, self._steps, unplaced):
            sums.zero_()
        count = len(_NAMES)
        ended, steps = dict(zip(_NAMES, values[:count], strict=True)), max(values[count], 1.0)
        episodes = ended.pop("episodes")
        measures = {"episodes": episodes}
        if episodes > 0:
            measures |= {name: value / episodes for name, value in ended.items()}
        of_steps = zip(_OF_STEPS, values[count + 1 : -1], strict=True)
        return measures | {name: value / steps for name, value in of_steps} | {"unplaced": values[-1]}


class NavStep(NamedTuple):
    """What a step gives.

    Attributes:
        depth: (n, H, W) float16 in [0, 1], pixels without a return dealt with as ``camera.missing`` says; of the new
            episode where done. (n, 0, 0) if the robots are blind.
        vector: (n, 5) float32: distance to the goal / 5 m, cosine and sine of its bearing (left is positive), and the
            previous action or motion, 0 at the start; (n, 7) with both, (n, 8) with action and step
            (``NavConfig.previous``). Of the new episode where done.
        reward: (n,) float32.
        done: (n,) bool, an episode ended with this step.
        timeout: (n,) bool, it ended for want of time, not at the goal.
    """

    depth: Float[Tensor, "n height width"]
    vector: Float[Tensor, "n k"]
    reward: Float[Tensor, " n"]
    done: Bool[Tensor, " n"]
    timeout: Bool[Tensor, " n"]


class NavEnvironment:
    """Robots that drive to goals.

    An action in [-1, 1]² holds for 0.5 s: forward speed from 0 to 1 m/s and yaw rate within 60 deg/s, unless
    ``RobotConfig`` says otherwise. A step whose swept footprint would touch a wall or furniture is cancelled as a
    whole, or all but its turn (``ExecutionConfig.give_way``). An episode ends with success as soon as the robot is near
    its goal; there is no stop action.

    Nothing in ``step`` waits for the device. The same seed, configuration and homes give the same episodes.

    Args:
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:1"``, the homes' too.
        seed: of everything random but the homes; that of the configuration by default.

    Attributes:
        camera: its record, or None if the robots are blind.
        ended: figures of the episodes that ended in the last step, see ``EpisodeEnd``; None before the first.
        state: the robots' tensors by name, see ``kernels.Robots``; to be read.

    Raises:
        InputError: the device is not there, or not the homes'.
    """

    def __init__(
        self, config: NavConfig, homes: HomeStore, device: str | torch.device = "cpu", seed: int | None = None
    ) -> None:
        self.config, self.homes = config, homes
        self.device = check_device(device)
        if self.device != homes.device:
            raise InputError(f"the environment is on {self.device}, its homes are on {homes.device}; use one device")
        self.num_envs = n = config.num_envs
        self.camera: Camera | None = None if config.camera is None else config.camera.record()
        self._rules = write_rules(config)
        self._robots, self.state = allocate_struct(Robots, n, self.device)
        counts = ("steps", "path", "collisions", "in_a_row", "start_distance", "unplaced")
        self.state |= {name: self._zeros(n) for name in counts}
        self.state["action"] = self._zeros(n, 2)
        self.state["chance"] = self._zeros(2, dtype=torch.int32)
        self._moved, self._blocked, self._near, self._straight = (self._zeros(n) for _ in range(4))
        self._camera_pose = self._zeros(n, 3), self._zeros(n, 3, 3)
        self._sensor: DepthSensor | None = None
        if self.camera is not None:
            self._sensor = DepthSensor(config.sensors, self.camera, n, self.device)
            self.state |= {f"camera_{name}": tensor for name, tensor in self._sensor.drawn.items()}
        self._odometry: Odometry | None = None
        if not config.odometry.is_exact:
            self._odometry = Odometry(config.odometry, n, self.device)
            self.state |= {f"odometry_{name}": tensor for name, tensor in self._odometry.state.items()}
        if config.previous == "step":
            self.state["came"] = self._zeros(n, 3)
        self._key = self._zeros(n, dtype=torch.int32)
        self._rows = torch.arange(n, dtype=torch.int32, device=self.device)
        self._chosen = self._zeros(n, dtype=torch.bool)
        self._wrapped = {
            "chance": wp.from_torch(self.state["chance"]),
            "action": wp.from_torch(self.state["action"], dtype=wp.vec2),
            "unplaced": wp.from_torch(self.state["unplaced"]),
            "moved": wp.from_torch(self._moved),
            "blocked": wp.from_torch(self._blocked),
            "near": wp.from_torch(self._near),
            "straight": wp.from_torch(self._straight),
            "chosen": wp.from_torch(self._chosen),
            "camera": wp.from_torch(self._camera_pose[0], dtype=wp.vec3),
            "rotation": wp.from_torch(self._camera_pose[1], dtype=wp.mat33),
            "key": wp.from_torch(self._key),
        }
        self._measures = Measures(self.device)
        self.ended: EpisodeEnd | None = None
        self._observation: tuple[Tensor, Tensor] | None = None
        self.restart(seed=config.seed if seed is None else seed)

    # ---- what a training calls ------------------------------------------------------------------------------------

    def observe(
        self, rows: Int[Tensor, " k"] | None = None
    ) -> tuple[Float[Tensor, "k height width"], Float[Tensor, "k observation"]]:
        """Depth and vector of the present state, as in ``NavStep``; the same until the next step.

        Args:
            rows: (k,) int32 numbers of robots: of these alone; by default of all.
        """
        if rows is not None:
            return self._look(rows)
        if self._observation is None:
            self._observation = self._look(self._rows)
        return self._observation

    def step(self, action: Float[Tensor, "n 2"]) -> NavStep:
        """Move all robots for 0.5 s; where an episode ends, the next one begins.

        Args:
            action: forward speed and yaw rate in [-1, 1]; held to that.
        """
        reward, done, timeout = self.advance(action)
        self._start(done)
        depth, vector = self.observe()
        return NavStep(depth, vector, reward, done, timeout)

    @property
    def distance(self) -> Float[Tensor, " n"]:
        """Geodesic distance to the goal [m]; what the robots themselves do not know. Changes with the next step."""
        return self.state["distance"]

    def read_measures(self) -> dict[str, float]:
        """Means over the episodes that ended since the last call (``success``, ``spl``, ``soft_spl``, ``collisions``,
        ``steps``, ``path`` and ``start_distance``, ``end_distance`` [m], fractions that were ``stuck``, ``looping``,
        ``out_of_time``; absent if none ended), their number ``episodes``; over all steps ``reward``, the fractions
        ``blocked`` and ``near`` (a wall or furniture within ``reward.margin``), ``step_length`` [m]; and how many were
        ``unplaced``: started off the range of distances, because no start within it was found. The host waits here."""
        return self._measures.read(self.state["unplaced"])

    def save_state(self) -> dict[str, Any]:
        """Everything that ``load_state`` needs to go on, on the CPU."""
        tensors = {name: tensor.detach().cpu().clone() for name, tensor in self.state.items()}
        return {"robots": tensors, "homes": self.homes.save_state()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from a saved state. If the homes are other ones, all robots begin anew.

        Raises:
            InputError: the state is of another number of robots.
        """
        saved = state["robots"]
        if saved.keys() != self.state.keys() or len(saved["home"]) != self.num_envs:
            raise InputError(f"the saved state is of {len(saved.get('home', ()))} robots, not {self.num_envs}")
        if self.homes.save_state() == state["homes"]:
            for name, tensor in saved.items():
                self.state[name].copy_(tensor)
        else:
            self.state["chance"].copy_(saved["chance"])
            self._start(torch.ones(self.num_envs, dtype=torch.bool, device=self.device))
            self.stagger()
        self._observation = None

    # ---- its parts, for those who need an episode's last picture --------------------------------------------------

    def advance(
        self, action: Float[Tensor, "n 2"]
    ) -> tuple[Float[Tensor, " n"], Bool[Tensor, " n"], Bool[Tensor, " n"]]:
        """The first half of a step: move, reward, count. ``restart(done)`` must follow before the next.

        Returns:
            reward, done and timeout, as in ``NavStep``.
        """
        state, rules = self.state, self.config.reward
        state["action"].copy_(action.detach()).clamp_(-1.0, 1.0)
        state["chance"][1] += 1
        before, place, believed = state["distance"].clone(), state["position"].clone(), self._believe()
        self._launch(
            move_robots,
            self.num_envs,
            [self.homes.homes, self._rules, "chance", "action", self._robots, "moved", "blocked", "near", "straight"],
        )
        if self._odometry is not None:
            self._odometry.advance(place, state["position"])
        if "came" in state:
            state["came"].copy_(_step_between(believed, self._believe()))
        state["steps"] += 1
        state["path"] += self._moved
        state["collisions"] += self._blocked
        state["in_a_row"].add_(1).mul_(self._blocked)
        episodes = self.config.episodes
        success = (self._straight < episodes.success_radius) & (state["distance"] < episodes.success_geodesic)
        timeout = (state["steps"] >= episodes.steps) & ~success
        done = success | timeout
        reward = rules.progress * (before - state["distance"]) + rules.success * success
        reward += rules.path * self._moved
        reward += rules.slack + rules.collision * self._blocked + rules.near * self._near
        reward = rules.scale * reward
        self.ended = end_episodes(state, done, success)
        self._measures.add(self.ended, reward, self._blocked, self._near, self._moved)
        self._observation = None
        return reward, done, timeout

    def restart(self, chosen: Bool[Tensor, " n"] | None = None, seed: int | None = None) -> None:
        """Begin new episodes.

        Args:
            chosen: (n,) of these robots; of all by default.
            seed: begin the row of random numbers anew, so that what follows is the same each time.
        """
        if seed is not None:
            mixed = int(np.random.SeedSequence(seed).generate_state(1)[0]) >> 1
            self.state["chance"].copy_(torch.tensor([mixed, 0], dtype=torch.int32))
        self.state["chance"][1] += 1
        self._start(torch.ones(self.num_envs, dtype=torch.bool, device=self.device) if chosen is None else chosen)

    def stagger(self) -> None:
        """Let the present episodes look as if each had begun a random while ago, so that not all run out of time at
        once; for the start of a training."""
        generator = torch.Generator().manual_seed(int(self.state["chance"][0].item()))
        self.state["steps"].copy_(
            torch.randint(0, max(self.config.episodes.steps - 1, 1), (self.num_envs,), generator=generator)
        )

    def goals(self) -> Float[Tensor, "n 2"]:
        """Where each robot's goal is [m]."""
        return wp.to_torch(self.homes.homes.goals)[self.state["home"].long(), self.state["goal"].long()]

    # ---- inside ---------------------------------------------------------------------------------------------------

    def _start(self, chosen: Tensor) -> None:
        state = self.state
        self._chosen.copy_(chosen)
        self._launch(
            place_robots, self.num_envs, [self.homes.homes, self._rules, "chance", "chosen", self._robots, "unplaced"]
        )
        self._draw_errors()
        for name in ("steps", "path", "collisions", "in_a_row"):
            state[name].masked_fill_(chosen, 0.0)
        if "came" in state:
            state["came"].masked_fill_(chosen[:, None], 0.0)
        state["action"].masked_fill_(chosen[:, None], 0.0)
        state["start_distance"].copy_(torch.where(chosen, state["distance"], state["start_distance"]))
        self._observation = None

    def _draw_errors(self) -> None:
        """Of camera and odometry, of the robots whose episodes start."""
        sensor = None if self._sensor is None or self._sensor.config.is_ideal else self._sensor
        if sensor is None and self._odometry is None:
            return
        self._launch(draw_keys, self.num_envs, ["chance", _DRAWN_AT_START, "key"])
        if sensor is not None:
            sensor.restart(self._key, self._chosen)
        if self._odometry is not None:
            self._odometry.restart(self._key, self._chosen, self.state["position"])

    def _look(self, rows: Tensor) -> tuple[Tensor, Tensor]:
        n, state = self.num_envs, self.state
        believed = self._believe()
        to_goal = self.goals() - believed[:, :2]
        bearing = torch.atan2(to_goal[:, 1], to_goal[:, 0]) - believed[:, 2]
        distance = torch.linalg.vector_norm(to_goal, dim=1) / DISTANCE_UNIT
        last = [state["previous"]]
        if self.config.previous == "both":
            last.insert(0, state["action"])
        if self.config.previous == "step":
            last = [state["action"], state["came"]]
        vector = torch.cat([torch.stack([distance, bearing.cos(), bearing.sin()], 1), *last], 1)[rows]
        if self.camera is None or self._sensor is None:
            return torch.zeros(len(rows), 0, 0, dtype=torch.float16, device=self.device), vector
        depth = torch.empty(len(rows), self.camera.height, self.camera.width, dtype=torch.float16, device=self.device)
        self._launch(aim_cameras, n, [self._rules, "chance", self._robots, self._sensor.cameras, "camera", "rotation"])
        seen = [wp.from_torch(rows), "camera", "rotation", wp.from_torch(depth)]
        self._launch(render_interior, tuple(depth.shape), [self.homes.homes, self._rules, self._robots, *seen])
        if self._sensor.config.spoils:
            self._launch(draw_keys, n, ["chance", _DRAWN_AT_LOOK, "key"])
            at, turned = (pose[rows] for pose in self._camera_pose)
            depth = self._sensor.spoil(depth, rows, self._key[rows], at, turned, unit=self.camera.far)
        return settle_missing(self.camera.missing, depth, ~(depth > 0)), vector

    def _believe(self) -> Float[Tensor, "n 3"]:
        """Where the robots believe to be, x, y [m] and heading [rad]."""
        place, yaw = self.state["position"], self.state["yaw"]
        if self._odometry is not None:
            believed = self._odometry.state["estimate"]
            place, yaw = believed[:, :2], yaw + believed[:, 2]
        return torch.cat([place, yaw[:, None]], 1)

    def _launch(self, kernel: Any, dim: int | tuple[int, ...], inputs: list[Any]) -> None:
        launch(kernel, dim, [self._wrapped[x] if isinstance(x, str) else x for x in inputs], self.device)

    def _zeros(self, *shape: int, dtype: torch.dtype = torch.float32) -> Tensor:
        return torch.zeros(*shape, dtype=dtype, device=self.device)


def _step_between(before: Float[Tensor, "n 3"], after: Float[Tensor, "n 3"]) -> Float[Tensor, "n 3"]:
    """From one pose to the next, in the heading frame of the first [m, m, rad]."""
    x, y, turn = (after - before).unbind(1)
    c, s = before[:, 2].cos(), before[:, 2].sin()
    return torch.stack([c * x + s * y, c * y - s * x, torch.atan2(turn.sin(), turn.cos())], 1)
