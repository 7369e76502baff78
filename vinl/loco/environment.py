"""The 50 Hz locomotion environment: thousands of robots on one terrain, one compiled step for all of them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from vinl.loco.commands import DRAWS, draw_commands
from vinl.loco.config import LocoConfig, RewardConfig
from vinl.loco.curriculum import next_levels
from vinl.loco.lost import KEPT, REASONS, Lost, keep_lost
from vinl.loco.measures import TERMS, average_sums, sum_measures, tile_cover
from vinl.loco.rewards import Motion, reward_terms
from vinl.loco.simulation import Body, Contacts, Ground, Simulation
from vinl.loco.state import State, count_steps, first_state, start_body, strip_weak_types
from vinl.robot.aliengo import ACTION_SCALE, CONTROL_DT, DEFAULT_POSE
from vinl.robot.observation import CLIP, NOISE, observe
from vinl.robot.rotation import rotate_inverse
from vinl.sensing.height_scan import scan_ground
from vinl.world.terrain import build_terrain

_EDGE = 2.0
"""An episode ends as by time this near to the edge of the terrain [m]."""

MAX_SPEED = 150.0
"""A speed beyond this [m/s, rad/s] means that the physics blew up."""

_UPSIDE = -0.3
"""Third component of the gravity vector in the trunk above which the robot has fallen: tilted by more than 72 deg."""


class StepResult(NamedTuple):
    """What a step gives to the learner.

    Attributes:
        observation: (n, numbers) with noise, for the actor; exact: the same without, for the critic.
        reward: (n,); done: (n,) 1 where fallen or out of time; timeout: (n,) 1 where out of time.
        pose: (n, 7) position [m] and quaternion of the trunk, which belong to the observation.
    """

    observation: Float[Array, "n numbers"]
    exact: Float[Array, "n numbers"]
    reward: Float[Array, " n"]
    done: UInt8[Array, " n"]
    timeout: UInt8[Array, " n"]
    pose: Float[Array, "n 7"]


class LocoEnvironment:
    """Robots that learn to follow velocity commands.

    Args:
        config: the training's configuration.
        seed: of commands, starts, noise, randomisation; defaults to the configuration's.

    Attributes:
        terrain: the ground with its tiles.
        state: of all robots; ``step`` replaces it.
        num_envs: number of robots.
    """

    def __init__(self, config: LocoConfig, seed: int | None = None) -> None:
        self.config = config
        self.num_envs = config.num_envs
        self.terrain = build_terrain(config.terrain)
        self.simulation = Simulation(self.terrain.ground, config.kp, config.kd, self.terrain.blocks)
        self.episode_steps = count_steps(config)
        device = jax.devices()[0]
        self._starts = jax.device_put(jnp.asarray(self.terrain.starts, jnp.float32), device)
        frame = self.simulation.frame
        cover = tile_cover(self.terrain) if len(self.terrain.blocks) else np.zeros(self.terrain.starts.shape[:2])
        self._cover = jax.device_put(jnp.asarray(cover, jnp.float32), device)
        self._edge = np.array([-frame.x0, -frame.y0]) - _EDGE
        self.set_rewards(config.rewards)
        self._step = jax.jit(self._advance, donate_argnums=(1, 2))
        self._look = jax.jit(self._observations)
        key = jax.random.PRNGKey(config.seed if seed is None else seed)
        self.state: State = jax.device_put(jax.jit(self._first_state)(key), device)
        self._lost: Lost = jax.device_put(Lost.none(), device)

    def set_rewards(self, rewards: RewardConfig) -> None:
        """Weights and widths from the next step on; a training may move them without compiling anew."""
        self._rewards = {name: np.float32(value) for name, value in asdict(rewards).items()}

    # ---- what the learner calls -----------------------------------------------------------------------------------

    def observe(self) -> tuple[Float[Array, "n numbers"], Float[Array, "n numbers"]]:
        """The observations of the present state, with noise and without."""
        return self._look(self.simulation.ground, self.state)

    def trunk_pose(self) -> Float[Array, "n 7"]:
        """Position [m] and quaternion of the trunks in the present state; a copy that outlives the next step."""
        return jnp.array(self.state.body.qpos[:, :7])

    def step(self, action: Float[Array, "n 12"]) -> StepResult:
        """One control step; robots whose episode ends start anew at once. The old state is given up."""
        self.state, self._lost, result = self._step(
            self.simulation.ground, self.state, self._lost, action, self._rewards
        )
        return result

    def read_measures(self) -> dict[str, float]:
        """The sums since the last call, as means over robot steps, and set to zero. The only wait for the device."""
        sums = np.asarray(self.state.sums, dtype=np.float64)
        self.state = self.state._replace(sums=jax.device_put(jnp.zeros_like(self.state.sums), jax.devices()[0]))
        return average_sums(sums)

    def take_lost(self) -> list[dict[str, Any]]:
        """The states before the steps that went wrong since the last call, of at most ``lost.KEPT`` robots: the fields
        of ``Lost`` by name, with the reason in words. Waits for the device: call it when ``not_finite`` says so."""
        lost = {name: np.asarray(column) for name, column in self._lost._asdict().items()}
        self._lost = jax.device_put(Lost.none(), jax.devices()[0])
        total, seed = int(lost.pop("total")), self.config.seed
        return [
            {
                **{name: column[k] for name, column in lost.items()},
                "reason": REASONS[int(lost["reason"][k])],
                "seed": seed,
            }
            for k in range(min(total, KEPT))
        ]

    # ---- inside ---------------------------------------------------------------------------------------------------

    def _first_state(self, key: Array) -> State:
        return first_state(self.config, self._starts, key)

    def _observations(
        self, ground: Ground, state: State
    ) -> tuple[Float[Array, "n numbers"], Float[Array, "n numbers"]]:
        """With noise and without. The noise is the state's own, so that a state that is loaded observes the same."""
        body = state.body
        heights = scan_ground(jnp, ground.heights, self.simulation.frame, body.qpos)
        exact = observe(jnp, body.qpos, body.qvel, state.command, state.action, heights)
        noise = jax.random.uniform(jax.random.fold_in(state.key, 1), exact.shape)
        return exact + self.config.randomisation.observation_noise * jnp.asarray(NOISE) * (2 * noise - 1), exact

    def _advance(
        self, ground: Ground, old: State, lost: Lost, given: Float[Array, "n 12"], rewards: dict[str, Any]
    ) -> tuple[State, Lost, StepResult]:
        c, n = self.config, self.num_envs
        key, draw = jax.random.split(old.key)
        u = jax.random.uniform(draw, (n, 40))
        action = jnp.clip(jnp.nan_to_num(given), -CLIP, CLIP)
        target = jnp.asarray(DEFAULT_POSE, jnp.float32) + ACTION_SCALE * action
        body, contacts, torque = self.simulation.step(ground, old.body, target, old.friction, old.added_mass)

        # what is not finite counts as a fall and never reaches the learner
        wrong = {
            "physics": ~jnp.isfinite(body.qpos.sum(1) + body.qvel.sum(1) + body.warmstart.sum(1) + torque.sum(1)),
            "speed": jnp.abs(body.qvel).max(1) > MAX_SPEED,
            "action": ~jnp.isfinite(given).all(1),
            "observation": old.life < 0,  # noted at the end of the last step
        }
        broken = jnp.any(jnp.stack(list(wrong.values())), 0)
        body = Body(*(jnp.where(broken[:, None], last, now) for now, last in zip(body, old.body, strict=True)))
        torque = jnp.where(broken[:, None], 0.0, torque)

        motion, touching = self._motion(old, body, contacts, torque, action, broken)
        terms = reward_terms(motion, rewards["sigma"])
        weighted = {name: terms[name] * (rewards[name] * CONTROL_DT) for name in TERMS}
        wrong["reward"] = ~jnp.isfinite(jnp.sum(jnp.stack(list(weighted.values())), 0))
        broken, motion = broken | wrong["reward"], motion._replace(fallen=motion.fallen | wrong["reward"])
        weighted = {name: jnp.where(wrong["reward"], 0.0, value) for name, value in weighted.items()}
        weighted["fall"] = motion.fallen * rewards["fall"]
        lost = keep_lost(lost, jnp.stack([wrong[name] for name in REASONS]), old, given)
        total = jnp.sum(jnp.stack([value for name, value in weighted.items() if name != "fall"]), 0)
        floor = rewards["floor"] * CONTROL_DT
        clipped = total < floor
        reward = jnp.maximum(total, floor) + weighted["fall"]

        # ends of episodes and levels
        speed = jnp.linalg.norm(old.command[:, :2], axis=1)
        along = jnp.sum(motion.linear[:, :2] * old.command[:, :2], 1) / jnp.maximum(speed, 1e-6)
        way = old.way + jnp.minimum(along, speed) * (speed > 0) * CONTROL_DT
        commanded = old.commanded + speed * CONTROL_DT
        step, life = old.step + 1, old.life + 1
        hits = old.hits + (contacts.foot_block | contacts.shank_block).any(1)
        outside = jnp.any(jnp.abs(body.qpos[:, :2]) > self._edge, 1)
        timeout = ((step >= self.episode_steps) | outside) & ~motion.fallen
        done = motion.fallen | timeout
        level = next_levels(
            c.curriculum,
            c.terrain.levels,
            old.level,
            timeout,
            motion.fallen,
            way,
            commanded,
            jnp.maximum(life, 1) / self.episode_steps,
            u[:, 35],
            hits,
        )
        moved = jnp.linalg.norm(body.qpos[:, :2] - old.body.qpos[:, :2], axis=1)
        over = self.simulation.over_block(ground, body.qpos[:, :2])
        cover = self._cover[old.level, old.column]
        sums = sum_measures(motion, old.level, reward, weighted, clipped, moved, timeout, life, broken, over, cover)

        # pushes, new starts, new commands
        push = old.push_left <= 0
        shove = c.randomisation.push_speed * (2 * u[:, 36:38] - 1)
        body = body._replace(qvel=jnp.where(push[:, None], body.qvel.at[:, :2].set(shove), body.qvel))
        level = jnp.where(done, level, old.level)
        fresh = start_body(c.randomisation, self._starts, level, old.column, u[:, :22])
        command, left = draw_commands(c.commands, u[:, 22 : 22 + DRAWS])
        renew = done | (old.command_left <= 0)

        def ended(start: Array, going: Array) -> Array:
            return jnp.where(done.reshape((n,) + (1,) * (going.ndim - 1)), start, going)

        state = State(
            key=key,
            body=Body(*(ended(start, going) for start, going in zip(fresh, body, strict=True))),
            action=ended(jnp.zeros_like(action), action),
            command=jnp.where(renew[:, None], command, old.command),
            command_left=jnp.where(renew, left, old.command_left - 1),
            push_left=jnp.where(push, round(c.randomisation.push_interval / CONTROL_DT), old.push_left - 1),
            step=jnp.where(done, 0, step),
            life=jnp.where(done, 0, life),
            air_time=ended(jnp.zeros((n, 4)), motion.air_time * ~touching),
            touched=ended(jnp.zeros((n, 4), bool), contacts.foot),
            way=jnp.where(done, 0.0, way),
            commanded=jnp.where(done, 0.0, commanded),
            hits=jnp.where(done, 0.0, hits),
            level=level,
            column=old.column,
            friction=old.friction,
            added_mass=old.added_mass,
            sums=old.sums + sums,
        )
        state = strip_weak_types(state)
        noisy, exact = self._observations(ground, state)
        blind = ~jnp.isfinite(exact.sum(1))
        noisy, exact = (jnp.where(blind[:, None], 0.0, x) for x in (noisy, exact))
        state = state._replace(life=jnp.where(blind, -1, state.life))  # the next step sets the robot back
        ends = done.astype(jnp.uint8), timeout.astype(jnp.uint8)
        return state, lost, StepResult(noisy, exact, reward, *ends, state.body.qpos[:, :7])

    def _motion(
        self, old: State, body: Body, contacts: Contacts, torque: Array, action: Array, broken: Array
    ) -> tuple[Motion, Bool[Array, "n 4"]]:
        """What the rewards look at, and which feet count as on the ground (now or a step ago [legged_gym])."""
        quaternion = body.qpos[:, 3:7]
        down = jnp.broadcast_to(jnp.array([0.0, 0.0, -1.0]), (self.num_envs, 3))
        gravity = rotate_inverse(jnp, quaternion, down)
        touching = contacts.foot | old.touched
        linear, angular = rotate_inverse(jnp, quaternion, body.qvel[:, :3]), body.qvel[:, 3:6]
        motion = Motion(
            linear=linear,
            angular=angular,
            gravity=gravity,
            joints=body.qpos[:, 7:],
            joint_speed=body.qvel[:, 6:],
            last_joint_speed=old.body.qvel[:, 6:],
            torque=torque,
            action=action,
            last_action=old.action,
            command=old.command,
            contacts=contacts,
            air_time=old.air_time + CONTROL_DT,
            landed=(old.air_time > 0) & touching,
            fallen=contacts.trunk_down | (gravity[:, 2] > _UPSIDE) | broken,
        )
        return motion, touching
