"""A locomotion policy that plans its footholds from depth: network, planner and actor in one.

The image network and its memory predict the velocity of the trunk, which no robot measures, and what the feet have to
know of the ground; gait and footholds follow from these by the planner of ``vinl.gait``, and the teacher's actor moves
the joints. What it predicts is in metres and can be drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.config.loader import build_config
from vinl.gait.config import GaitConfig
from vinl.gait.footholds import plan_footholds
from vinl.gait.local_map import POINTS, LocalMapView
from vinl.gait.observation import GAIT_ROWS, SENSED_TABLE, STEPPING_TABLE
from vinl.gait.path import GAIT_SIZE, gait_rows
from vinl.gait.proprioception import feet_in_trunk, heading_axes, into_heading_frame, motion_of
from vinl.gait.state import GaitState, Plan, aim, start_gait, swings, tick
from vinl.policies.depth_memory import DepthMemory, State
from vinl.policies.networks import PolicyNetwork, mlp
from vinl.robot.aliengo import DEFAULT_POSE, FOOT_RADIUS

CODES = ("plan", "map")
"""What the network predicts of the ground: the foothold plan itself, or a height map that the planner reads."""

PLAN_SIZE = 20
"""Offsets (8), rises (4), apexes (4) and rates (4) of a plan."""

_PLAN_UNITS = (0.1,) * 8 + (0.05,) * 8 + (0.2,) * 4
"""What 1 means in the network's output [m, m, 1]: about the spread of each."""

_MAP_UNIT = 0.05
"""The same of a height map [m]."""

_GAIT_NUMBERS = (4, 1, 4, 12, 12, 4, 1)
"""Sizes of the fields of ``GaitState``."""


class Prediction(NamedTuple):
    """What the network says in one step.

    Attributes:
        velocity: (n, 3) of the trunk, in its frame [m/s].
        code: (n, 20) plan or (n, 741) heights above the floor under the robot [m]; a plan's rates have no unit.
    """

    velocity: Tensor
    code: Tensor


class Memory(NamedTuple):
    """What is remembered from step to step: hidden and cell states first, then (1, n, 37) the gait and (1, n, 3) the
    last prediction of the velocity [m/s]."""

    network: State
    gait: GaitState
    velocity: Tensor


class SteppingActor(PolicyNetwork):
    """Depth and proprioception to joint actions, by way of predicted footholds.

    Parameters are named ``memory.*`` (image and past), ``velocity.*`` and ``head.*`` (linear) and ``actor.*`` (the
    teacher's).

    Attributes:
        image: height and width that it takes [pixels]; None: it is blind.
        gait: of the teacher.
        code: one of ``CODES``.
        code_size: numbers of the code.
    """

    units: Tensor
    rest: Tensor
    sensed_scale: Tensor
    rows_scale: Tensor
    default_pose: Tensor

    def __init__(
        self,
        vision: str = "cnn",
        height: int = 36,
        width: int = 64,
        visual: int = 64,
        hidden: int = 256,
        layers: int = 2,
        memory: str = "lstm",
        planes: int = 32,
        code: str = "map",
        actor: Sequence[int] = (512, 256, 128),
        actions: int = 12,
        gait: dict[str, Any] | None = None,
    ) -> None:
        """Sizes as in ``DepthMemory``; ``actor`` are the widths of the teacher's hidden layers, ``gait`` the fields of
        its ``GaitConfig``.

        Raises:
            ValueError: unknown ``code``.
        """
        super().__init__()
        if code not in CODES:
            raise ValueError(f"code is one of {CODES}, got {code!r}")
        gait = dict(gait or {})
        self.keep_arguments(locals())
        self.gait = build_config(GaitConfig, gait, source="network: gait")
        self.observation_size, self.action_size = SENSED_TABLE.size, actions
        self.code, self.code_size = code, PLAN_SIZE if code == "plan" else len(POINTS)
        self.vector_size = SENSED_TABLE.size + 8 + 3
        self.memory = DepthMemory(vision, height, width, self.vector_size, visual, hidden, layers, memory, planes)
        self.image = self.memory.image
        self.velocity = nn.Linear(hidden, 3)
        self.head = nn.Linear(hidden, self.code_size)
        self.actor = mlp([STEPPING_TABLE.size, *actor, actions], nn.ELU)
        for layer in (self.velocity, self.head):  # it begins with Raibert's footholds on level floor
            nn.init.normal_(layer.weight, std=0.01)
            nn.init.zeros_(layer.bias)
        units = torch.tensor(_PLAN_UNITS if code == "plan" else (_MAP_UNIT,) * self.code_size, device="cpu")
        rest = torch.zeros(self.code_size, device="cpu")
        if code == "plan":
            rest[12:16], rest[16:] = self.gait.lift, 1.0
        # no weights, but on the network's device; they have their numbers even where networks are built without any
        for name, numbers in (
            ("units", units),
            ("rest", rest),
            ("sensed_scale", torch.from_numpy(SENSED_TABLE.scale)),
            ("rows_scale", torch.tensor([s for row in GAIT_ROWS for s in row.scale * row.size], device="cpu")),
            ("default_pose", torch.tensor(DEFAULT_POSE, dtype=torch.float32, device="cpu")),
        ):
            self.register_buffer(name, numbers, persistent=False)

    # ---- memory -----------------------------------------------------------------------------------------------------

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The state of n robots that remember nothing."""
        gait = torch.zeros(1, n, sum(_GAIT_NUMBERS), device=device)
        return (*self.memory.initial_state(n, device), gait, torch.zeros(1, n, 3, device=device))

    @property
    def state_names(self) -> tuple[str, ...]:
        """What the parts of ``initial_state`` are called in an exported file."""
        return (*(("hidden", "cell") if self.memory.remembers else ()), "gait", "velocity")

    def unpack(self, state: State) -> Memory:
        """A state as what it means."""
        n = state[-1].shape[1]
        fields = state[-2][0].split(_GAIT_NUMBERS, 1)
        lift, target = (x.reshape(n, 4, 3) for x in fields[3:5])
        gait = GaitState(fields[0], fields[1][:, 0], fields[2], lift, target, fields[5], fields[6][:, 0])
        return Memory(tuple(state[:-2]), gait, state[-1][0])

    @staticmethod
    def pack(memory: Memory) -> State:
        """What ``unpack`` takes back."""
        fields = [field.reshape(len(field), -1) for field in memory.gait]
        return (*memory.network, torch.cat(fields, 1)[None], memory.velocity[None])

    def footholds(self, state: State) -> Float[Tensor, "n 4 3"]:
        """Where the feet come down next, in the robots' heading frames [m]."""
        return self.unpack(state).gait.target

    # ---- parts of a step --------------------------------------------------------------------------------------------

    def feel(self, vector: Float[Tensor, "n 45"]) -> dict[str, Tensor]:
        """The scaled numbers in SI units, by the names of the table; joint positions as angles."""
        plain, felt, first = vector / self.sensed_scale, {}, 0
        for term in SENSED_TABLE:
            felt[term.name] = plain[:, first : first + term.size]
            first += term.size
        felt["joint_position"] = felt["joint_position"] + self.default_pose
        return felt

    def network_input(self, vector: Float[Tensor, "n 45"], memory: Memory) -> Float[Tensor, "n 56"]:
        """What the memory is given beside the image: also the legs' phases and the velocity that it last said."""
        angle = 2 * torch.pi * memory.gait.phases
        return torch.cat([vector, torch.sin(angle), torch.cos(angle), memory.velocity], 1)

    def encode(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        inputs: Float[Tensor, "t n 56"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Prediction, State]:
        """Predictions of t steps in a row from ``network_input``, and the memory's own state after them."""
        features, state = self.memory(depth, inputs, state, fresh)
        features = features.float()
        return Prediction(self.velocity(features), self.rest + self.units * self.head(features)), state

    def plan(self, said: Prediction, gait: GaitState, command: Tensor, feet: Tensor, level: Tensor) -> Plan:
        """The plan of a step's code; ``level`` (n, 2) is the velocity in the heading frame [m/s]."""
        if self.code == "plan":
            offset, rise, apex, rate = said.code.split((8, 4, 4, 4), 1)
            most = self.gait.modulate
            return Plan(offset.reshape(-1, 4, 2), rise, apex, rate.clip(1 - most, 1 + most))
        view = LocalMapView(torch, said.code, self.floor(gait, feet))
        return plan_footholds(torch, self.gait, view, gait, level, command, feet)

    def floor(self, gait: GaitState, feet: Float[Tensor, "n 4 3"]) -> Float[Tensor, " n"]:
        """Height of the floor under the feet that stand by the clock, in the heading frame [m]."""
        stands = (~swings(torch, self.gait, gait)).float()
        return (feet[..., 2] * stands).sum(1) / stands.sum(1).clip(min=1.0) - FOOT_RADIUS

    def begin(self, vector: Float[Tensor, "n 45"], memory: Memory, fresh: Bool[Tensor, " n"]) -> Memory:
        """The memory before a step: robots that are fresh stand with their feet where they are."""
        felt = self.feel(vector)
        feet = into_heading_frame(
            heading_axes(torch, felt["projected_gravity"]), feet_in_trunk(torch, felt["joint_position"])
        )
        start = start_gait(torch, self.gait, feet)
        gait = GaitState(
            *(
                torch.where(fresh.reshape(-1, *(1,) * (a.ndim - 1)), a, b)
                for a, b in zip(start, memory.gait, strict=True)
            )
        )
        return Memory(memory.network, gait, torch.where(fresh[:, None], 0.0, memory.velocity))

    def walk(
        self, vector: Float[Tensor, "n 45"], said: Prediction, memory: Memory
    ) -> tuple[Float[Tensor, "n 12"], GaitState]:
        """Actions of a prediction, the network's or one that is known to be right, and the gait after them."""
        felt = self.feel(vector)
        command = felt["command"]
        axes = heading_axes(torch, felt["projected_gravity"])
        feet = into_heading_frame(axes, feet_in_trunk(torch, felt["joint_position"]))
        motion = motion_of(torch, axes, said.velocity, felt["base_angular_velocity"])
        level = into_heading_frame(axes, said.velocity)[:, :2]
        gait = tick(torch, self.gait, memory.gait, motion, command, feet)
        gait = aim(torch, self.gait, gait, self.plan(said, gait, command, feet, level), level, command, feet)
        rows = gait_rows(torch, self.gait, gait, feet) * self.rows_scale
        scale = STEPPING_TABLE.terms[0].scale[0]
        return self.actor(torch.cat([said.velocity * scale, vector, rows], 1)), gait

    def forward(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n 45"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n actions"], State]:
        """Actions of t steps in a row.

        Args:
            depth: (t, n, H, W) in [0, 1]: normalised by the camera record of the card.
            vector: (t, n, 45) scaled ``SENSED_TABLE``.
            state: before the first step.
            fresh: (t, n) an episode begins with this step.

        Returns:
            (t, n, 12) actions, and the state after the last step.
        """
        actions = []
        for k in range(len(fresh)):
            memory = self.begin(vector[k], self.unpack(state), fresh[k])
            image = None if depth is None else depth[k : k + 1]
            inputs = self.network_input(vector[k], memory)[None]
            said, network = self.encode(image, inputs, memory.network, fresh[k : k + 1])
            said = Prediction(said.velocity[0], said.code[0])
            action, gait = self.walk(vector[k], said, memory)
            actions.append(action)
            state = self.pack(Memory(network, gait, said.velocity))
        return torch.stack(actions), state


assert sum(row.size for row in GAIT_ROWS) == GAIT_SIZE
