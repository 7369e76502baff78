"""MJX physics of many robots on one height field, one control step at a time, contacts latched over its substeps."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt8
from mujoco import mjx
from mujoco.mjx._src import collision_driver
from scipy import ndimage

from vinl.gait.ground_view import GroundMap, build_ground_map
from vinl.loco.randomisation import Traits
from vinl.robot.aliengo import (
    FOOT_GEOMS,
    FOOT_RADIUS,
    JOINT_SPEED_LIMIT,
    LEGS,
    PHYSICS_DT,
    SHANK_SPHERES,
    SUBSTEPS,
    TORQUE_LIMIT,
    TRUNK_SPHERES,
)
from vinl.robot.model import robot_spec
from vinl.world.boxes import Blocks, Boxes
from vinl.world.grid import BLOCK, FAR, WALL, HeightField, block_distances, clearance

# TF32 would round a position of 80 m to 6 cm: matrix products in full float32.
jax.config.update("jax_default_matmul_precision", "highest")

FEET, SHANKS, TRUNK = len(FOOT_GEOMS), len(SHANK_SPHERES), len(TRUNK_SPHERES)
LEG_SPHERES = FEET + SHANKS
_NEAR = 2
"""A contact counts for a block when one lies within this many cells: the sides of a height field slope over one."""

SHANK_LINE = np.linspace([0.0, 0.0, 0.0], [0.012, 0.0, -0.22], 8)
"""Points along the axis of a shank, in the frame of its body [m]: the capsule of the primitives in aliengo.xml."""

SHANK_REACH = 0.018
"""A shank nearer than this to a block [m] touches it: the capsule's 0.0145 m and the error of the grid. Chosen so that
the count agrees with MuJoCo C's contacts of the capsule on the same motion."""

FOOT_REACH = FOOT_RADIUS + 0.02
"""A foot whose middle is farther than this from any block [m] does not touch one: what it touches then is the slope
that the height field has for the block's side, up to a cell wide."""

_BEHIND = (("FL", "RL"), ("FR", "RR"))
_BESIDE = (("FL", "FR"), ("RL", "RR"))

LEG_PAIRS = tuple(
    (f"{a}_{low}", f"{b}_{high}")
    for neighbours, parts in (
        (_BEHIND, (("foot", "foot"), ("shank2", "foot"), ("foot", "shank2"), ("shank1", "foot"))),
        (_BESIDE, (("foot", "foot"), ("shank2", "shank2"))),
    )
    for a, b in neighbours
    for low, high in parts
)
"""Spheres of neighbouring legs that collide: a few of the many, where legs met in MuJoCo C."""

FULL_TORQUE = 0.7
"""Up to this fraction of its largest speed a joint has its whole torque; from there on what speeds it up falls evenly
to nothing at the largest. The maker gives the two ends alone: this is an assumption."""

PAST = 3
"""Joint targets that a robot keeps, the newest first: an action may take effect up to two control steps late."""


class DeviceGround(NamedTuple):
    """The ground on the device. It travels as an argument: as a constant it would be copied into the program.

    Attributes:
        normalised: (rows * columns,) heights that robots collide with, scaled to [0, 1] as MuJoCo stores them.
        heights: (rows * columns,) heights that the scan reads [m].
        near: (rows * columns,) bit 1: a block lies near; bit 2: a wall lies near.
        distance, top: (rows * columns,) distance from the nearest block and its height [m]; one number where the ground
            has no blocks.
        solid: whether the blocks collide.
    """

    normalised: Float[Array, " cells"]
    heights: Float[Array, " cells"]
    near: Array
    distance: Float[Array, " cells"]
    top: Float[Array, " cells"]
    map: GroundMap
    solid: Bool[Array, ""]


class Body(NamedTuple):
    """State of the robots in the physics engine.

    Attributes:
        qpos: (n, 19), qvel: (n, 18), warmstart: (n, 18) accelerations that the solver starts from.
    """

    qpos: Float[Array, "n 19"]
    qvel: Float[Array, "n 18"]
    warmstart: Float[Array, "n 18"]


class Contacts(NamedTuple):
    """What touched something at any substep of the control step.

    Attributes:
        foot, shank: (n, 4) anything; trunk: (n,) anything; trunk_down: (n,) something from above.
        foot_block, shank_block, foot_wall, shank_wall: (n, 4) a block, a wall. A block that is no obstacle yet counts
            where a foot or a shank is in it.
        crossing: (n,) one leg another.
    """

    foot: Bool[Array, "n 4"]
    shank: Bool[Array, "n 4"]
    trunk: Bool[Array, " n"]
    trunk_down: Bool[Array, " n"]
    foot_block: Bool[Array, "n 4"]
    shank_block: Bool[Array, "n 4"]
    foot_wall: Bool[Array, "n 4"]
    shank_wall: Bool[Array, "n 4"]
    crossing: Bool[Array, " n"]

    @classmethod
    def none(cls) -> Contacts:
        """Of one robot that touches nothing."""
        legs, one = jnp.zeros(FEET, bool), jnp.zeros((), bool)
        return cls(legs, legs, one, one, legs, legs, legs, legs, one)


class Simulation:
    """Robots with sphere feet, shanks and trunk on a height field.

    Args:
        field: the ground; its frame's centre must be the world's origin.
        kp, kd: joint gains [N m / rad, N m s / rad].
        blocks: those on the ground: the whole length of the shanks is held against them. The three spheres of a shank
            leave gaps through which the edge of a block slips.
        walls: what else footholds must keep off.

    Attributes:
        ground: the arrays that ``step`` needs; ``set_solid`` changes whether its blocks collide.
    """

    def __init__(
        self, field: HeightField, kp: float, kd: float, blocks: Blocks | None = None, walls: Boxes | None = None
    ) -> None:
        self.frame = field.frame
        rows, columns = field.frame.shape
        low, span = float(field.heights.min()), max(float(np.ptp(field.heights)), 0.1)
        half = [(columns - 1) * field.frame.resolution / 2, (rows - 1) * field.frame.resolution / 2]
        spec = robot_spec("spheres", kp=kp, kd=kd)
        normalised = ((field.heights - low) / span).astype(np.float32).reshape(-1)
        spec.add_hfield(name="ground", nrow=rows, ncol=columns, size=[*half, span, 1.0], userdata=normalised)
        spec.worldbody.add_geom(
            name="ground",
            type=mujoco.mjtGeom.mjGEOM_HFIELD,
            hfieldname="ground",
            pos=[0, 0, low],
            contype=1,
            conaffinity=0,
            condim=1,
        )
        for a, b in LEG_PAIRS:
            spec.add_pair(geomname1=a, geomname2=b, condim=1)
        self.model = spec.compile()
        self.model.hfield_data[:] = normalised
        mx = mjx.put_model(self.model, impl="jax")
        self._start = mjx.make_data(self.model, impl="jax")
        self._mx = mx.replace(hfield_data=jnp.zeros(1))  # the real one comes in with DeviceGround
        self._feet = np.array([self.model.geom(name).id for name in FOOT_GEOMS])
        spheres = [self.model.geom(name).id for name in (*FOOT_GEOMS, *SHANK_SPHERES, *TRUNK_SPHERES)]
        self._spheres = np.array(spheres)
        self._trunk = self.model.body("trunk").id
        self._calves = np.array([self.model.body(f"{leg}_calf").id for leg in LEGS])
        self._has_blocks = blocks is not None and len(blocks) > 0
        boxes = blocks.boxes() if blocks is not None else Boxes.empty()
        distance, top = np.zeros((1, 1)), np.zeros((1, 1))
        if self._has_blocks:
            distance, top = block_distances(field.frame, boxes)
        near = _near(field, BLOCK) + 2 * _near(field, WALL)
        floor = np.where(field.labels == WALL, 0.0, field.heights).astype(np.float32)
        ground_map = build_ground_map(floor, field.frame, boxes + (Boxes.empty() if walls is None else walls))
        grids = (normalised, field.heights, near, distance, top)
        # committed arrays only: a mixture of committed and uncommitted ones compiles every program twice
        ground = DeviceGround(*(x.reshape(-1) for x in grids), map=ground_map, solid=np.ones((), bool))  # type: ignore[arg-type]
        self.ground: DeviceGround = jax.device_put(jax.tree.map(jnp.asarray, ground), jax.devices()[0])
        bare = np.where(field.labels == BLOCK, 0.0, field.heights)  # blocks stand on level tiles
        self._bare = ((bare - low) / span).astype(np.float32).reshape(-1)
        self._solid, self._is_solid = normalised, True
        self._ground_rows, self._leg_rows = self._find_contact_rows()
        self._substeps = jax.vmap(self._control_step, in_axes=(None, 0, 0, 0))

    def save_model(self) -> UInt8[np.ndarray, " bytes"]:
        """The robot, the ground and how they collide, as MuJoCo saves them."""
        saved = np.empty(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, saved)
        return saved

    def set_solid(self, solid: bool) -> None:
        """From the next step on blocks collide, or are only seen and judged; nothing is compiled anew."""
        if solid == self._is_solid:  # asked before every iteration: without a wait for the device
            return
        self._is_solid = solid
        device = jax.devices()[0]
        normalised = jax.device_put(jnp.asarray(self._solid if solid else self._bare), device)
        flag = jax.device_put(jnp.asarray(np.array(solid)), device)
        self.ground = self.ground._replace(normalised=normalised, solid=flag)

    def _find_contact_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """(spheres, 4) which rows of MJX's contact arrays hold which sphere against the ground, and (k,) which a leg
        against another: they never change."""
        # as mjx.collision lays them out; to trace it for this alone would take seconds
        groups = sorted(collision_driver._geom_groups(self.model).items(), key=lambda item: item[0].condim)
        points = [collision_driver._COLLISION_FUNC[key.types].ncon for key, _ in groups]  # type: ignore[index]
        geom = np.concatenate([np.repeat(pairs, n, 0) for n, (_, pairs) in zip(points, groups, strict=True)])[:, :2]
        on_ground = (geom == self.model.geom("ground").id).any(1)
        rows = np.stack([np.flatnonzero((geom == sphere).any(1) & on_ground) for sphere in self._spheres])
        if rows.size != on_ground.sum():
            raise RuntimeError(f"contact rows of the spheres have shape {rows.shape}, {on_ground.sum()} are on ground")
        return rows, np.flatnonzero(~on_ground)

    def cell(self, xy: Float[Array, "*n 2"]) -> Array:
        """Flat indices of the cells that hold the points, held to the field's edge."""
        f = self.frame
        j = jnp.clip(jnp.round((xy[..., 0] - f.x0) / f.resolution), 0, f.shape[1] - 1).astype(jnp.int32)
        i = jnp.clip(jnp.round((xy[..., 1] - f.y0) / f.resolution), 0, f.shape[0] - 1).astype(jnp.int32)
        return i * f.shape[1] + j

    def block_distance(self, ground: DeviceGround, xy: Float[Array, "*n 2"]) -> Float[Array, "*n"]:
        """Distance of points [m] from the nearest block's footprint, to half a cell, at most ``FAR``; negative over
        one."""
        if not self._has_blocks:
            return jnp.full(xy.shape[:-1], FAR)
        return ground.distance[self.cell(xy)]

    def step(
        self,
        ground: DeviceGround,
        body: Body,
        targets: Float[Array, "n past 12"],
        delay: Int[Array, " n"],
        traits: Traits,
    ) -> tuple[Body, Contacts, Float[Array, "n 12"]]:
        """One control step of all robots.

        Args:
            ground: ``self.ground``.
            targets: joint targets of this control step and of those before it, the newest first [rad].
            delay: physics steps until a target takes effect, at most ``SUBSTEPS`` * (``PAST`` - 1).

        Returns:
            The new state, the latched contacts and the torques of the last substep [N m].
        """
        return self._substeps(ground, body, (targets, delay), traits)

    def robot_model(self, ground: DeviceGround, traits: Traits) -> mjx.Model:
        """The model of one robot on its ground; ``traits`` without their first axis."""
        mx = self._mx
        gain = mx.actuator_gainprm.at[:, 0].multiply(traits.kp)
        bias = mx.actuator_biasprm.at[:, 1].multiply(traits.kp).at[:, 2].multiply(traits.kd)
        return mx.replace(
            hfield_data=ground.normalised,
            geom_friction=mx.geom_friction.at[self._feet, 0].set(traits.friction),
            body_mass=mx.body_mass.at[self._trunk].add(traits.added_mass),
            actuator_gainprm=gain,
            actuator_biasprm=bias,
            dof_frictionloss=mx.dof_frictionloss * traits.joint_friction,
            dof_damping=mx.dof_damping * traits.joint_friction,
        )

    def physics_step(self, model: mjx.Model, body: Body, target: Float[Array, "12"]) -> mjx.Data:
        """5 ms of one robot with joint targets [rad]."""
        model = model.replace(actuator_forcerange=torque_range(jnp, body.qvel[6:]))
        qpos, qvel, warm = body
        return mjx.step(model, self._start.replace(qpos=qpos, qvel=qvel, qacc_warmstart=warm, ctrl=target))

    def _control_step(
        self, ground: DeviceGround, body: Body, told: tuple[Float[Array, "past 12"], Int[Array, ""]], traits: Traits
    ) -> tuple[Body, Contacts, Float[Array, "12"]]:
        """The substeps of one robot."""
        model = self.robot_model(ground, traits)
        targets, delay = told

        def substep(carry, k):
            body, contacts, _ = carry
            data = self.physics_step(model, body, targets[target_age(k, delay)])
            contacts = jax.tree.map(jnp.logical_or, contacts, self._touching(ground, data))
            return (Body(data.qpos, data.qvel, data.qacc_warmstart), contacts, data.actuator_force), None

        start = body, Contacts.none(), jnp.zeros(12)
        return jax.lax.scan(substep, start, jnp.arange(SUBSTEPS))[0]

    def _touching(self, ground: DeviceGround, data: mjx.Data) -> Contacts:
        """The contacts of one robot after a physics step."""
        contact = data._impl.contact
        on = contact.dist[self._ground_rows] < 0
        up, z = contact.frame[:, 0, 2][self._ground_rows], contact.pos[:, 2][self._ground_rows]
        # blocks and walls stand on level ground at z = 0: what is higher or leans is not that ground
        raised = jnp.any(on[:LEG_SPHERES] & ((up[:LEG_SPHERES] < 0.7) | (z[:LEG_SPHERES] > 0.02)), 1)
        near = ground.near[self.cell(data.geom_xpos[self._spheres[:LEG_SPHERES], :2])]
        block, wall, touch = raised & ((near & 1) > 0), raised & (near == 2), jnp.any(on, 1)
        foot_block, shank_block = block[:FEET], _by_leg(block[FEET:])
        if self._has_blocks:
            free, beside = self._at_blocks(ground, data)
            foot_block = (foot_block & (free < FOOT_REACH)) | (free < FOOT_RADIUS)
            shank_block = shank_block | beside
        return Contacts(
            foot=touch[:FEET],
            shank=_by_leg(touch[FEET:LEG_SPHERES]),
            trunk=jnp.any(touch[LEG_SPHERES:]),
            trunk_down=jnp.any(on[LEG_SPHERES:] & (up[LEG_SPHERES:] > 0.5)),
            foot_block=foot_block,
            shank_block=shank_block,
            foot_wall=wall[:FEET],
            shank_wall=_by_leg(wall[FEET:]),
            crossing=jnp.any(contact.dist[self._leg_rows] < 0),
        )

    def _at_blocks(self, ground: DeviceGround, data: mjx.Data) -> tuple[Float[Array, "4"], Bool[Array, "4"]]:
        """By geometry: how far the middles of one robot's feet are from the blocks [m], and which of its shanks touch
        one, anywhere along their length."""
        line = data.xpos[self._calves, None] + jnp.einsum("lij,kj->lki", data.xmat[self._calves], SHANK_LINE)
        points = jnp.concatenate([data.geom_xpos[self._feet][:, None], line], 1)
        free = clearance(jnp, ground.distance, ground.top, self.frame, points)
        return free[:, 0], jnp.any(free[:, 1:] < SHANK_REACH, 1)


def target_age(substep: Array, delay: Array) -> Array:
    """How many control steps old the joint target is that acts in a physics step.

    Args:
        delay: physics steps until a target takes effect.
    """
    return jnp.clip((delay - substep + SUBSTEPS - 1) // SUBSTEPS, 0, PAST - 1)


def delay_steps(latency: Float[Array, " n"]) -> Int[Array, " n"]:
    """Latencies [s] in physics steps, to the nearest."""
    return jnp.round(latency / PHYSICS_DT).astype(jnp.int32)


def torque_range(xp: Any, speed: Any) -> Any:
    """(12, 2) least and largest torque of the joints at speeds (12,) [N m, rad/s]: what speeds a joint up fades beyond
    ``FULL_TORQUE`` of its largest speed, what brakes it does not. For numpy and jax.numpy."""
    left = xp.clip((1 - xp.abs(speed) / JOINT_SPEED_LIMIT) / (1 - FULL_TORQUE), 0.0, 1.0)
    faster = TORQUE_LIMIT * left
    return xp.stack([xp.where(speed < 0, -faster, -TORQUE_LIMIT), xp.where(speed > 0, faster, TORQUE_LIMIT)], -1)


def _by_leg(spheres: Bool[Array, " shanks"]) -> Bool[Array, "4"]:
    return spheres.reshape(FEET, SHANKS // FEET).any(1)


def _near(field: HeightField, label: int) -> np.ndarray:
    """(rows, columns) uint8: 1 where a cell with the label lies near."""
    return ndimage.maximum_filter((field.labels == label).astype(np.uint8), 2 * _NEAR + 1)
