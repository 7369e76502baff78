"""A locomotion policy that plans its footholds from depth: velocity estimator, elevation map, planner and actor.

A memory network predicts the velocity of the trunk, which no robot measures, from what legs and IMU tell, and feet that
hold the ground correct it. Dead reckoning keeps an elevation map of what the camera saw; gait and footholds follow from
that by the planner of ``vinl.gait``, and the teacher's actor moves the joints. What it believes is in metres and can be
drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.config.loader import build_config
from vinl.gait.command import adapt_command
from vinl.gait.config import GaitConfig
from vinl.gait.footholds import plan_footholds
from vinl.gait.local_map import POINTS, LocalMapView, floor_under
from vinl.gait.observation import GAIT_ROWS, SENSED_TABLE, STEPPING_TABLE
from vinl.gait.path import GAIT_SIZE, gait_rows
from vinl.gait.proprioception import feet_in_trunk, heading_axes, into_heading_frame, motion_of, velocities_by_feet
from vinl.gait.state import GaitState, aim, start_gait, swings, tick
from vinl.policies.depth_memory import DepthMemory, State
from vinl.policies.elevation_map import ElevationMap, MapState
from vinl.policies.networks import PolicyNetwork, step_layers
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.robot.cameras import Camera

_GAIT_NUMBERS = (4, 1, 4, 12, 12, 4, 1, 2)
"""Sizes of the fields of ``GaitState``."""

_COMMAND = SENSED_TABLE.place("command")

_SLIP = 0.1
"""A foot that tells another velocity than the network, by so much [m/s], slips, or has not come down yet."""

_TRUST, _DOUBT = 0.7, 0.05
"""How far the velocity is drawn to what feet tell; half as far where all of them together have this weight."""


class Stance(NamedTuple):
    """What a robot measures of itself in one step, and what follows from it.

    Attributes:
        felt: the numbers of ``SENSED_TABLE`` in SI units, by its names; joint positions as angles.
        axes: (n, 3, 3) of the heading frame in the trunk's.
        feet: (n, 4, 3) the feet in the heading frame [m].
        by_feet: (n, 4, 3) velocity of the trunk by each foot, if that rolls on the ground [m/s].
    """

    felt: dict[str, Tensor]
    axes: Tensor
    feet: Tensor
    by_feet: Tensor


class Prediction(NamedTuple):
    """What a robot believes in one step.

    Attributes:
        velocity: (n, 3) of the trunk, in its frame [m/s].
        heights: (n, 741) of the ground about the robot, above the floor under it [m].
    """

    velocity: Tensor
    heights: Tensor


class Memory(NamedTuple):
    """What is remembered from step to step: hidden and cell states of the network, the gait (40 numbers), (n, 3) the
    last prediction of the velocity [m/s], and the elevation map; none for a policy without a camera."""

    network: State
    gait: GaitState
    velocity: Tensor
    map: MapState | None


class SteppingActor(PolicyNetwork):
    """Depth and proprioception to joint actions, by way of footholds on an elevation map.

    Parameters are named ``memory.*``, ``velocity.*`` (linear) and ``actor.*`` (the teacher's).

    Attributes:
        image: height and width that it takes [pixels]; None: it is blind, and takes the ground for level.
        remembers: whether it remembers; one that does not maps each image by itself [paper IV-B].
        dates_images: whether it puts what an image shows where it was when that was taken.
    """

    sensed_scale: Tensor
    rows_scale: Tensor
    default_pose: Tensor

    def __init__(
        self,
        camera: dict[str, Any] | None = None,
        hidden: int = 256,
        layers: int = 2,
        memory: str = "lstm",
        actor: Sequence[int] = (512, 256, 128),
        actions: int = 12,
        gait: dict[str, Any] | None = None,
    ) -> None:
        """Sizes as in ``DepthMemory``; ``camera`` is the record of what it sees through, ``actor`` are the widths of
        the teacher's hidden layers, ``gait`` the fields of its ``GaitConfig``."""
        super().__init__()
        gait, camera = dict(gait or {}), None if camera is None else dict(camera)
        self.keep_arguments(locals())
        self.gait = build_config(GaitConfig, gait, source="network: gait")
        self.observation_size, self.action_size = SENSED_TABLE.size, actions
        self.vector_size = SENSED_TABLE.size + 8 + 3 + 12
        self.memory = DepthMemory("none", 1, 1, self.vector_size, 1, hidden, layers, memory)
        self.remembers = self.memory.remembers
        eye = None if camera is None else build_config(Camera, camera, source="network: camera")
        self.image = None if eye is None else (eye.height, eye.width)
        self.elevation = None if eye is None else ElevationMap(eye)
        self.dates_images = eye is not None and self.remembers
        self.velocity = nn.Linear(hidden, 3)
        self.actor = step_layers(actor, actions)
        if not self.velocity.weight.is_meta:  # a policy that is loaded: there torch would import its compiler, 1.8 s
            nn.init.normal_(self.velocity.weight, std=0.01)  # it begins with the belief that it stands
        nn.init.zeros_(self.velocity.bias)
        # no weights, but on the network's device; they have their numbers even where networks are built without any
        for name, numbers in (
            ("sensed_scale", torch.from_numpy(SENSED_TABLE.scale)),
            ("rows_scale", torch.tensor([s for row in GAIT_ROWS for s in row.scale * row.size], device="cpu")),
            ("default_pose", torch.tensor(DEFAULT_POSE, dtype=torch.float32, device="cpu")),
        ):
            self.register_buffer(name, numbers, persistent=False)

    # ---- memory -----------------------------------------------------------------------------------------------------

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The state of n robots that remember nothing."""
        gait = torch.zeros(1, n, sum(_GAIT_NUMBERS), device=device)
        map_ = () if self.elevation is None else (x[None] for x in self.elevation.start(n, device))
        return (*self.memory.initial_state(n, device), gait, torch.zeros(1, n, 3, device=device), *map_)

    @property
    def state_names(self) -> tuple[str, ...]:
        """What the parts of ``initial_state`` are called in an exported file."""
        network = ("hidden", "cell") if self.memory.remembers else ()
        return (*network, "gait", "velocity", *(() if self.elevation is None else MapState._fields))

    def unpack(self, state: State) -> Memory:
        """A state as what it means."""
        parts = dict(zip(self.state_names, state, strict=True))
        n = parts["velocity"].shape[1]
        fields = parts["gait"][0].split(_GAIT_NUMBERS, 1)
        lift, target = (x.reshape(n, 4, 3) for x in fields[3:5])
        gait = GaitState(fields[0], fields[1][:, 0], fields[2], lift, target, fields[5], fields[6][:, 0], fields[7])
        map_ = None if self.elevation is None else MapState(*(parts[name][0] for name in MapState._fields))
        network = tuple(parts[name] for name in ("hidden", "cell") if name in parts)
        return Memory(network, gait, parts["velocity"][0], map_)

    @staticmethod
    def pack(memory: Memory) -> State:
        """What ``unpack`` takes back."""
        gait = torch.cat([field.reshape(len(field), -1) for field in memory.gait], 1)
        return (*memory.network, gait[None], memory.velocity[None], *(x[None] for x in memory.map or ()))

    def footholds(self, state: State) -> Float[Tensor, "n 4 3"]:
        """Where the feet come down next, in the robots' heading frames [m]."""
        return self.unpack(state).gait.target

    # ---- parts of a step --------------------------------------------------------------------------------------------

    def stance(self, vector: Float[Tensor, "n 45"]) -> Stance:
        """What the scaled numbers say."""
        plain, felt, first = vector / self.sensed_scale, {}, 0
        for term in SENSED_TABLE:
            felt[term.name] = plain[:, first : first + term.size]
            first += term.size
        felt["joint_position"] = felt["joint_position"] + self.default_pose
        joints, gravity = felt["joint_position"], felt["projected_gravity"]
        axes, feet = heading_axes(torch, gravity), feet_in_trunk(torch, joints)
        speeds, turning = felt["joint_velocity"], felt["base_angular_velocity"]
        by_feet = velocities_by_feet(torch, feet, joints, speeds, gravity, turning)
        return Stance(felt, axes, into_heading_frame(axes, feet), by_feet)

    def network_input(self, vector: Float[Tensor, "n 45"], stance: Stance, memory: Memory) -> Float[Tensor, "n 68"]:
        """What the estimator of the velocity is given: the robot's senses, the legs' phases, the velocity that it last
        believed, and how fast the trunk would move if each foot rolled on the ground [m/s]."""
        angle = 2 * torch.pi * memory.gait.phases
        return torch.cat([vector, torch.sin(angle), torch.cos(angle), memory.velocity, stance.by_feet.flatten(1)], 1)

    def estimate(
        self, inputs: Float[Tensor, "t n 68"], state: State, fresh: Bool[Tensor, "t n"]
    ) -> tuple[Float[Tensor, "t n 3"], State]:
        """Velocities of the trunk in t steps in a row from ``network_input`` [m/s], and the memory network's state."""
        features, state = self.memory(None, inputs, state, fresh)
        return self.velocity(features), state

    def believe(self, said: Float[Tensor, "n 3"], stance: Stance, memory: Memory) -> Float[Tensor, "n 3"]:
        """The velocity of the trunk [m/s]: what the network says, drawn to what feet tell that stand and agree with it.

        A network that was trained with noise smooths over time, and errs in the same direction for a second, in which
        everything on the map moves by as much. Feet that hold the ground do not."""
        told = stance.by_feet
        apart = ((told - said[:, None])[..., :2] ** 2).sum(-1)
        weight = torch.where(swings(torch, self.gait, memory.gait), 0.0, torch.exp(-apart / _SLIP**2))[..., None]
        total = weight.sum(1)
        by_feet = (told * weight).sum(1) / total.clamp(min=1e-6)
        level = torch.lerp(said, by_feet, _TRUST * total / (total + _DOUBT))
        return torch.cat([level[:, :2], said[:, 2:]], 1)

    def survey(
        self,
        image: Float[Tensor, "n height width"] | None,
        stance: Stance,
        velocity: Tensor,
        then: Memory,
        age: Float[Tensor, " n"] | None = None,
    ) -> tuple[Float[Tensor, "n 741"], MapState | None]:
        """Heights about the robot, and the map after this step's image, which is ``age`` [s] old."""
        if self.elevation is None or then.map is None or image is None:
            return torch.zeros(len(velocity), len(POINTS), device=velocity.device), None
        felt, axes, feet, _ = stance
        now = self.elevation.move(then.map, motion_of(torch, axes, velocity, felt["base_angular_velocity"]))
        now = self.elevation.see(now, image, axes, floor_under(torch, feet), age)
        return self.elevation.read(now), now

    def begin(self, stance: Stance, memory: Memory, fresh: Bool[Tensor, " n"]) -> Memory:
        """The memory before a step: robots that are fresh stand with their feet where they are."""
        start = start_gait(torch, self.gait, stance.feet)
        gait = GaitState(
            *(
                torch.where(fresh.reshape(-1, *(1,) * (a.ndim - 1)), a, b)
                for a, b in zip(start, memory.gait, strict=True)
            )
        )
        map_ = memory.map
        if self.elevation is not None and map_ is not None:
            map_ = self.elevation.forget(map_, fresh if self.remembers else torch.ones_like(fresh))
        return Memory(memory.network, gait, torch.where(fresh[:, None], 0.0, memory.velocity), map_)

    def walk(
        self, vector: Float[Tensor, "n 45"], stance: Stance, said: Prediction, memory: Memory, adapt: bool = False
    ) -> tuple[Float[Tensor, "n 12"], GaitState]:
        """Actions of what is believed, or known to be right, and the gait after them; ``adapt``: by the command of
        ``adapt_command``. Trainings walk as they are told."""
        felt, axes, feet, _ = stance
        view, command = LocalMapView(torch, said.heights, floor_under(torch, feet)), felt["command"]
        if adapt:
            command = adapt_command(torch, self.gait, view, command, feet)
            scaled = command * self.sensed_scale[_COMMAND]
            vector = torch.cat([vector[:, : _COMMAND.start], scaled, vector[:, _COMMAND.stop :]], 1)
        motion = motion_of(torch, axes, said.velocity, felt["base_angular_velocity"])
        level = into_heading_frame(axes, said.velocity)[:, :2]
        gait = tick(torch, self.gait, memory.gait, motion, command, feet)
        plan = plan_footholds(torch, self.gait, view, gait, level, command, feet)
        gait = aim(torch, self.gait, gait, plan, level, command, feet)
        rows = gait_rows(torch, self.gait, gait, feet) * self.rows_scale
        scale = STEPPING_TABLE.terms[0].scale[0]
        observed = torch.cat([said.velocity * scale, vector, rows], 1)
        return self.actor(observed), gait

    def forward(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n 45"],
        state: State,
        fresh: Bool[Tensor, "t n"],
        age: Float[Tensor, "t n"] | None = None,
    ) -> tuple[Float[Tensor, "t n actions"], State]:
        """Actions of t steps in a row.

        Args:
            depth: (t, n, H, W) in [0, 1], negative where nothing returned: prepared by the camera record of the card.
            vector: (t, n, 45) scaled ``SENSED_TABLE``.
            fresh: (t, n) an episode begins with this step.
            age: (t, n) of the images [s]; None: they are of now.

        Returns:
            (t, n, 12) actions, and the state after the last step.
        """
        actions = []
        for k in range(len(fresh)):
            stance = self.stance(vector[k])
            memory = self.begin(stance, self.unpack(state), fresh[k])
            inputs = self.network_input(vector[k], stance, memory)[None]
            said, network = self.estimate(inputs, memory.network, fresh[k : k + 1])
            image, old = None if depth is None else depth[k], None if age is None else age[k]
            velocity = self.believe(said[0], stance, memory)
            heights, map_ = self.survey(image, stance, velocity, memory, old)
            action, gait = self.walk(vector[k], stance, Prediction(velocity, heights), memory, adapt=True)
            actions.append(action)
            state = self.pack(Memory(network, gait, velocity, map_))
        return torch.stack(actions), state


assert sum(row.size for row in GAIT_ROWS) == GAIT_SIZE
