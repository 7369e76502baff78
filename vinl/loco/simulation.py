"""MJX physics of many robots on one height field, one control step at a time, contacts latched over its substeps."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float
from mujoco import mjx
from scipy import ndimage

from vinl.robot.aliengo import FOOT_GEOMS, FOOT_RADIUS, SHANK_SPHERES, SUBSTEPS, TRUNK_SPHERES
from vinl.robot.aliengo import LEGS as LEG_NAMES
from vinl.robot.model import robot_spec
from vinl.world.blocks import Blocks
from vinl.world.clearance import FAR, block_distances, clearance
from vinl.world.heightfield import BLOCK, WALL, HeightField

# TF32 would round a position of 80 m to 6 cm: matrix products in full float32.
jax.config.update("jax_default_matmul_precision", "highest")

FEET, SHANKS, TRUNK = len(FOOT_GEOMS), len(SHANK_SPHERES), len(TRUNK_SPHERES)
LEGS = FEET + SHANKS
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


class Ground(NamedTuple):
    """The height field on the device. It travels as an argument: as a constant it would be copied into the program.

    Attributes:
        normalised: (rows * columns,) heights scaled to [0, 1] as MuJoCo stores them.
        heights: (rows * columns,) heights [m].
        near: (rows * columns,) bit 1: a block lies near; bit 2: a wall lies near.
        distance, top: (rows * columns,) distance from the nearest block and its height [m], for the shanks; one number
            where the ground has no blocks.
    """

    normalised: Float[Array, " cells"]
    heights: Float[Array, " cells"]
    near: Array
    distance: Float[Array, " cells"]
    top: Float[Array, " cells"]


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
        foot_block, shank_block, foot_wall, shank_wall: (n, 4) a block, a wall.
    """

    foot: Bool[Array, "n 4"]
    shank: Bool[Array, "n 4"]
    trunk: Bool[Array, " n"]
    trunk_down: Bool[Array, " n"]
    foot_block: Bool[Array, "n 4"]
    shank_block: Bool[Array, "n 4"]
    foot_wall: Bool[Array, "n 4"]
    shank_wall: Bool[Array, "n 4"]


class Simulation:
    """Robots with sphere feet, shanks and trunk on a height field.

    Args:
        field: the ground; its frame's centre must be the world's origin.
        kp, kd: joint gains [N m / rad, N m s / rad].
        blocks: those on the ground: the whole length of the shanks is held against them. The three spheres of a shank
            leave gaps through which the edge of a block slips.

    Attributes:
        ground: the arrays that ``step`` needs.
        frame: where the cells of the ground lie.
        model: the MuJoCo model.
    """

    def __init__(self, field: HeightField, kp: float, kd: float, blocks: Blocks | None = None) -> None:
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
        self.model = spec.compile()
        self.model.hfield_data[:] = normalised
        mx = mjx.put_model(self.model, impl="jax")
        self._start = mjx.make_data(self.model, impl="jax")
        self._mx = mx.replace(hfield_data=jnp.zeros(1))  # the real one comes in with Ground
        self._feet = np.array([self.model.geom(name).id for name in FOOT_GEOMS])
        spheres = [self.model.geom(name).id for name in (*FOOT_GEOMS, *SHANK_SPHERES, *TRUNK_SPHERES)]
        self._spheres = np.array(spheres)
        self._trunk = self.model.body("trunk").id
        self._calves = np.array([self.model.body(f"{leg}_calf").id for leg in LEG_NAMES])
        self._has_blocks = blocks is not None and len(blocks) > 0
        distance, top = np.zeros((1, 1)), np.zeros((1, 1))
        if blocks is not None and len(blocks) > 0:
            distance, top = block_distances(field.frame, blocks.boxes())
        near = _near(field, BLOCK) + 2 * _near(field, WALL)
        # committed arrays only: a mixture of committed and uncommitted ones compiles every program twice
        self.ground = jax.device_put(
            Ground(*(jnp.asarray(x.reshape(-1)) for x in (normalised, field.heights, near, distance, top))),
            jax.devices()[0],
        )
        self._contact_rows = self._find_contact_rows()
        self._substeps = jax.vmap(self._control_step, in_axes=(None, 0, 0, 0, 0, 0, 0))

    def _find_contact_rows(self) -> np.ndarray:
        """(spheres, 4) which rows of MJX's contact arrays belong to which sphere: they never change."""

        def forward(normalised: Array) -> Array:
            mx = self._mx.replace(hfield_data=normalised)
            return mjx.forward(mx, self._start)._impl.contact.geom

        shape = jax.eval_shape(forward, self.ground.normalised)
        geom = np.asarray(jax.jit(forward)(self.ground.normalised))
        rows = np.stack([np.flatnonzero((geom == sphere).any(1)) for sphere in self._spheres])
        if rows.shape != (len(self._spheres), shape.shape[0] // len(self._spheres)):
            raise RuntimeError(f"contact rows of the spheres have shape {rows.shape}")
        return rows

    def cell(self, xy: Float[Array, "*n 2"]) -> Array:
        """Flat indices of the cells that hold the points, held to the field's edge."""
        f = self.frame
        j = jnp.clip(jnp.round((xy[..., 0] - f.x0) / f.resolution), 0, f.shape[1] - 1).astype(jnp.int32)
        i = jnp.clip(jnp.round((xy[..., 1] - f.y0) / f.resolution), 0, f.shape[0] - 1).astype(jnp.int32)
        return i * f.shape[1] + j

    def over_block(self, ground: Ground, xy: Float[Array, "*n 2"]) -> Bool[Array, "*n"]:
        """Whether points [m] lie above a block, to half a cell."""
        if not self._has_blocks:
            return jnp.zeros(xy.shape[:-1], bool)
        return ground.distance[self.cell(xy)] < 0

    def step(
        self, ground: Ground, body: Body, target: Float[Array, "n 12"], friction: Array, added_mass: Array
    ) -> tuple[Body, Contacts, Float[Array, "n 12"]]:
        """One control step of all robots.

        Args:
            ground: ``self.ground``.
            body: state of the robots.
            target: joint targets [rad].
            friction: (n,) of the feet.
            added_mass: (n,) on the trunk [kg].

        Returns:
            The new state, the latched contacts and the torques of the last substep [N m].
        """
        qpos, qvel, warm, flags, torque = self._substeps(ground, *body, target, friction, added_mass)
        n = len(qpos)
        touch, block, wall = (
            flags[:, : LEGS + TRUNK],
            flags[:, LEGS + TRUNK :][:, :LEGS],
            flags[:, 2 * LEGS + TRUNK : 3 * LEGS + TRUNK],
        )

        def by_leg(spheres: Array) -> Array:
            return spheres[:, FEET:LEGS].reshape(n, FEET, SHANKS // FEET).any(2)

        contacts = Contacts(
            foot=touch[:, :FEET],
            shank=by_leg(touch),
            trunk=touch[:, LEGS:].any(1),
            trunk_down=flags[:, -1],
            foot_block=block[:, :FEET],
            shank_block=by_leg(block) | flags[:, 3 * LEGS + TRUNK : -1],
            foot_wall=wall[:, :FEET],
            shank_wall=by_leg(wall),
        )
        return Body(qpos, qvel, warm), contacts, torque

    def robot_model(self, ground: Ground, friction: Array, added_mass: Array) -> mjx.Model:
        """The model of one robot: its ground, the friction of its feet, the mass added to its trunk [kg]."""
        mx = self._mx
        return mx.replace(
            hfield_data=ground.normalised,
            geom_friction=mx.geom_friction.at[self._feet, 0].set(friction),
            body_mass=mx.body_mass.at[self._trunk].add(added_mass),
        )

    def physics_step(self, model: mjx.Model, qpos: Array, qvel: Array, warm: Array, target: Array) -> mjx.Data:
        """5 ms of one robot: (19,), (18,), (18,) of its state and (12,) joint targets [rad]."""
        return mjx.step(model, self._start.replace(qpos=qpos, qvel=qvel, qacc_warmstart=warm, ctrl=target))

    def _control_step(self, ground, qpos, qvel, warm, target, friction, added_mass):
        """The substeps of one robot."""
        model = self.robot_model(ground, friction, added_mass)

        def substep(carry, _):
            qpos, qvel, warm, flags, _ = carry
            data = self.physics_step(model, qpos, qvel, warm, target)
            contact = data._impl.contact
            on = contact.dist[self._contact_rows] < 0
            up, z = contact.frame[:, 0, 2][self._contact_rows], contact.pos[:, 2][self._contact_rows]
            # blocks and walls stand on level ground at z = 0: what is higher or leans is not that ground
            raised = jnp.any(on[:LEGS] & ((up[:LEGS] < 0.7) | (z[:LEGS] > 0.02)), 1)
            near = ground.near[self.cell(data.geom_xpos[self._spheres[:LEGS], :2])]
            block, wall = raised & ((near & 1) > 0), raised & (near == 2)
            free, beside = self._at_blocks(ground, data)
            if self._has_blocks:
                block = jnp.concatenate([block[:FEET] & (free < FOOT_REACH), block[FEET:]])
            down = jnp.any(on[LEGS:] & (up[LEGS:] > 0.5))
            new = jnp.concatenate([jnp.any(on, 1), block, wall, beside, down[None]])
            return (data.qpos, data.qvel, data.qacc_warmstart, flags | new, data.actuator_force), None

        flags = jnp.zeros(3 * LEGS + TRUNK + FEET + 1, bool)
        start = (qpos, qvel, warm, flags, jnp.zeros(12))
        return jax.lax.scan(substep, start, None, length=SUBSTEPS)[0]

    def _at_blocks(self, ground: Ground, data: mjx.Data) -> tuple[Float[Array, "4"], Bool[Array, "4"]]:
        """By geometry: how far the middles of one robot's feet are from the blocks [m], and which of its shanks touch
        one, anywhere along their length."""
        if not self._has_blocks:
            return jnp.full(FEET, FAR), jnp.zeros(FEET, bool)
        line = data.xpos[self._calves, None] + jnp.einsum("lij,kj->lki", data.xmat[self._calves], SHANK_LINE)
        points = jnp.concatenate([data.geom_xpos[self._feet][:, None], line], 1)
        free = clearance(jnp, ground.distance, ground.top, self.frame, points)
        return free[:, 0], jnp.any(free[:, 1:] < SHANK_REACH, 1)


def _near(field: HeightField, label: int) -> np.ndarray:
    """(rows, columns) uint8: 1 where a cell with the label lies near."""
    return ndimage.maximum_filter((field.labels == label).astype(np.uint8), 2 * _NEAR + 1)
