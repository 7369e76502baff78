"""The navigator's network: depth image, goal and previous action to a forward speed and a yaw rate."""

from __future__ import annotations

from typing import Any

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.config.loader import build_config
from vinl.policies.depth_memory import DepthMemory, State
from vinl.policies.grid_path import PLAN_SIZE, Spread, plan_path, spread
from vinl.policies.grid_ranges import DIRECTIONS, measure_ranges
from vinl.policies.networks import PolicyNetwork
from vinl.policies.occupancy_grid import GridState, OccupancyGrid, find_occupied
from vinl.robot.cameras import Camera

GOAL_SIZE, PREVIOUS_SIZE = 3, 2
"""Numbers that say where the goal is (distance / 5 m, cosine and sine of the bearing), and of the last action."""

OBSERVATION_SIZE, ACTION_SIZE = GOAL_SIZE + PREVIOUS_SIZE, 2

STEP_SIZE = 3
"""Numbers at the end of the observation that say how far the robot came [m, m, rad], if it is told."""

DISTANCE_UNIT = 5.0
"""The observation holds the distance to the goal in this unit [m]."""

_MEAN_GAIN = 0.01
"""Gain of the last layer: an untrained navigator asks for the middle of its ranges [ViNL code]."""


class NavActor(PolicyNetwork):
    """The deterministic navigator [ViNL resnet_policy.py].

    The image becomes ``visual`` numbers, goal and previous action ``embedding`` numbers each; all go into the memory,
    whose feature a linear layer and tanh turn into the two actions.

    Args:
        vision: ``"resnet18"``, ``"cnn"`` or ``"none"`` (blind).
        height, width: of the depth image [pixels].
        visual: numbers that the image becomes.
        embedding: numbers that goal and previous action become, each.
        memory: ``"lstm"`` or ``"mlp"``.
        planes: channels of the ResNet's first stage.
        previous: numbers on the last step: 2 of the action or the motion, 4 of both, 5 of the action and the step.
        channels: of the image: 1, or 2 with one for the pixels without a return.
        grid: an occupancy grid is kept up, and the network is told of a path planned on it; ``previous`` is 5 then.
            ``camera`` is the record of the images' camera, ``forward_speed`` what the actions -1 and 1 ask for [m/s].
            None: no grid.

    Attributes:
        image: (height, width) [pixels], or None if blind.
        feature_size: numbers that ``look`` returns.
        input_size: numbers that ``look`` takes: those observed, and the plan's.
        spreading: what distances are spread with on the grid; may be replaced by what does the same faster.
    """

    observation_size = OBSERVATION_SIZE
    action_size = ACTION_SIZE

    def __init__(
        self,
        vision: str = "resnet18",
        height: int = 48,
        width: int = 80,
        visual: int = 512,
        embedding: int = 32,
        hidden: int = 512,
        layers: int = 2,
        memory: str = "lstm",
        planes: int = 32,
        previous: int = PREVIOUS_SIZE,
        channels: int = 1,
        grid: dict[str, Any] | None = None,
    ) -> None:
        super().__init__()
        self.observation_size = GOAL_SIZE + previous
        self.keep_arguments(locals())
        self.grid = None if grid is None else OccupancyGrid(build_config(Camera, grid["camera"]))
        self.speeds = (0.0, 0.0) if grid is None else tuple(grid["forward_speed"])
        self.spreading: Spread = spread
        told = PLAN_SIZE + DIRECTIONS if self.grid else 0
        self.input_size = self.observation_size + told
        self.goal = nn.Linear(GOAL_SIZE, embedding)
        self.previous = nn.Linear(previous, embedding)
        self.told = nn.Linear(told, 2 * embedding) if told else None
        vector = (4 if told else 2) * embedding
        self.memory = DepthMemory(vision, height, width, vector, visual, hidden, layers, memory, planes, channels)
        self.image, self.feature_size = self.memory.image, hidden
        self.mean = nn.Linear(hidden, ACTION_SIZE)
        nn.init.orthogonal_(self.mean.weight, _MEAN_GAIN)
        nn.init.zeros_(self.mean.bias)

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The memory of n robots that have seen nothing; with a grid, that is the last part (``GridState``)."""
        return (*self.memory.initial_state(n, device), *self.initial_grid(n, device))

    @property
    def state_names(self) -> tuple[str, ...]:
        """What the parts of ``initial_state`` are called in an exported file."""
        network = ("hidden", "cell") if self.memory.remembers else ()
        return (*network, *(("grid_pose", "grid_cells", "grid_bumps") if self.grid else ()))

    def initial_grid(self, n: int, device: torch.device | str | None = None) -> State:
        """The grids of n robots that have seen nothing; nothing without one."""
        return () if self.grid is None else tuple(self.grid.start(n, device))

    def forward(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n 2"], State]:
        """Actions of t steps in a row.

        Args:
            depth: (t, n, H, W) in [0, 1]; not looked at when blind.
            vector: (t, n, k): distance to the goal / 5 m, cosine and sine of its bearing, previous action or motion or
                both.
            fresh: (t, n) an episode begins with this step: its state is zeroed before it.

        Returns:
            (t, n, 2) in [-1, 1]: forward speed is (a0 + 1) / 2 m/s, yaw rate a1 x pi/3 rad/s; and the last state.
        """
        if self.grid is None:
            feature, state = self.look(depth, vector, state, fresh)
            return self.choose(feature), state
        memory, grid = state[: -len(GridState._fields)], state[-len(GridState._fields) :]
        told = []
        for k in range(len(vector)):
            assert depth is not None
            more, grid = self.plan(depth[k], vector[k], grid, fresh[k])
            told.append(more)
        feature, memory = self.look(depth, torch.stack(told), memory, fresh)
        return self.choose(feature), (*memory, *grid)

    def occupied(self, state: State) -> list[Float[Tensor, "_ 2"]]:
        """See ``find_occupied``; nothing without a grid."""
        return [] if self.grid is None else find_occupied(GridState(*state[-len(GridState._fields) :]))

    @torch.no_grad()
    def plan(
        self,
        depth: Float[Tensor, "n height width"],
        vector: Float[Tensor, "n k"],
        grid: State,
        fresh: Bool[Tensor, " n"],
    ) -> tuple[Float[Tensor, "n input"], State]:
        """One step's vector with what is planned behind it, and the grid after the step; holds no weights."""
        assert self.grid is not None
        slowest, fastest = self.speeds
        asked = slowest + (vector[:, GOAL_SIZE] + 1) / 2 * (fastest - slowest)  # by the action before the step
        now = self.grid.see(GridState(*grid), depth, asked, vector[:, -STEP_SIZE:], fresh)
        goal = vector[:, 1:GOAL_SIZE] * (vector[:, :1] * DISTANCE_UNIT)
        return torch.cat([vector, plan_path(now, goal, self.spreading), measure_ranges(now)], 1), tuple(now)

    def look(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n hidden"], State]:
        """Features of t steps in a row, arguments as for ``forward``; the vector is ``plan``'s if there is a grid, and
        the state is the network's alone. A critic may share the features."""
        seen = vector[..., : self.observation_size]
        parts = [self.goal(seen[..., :GOAL_SIZE]), self.previous(seen[..., GOAL_SIZE:])]
        if self.told is not None:
            parts.append(self.told(vector[..., self.observation_size :]))
        return self.memory(depth, torch.cat(parts, -1), state, fresh)

    def choose(self, feature: Float[Tensor, "t n hidden"]) -> Float[Tensor, "t n 2"]:
        """Actions in [-1, 1] from features."""
        return torch.tanh(self.mean(feature))
