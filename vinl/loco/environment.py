"""The 50 Hz locomotion environment: thousands of robots on one terrain, one compiled step for all of them."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from vinl.gait.observation import GAIT_ROWS, STEPPING_MAP_TABLE, insert_gait, observe_gait
from vinl.gait.state import GaitState, feet_in_heading_frame
from vinl.loco.config import MAX_LATENCY, LocoConfig, RandomisationConfig, RewardConfig
from vinl.loco.curriculum import next_levels
from vinl.loco.kept_program import KeptProgram
from vinl.loco.measures import TERMS, average_sums, sum_measures, tile_cover
from vinl.loco.nan_guard import KEPT, REASONS, Lost, keep_lost
from vinl.loco.randomisation import draw_commands, uniform
from vinl.loco.rewards import Motion, reward_terms
from vinl.loco.simulation import Body, Contacts, DeviceGround, Simulation, delay_steps
from vinl.loco.state import EnvState, begin_episode, count_steps, first_state, strip_weak_types
from vinl.loco.walking import Steps, go_on, local_heights
from vinl.robot.aliengo import ACTION_SCALE, CONTROL_DT, DEFAULT_POSE
from vinl.robot.observation import CLIP, HEIGHT_SCAN, observe
from vinl.robot.rotation import rotate_inverse
from vinl.sensing.height_scan import scan_ground
from vinl.world.endings import MAX_TILT
from vinl.world.terrain import build_terrain

_EDGE = 2.0
"""An episode ends as by time this near to the edge of the terrain [m]."""

MAX_SPEED = 150.0
"""A speed beyond this [m/s, rad/s] means that the physics blew up."""

_VELOCITY = STEPPING_MAP_TABLE.place("base_linear_velocity")

_UPSIDE = -math.cos(MAX_TILT)
"""Third component of the gravity vector in the trunk above which the robot has fallen."""


class Observations(NamedTuple):
    """What is observed of the present state; ``gait.observation.STEPPING_MAP_TABLE`` has the order of the first two.

    Attributes:
        noisy: (n, numbers) with noise and biases, for the actor.
        exact: the same without, for the critic, and for a teacher.
        privileged: (n, 27) what only the critic knows beside them: contacts, the errors of what is
            measured, what the robot is like, and whether blocks collide.
        heights: (n, 741) of the ground at ``gait.local_map.POINTS`` above the floor that the feet stand on [m], in
            stage 3; (n, 0) elsewhere.
        velocity: (n, 3) the exact one of the trunk, in its frame [m/s], which a student learns to estimate.
        pose: (n, 7) position [m] and quaternion of the trunks.
    """

    noisy: Float[Array, "n numbers"]
    exact: Float[Array, "n numbers"]
    privileged: Float[Array, "n privileged"]
    heights: Float[Array, "n points"]
    velocity: Float[Array, "n 3"]
    pose: Float[Array, "n 7"]


class StepResult(NamedTuple):
    """What a step gives to the learner.

    Attributes:
        reward: (n,); done: (n,) 1 where fallen or out of time; timeout: (n,) 1 where out of time.
    """

    observations: Observations
    reward: Float[Array, " n"]
    done: UInt8[Array, " n"]
    timeout: UInt8[Array, " n"]


class Settings(NamedTuple):
    """What moves over a training; it travels as an argument, so that nothing is compiled anew.

    Attributes:
        rewards: weights and widths by their names in ``RewardConfig``.
        noise: how much of noise, biases and latency there is, from 0 to 1.
    """

    rewards: dict[str, Any]
    noise: np.float32


class LocoEnvironment:
    """Robots that learn to follow velocity commands.

    Args:
        seed: of commands, starts, noise, randomisation; defaults to the configuration's.

    Attributes:
        state: of all robots; ``step`` replaces it.
    """

    def __init__(self, config: LocoConfig, seed: int | None = None) -> None:
        self.config = config
        self.num_envs = config.num_envs
        terrain = self.terrain = build_terrain(config.terrain)
        self.simulation = Simulation(terrain.ground, config.kp, config.kd, terrain.blocks, terrain.tall)
        self.episode_steps = count_steps(config)
        device = jax.devices()[0]
        self._starts = jax.device_put(jnp.asarray(terrain.starts, jnp.float32), device)
        frame = self.simulation.frame
        cover = tile_cover(terrain) if len(terrain.blocks) else np.zeros(terrain.starts.shape[:2])
        self._cover = jax.device_put(jnp.asarray(cover, jnp.float32), device)
        self._edge = np.array([-frame.x0, -frame.y0]) - _EDGE
        self._noise = STEPPING_MAP_TABLE.noise * _noise_of_rows(config.randomisation)
        self.set_rewards(config.rewards)
        self.set_noise(1.0)
        self._look = jax.jit(self._observe)
        key = jax.random.PRNGKey(config.seed if seed is None else seed)
        self.state: EnvState = jax.device_put(jax.jit(self._first_state)(key), device)
        self._lost: Lost = jax.device_put(Lost.none(), device)
        observed = Observations(*range(len(Observations._fields)))  # type: ignore[arg-type]
        outputs = self.state, self._lost, StepResult(observed, *range(len(StepResult._fields) - 1))  # type: ignore[arg-type]
        self._step = KeptProgram(self._advance, donated=(1, 2), outputs=outputs, reads=self._constants)

    def set_rewards(self, rewards: RewardConfig) -> None:
        """Weights and widths from the next step on; a training may move them without compiling anew."""
        self._rewards = {name: np.float32(value) for name, value in asdict(rewards).items()}

    @property
    def noise(self) -> float:
        """The fraction of all noise that robots have now."""
        return float(self._noise_now)

    def set_noise(self, fraction: float) -> None:
        """How much of noise, biases and latency there is from the next step on, from 0 to 1."""
        self._noise_now = np.float32(fraction)

    # ---- what the learner calls -----------------------------------------------------------------------------------

    def observe(self) -> Observations:
        """The observations of the present state; copies that outlive the next step."""
        return self._look(self.simulation.ground, self.state, self._settings)

    def step(self, action: Float[Array, "n 12"], gait: GaitState | None = None) -> StepResult:
        """One control step; robots whose episode ends start anew at once. The old state is given up.

        Args:
            gait: that the robots follow, in place of the environment's own: a student keeps one by what it believes,
                and plans for it. None: the environment's, which in stage 3 plans nothing.
        """
        if gait is not None:
            # copies: the step reuses the memory of the state that it is given
            own = GaitState(*(jax.device_put(jnp.array(x, jnp.float32), jax.devices()[0]) for x in gait))
            self.state = self.state._replace(gait=own)
        self.state, self._lost, result = self._step(
            self.simulation.ground, self.state, self._lost, action, self._settings
        )
        return result

    def read_measures(self) -> dict[str, float]:
        """The sums since the last call, as means over robot steps, and set to zero. The only wait for the device."""
        sums = np.asarray(self.state.sums, dtype=np.float64)
        self.state = self.state._replace(sums=jax.device_put(jnp.zeros_like(self.state.sums), jax.devices()[0]))
        return average_sums(sums)

    def take_lost(self) -> list[dict[str, Any]]:
        """The states before the steps that went wrong since the last call, of at most ``KEPT`` robots: the fields of
        ``Lost`` by name, with the reason in words. Waits for the device: call it when ``not_finite`` says so."""
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

    @property
    def _settings(self) -> Settings:
        return Settings(self._rewards, self._noise_now)

    def _constants(self) -> tuple[Any, ...]:
        """All that a step is traced with, beside its arguments."""
        return self.config, self._starts, self._cover, self.simulation.save_model()

    def _first_state(self, key: Array) -> EnvState:
        return first_state(self.config, self._starts, key)

    def _observe(self, ground: DeviceGround, state: EnvState, settings: Settings) -> Observations:
        """The noise is the state's own, so that a state that is loaded observes the same."""
        body, traits, c = state.body, state.traits, self.config.randomisation
        heights = scan_ground(jnp, ground.heights, self.simulation.frame, body.qpos)
        plain = observe(jnp, body.qpos, body.qvel, state.command, state.action, heights)
        rows = observe_gait(jnp, self.config.gait, state.gait, feet_in_heading_frame(jnp, body.qpos))
        exact = insert_gait(jnp, plain, rows)
        noise = 2 * jax.random.uniform(jax.random.fold_in(state.key, 1), exact.shape) - 1
        errors = {
            "base_linear_velocity": state.velocity_error,
            "base_angular_velocity": traits.angular_velocity_bias,
            "projected_gravity": traits.gravity_bias,
        }
        bias = jnp.zeros_like(exact)
        for name, error in errors.items():
            place = STEPPING_MAP_TABLE.place(name)
            bias = bias.at[:, place].set(error * STEPPING_MAP_TABLE.scale[place])
        privileged = jnp.concatenate(
            [
                state.touching.astype(jnp.float32),
                settings.noise * state.velocity_error / max(c.velocity_bias, 1e-6),
                jnp.stack(
                    [
                        traits.friction - 1,
                        traits.added_mass / 5,
                        5 * (traits.kp - 1),
                        5 * (traits.kd - 1),
                        traits.joint_friction - 1,
                        settings.noise * traits.latency / MAX_LATENCY,
                        jnp.where(ground.solid, 1.0, 0.0) + 0 * traits.kp,
                        settings.noise + 0 * traits.kp,
                    ],
                    1,
                ),
            ],
            1,
        )
        noisy = exact + settings.noise * (jnp.asarray(self._noise) * noise + bias)
        floor = jnp.zeros((self.num_envs, 0))
        if self.config.stage == 3:
            floor = local_heights(ground, self.simulation.frame, body)
        velocity = exact[:, _VELOCITY] / STEPPING_MAP_TABLE.scale[_VELOCITY]
        return Observations(noisy, exact, privileged, floor, velocity, body.qpos[:, :7] + 0.0)

    def _advance(
        self, ground: DeviceGround, old: EnvState, lost: Lost, given: Float[Array, "n 12"], settings: Settings
    ) -> tuple[EnvState, Lost, StepResult]:
        c, n, rewards = self.config, self.num_envs, settings.rewards
        key, of_episode, of_command, of_level, of_push, of_error = jax.random.split(old.key, 6)
        action = jnp.clip(jnp.nan_to_num(given), -CLIP, CLIP)
        target = jnp.asarray(DEFAULT_POSE, jnp.float32) + ACTION_SCALE * action
        targets = jnp.concatenate([target[:, None], old.targets[:, :-1]], 1)
        delay = delay_steps(settings.noise * old.traits.latency)
        body, contacts, torque = self.simulation.step(ground, old.body, targets, delay, old.traits)

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

        gait, steps = go_on(
            c.gait, ground, self.simulation.frame, old.gait, old.body, body, old.command, planned=c.stage < 3
        )
        motion = self._motion(ground, old, body, contacts, torque, action, broken, steps)
        terms = reward_terms(motion, rewards["sigma"])
        weighted = {name: terms[name] * (rewards[name] * CONTROL_DT) for name in TERMS}
        wrong["reward"] = ~jnp.isfinite(jnp.sum(jnp.stack(list(weighted.values())), 0))
        broken, motion = broken | wrong["reward"], motion._replace(fallen=motion.fallen | wrong["reward"])
        weighted = {name: jnp.where(wrong["reward"], 0.0, value) for name, value in weighted.items()}
        weighted["fall"] = motion.fallen * rewards["fall"]
        lost = keep_lost(lost, jnp.stack([wrong[name] for name in REASONS]), old, given, targets, delay)
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
            jax.random.uniform(of_level, (n,)),
            hits,
        )
        moved = jnp.linalg.norm(body.qpos[:, :2] - old.body.qpos[:, :2], axis=1)
        over = self.simulation.block_distance(ground, body.qpos[:, :2]) < 0
        cover = self._cover[old.level, old.column]
        sums = sum_measures(motion, old.level, reward, weighted, clipped, moved, timeout, life, broken, over, cover)

        # pushes, errors of what is measured, new starts, new commands
        push = old.push_left <= 0
        shove = uniform(of_push, (n, 2), (-c.randomisation.push_speed, c.randomisation.push_speed))
        body = body._replace(qvel=jnp.where(push[:, None], body.qvel.at[:, :2].set(shove), body.qvel))
        kept = math.exp(-CONTROL_DT / c.randomisation.velocity_bias_time)
        fresh_error = c.randomisation.velocity_bias * jax.random.normal(of_error, (n, 3))
        level = jnp.where(done, level, old.level)
        start = begin_episode(c, self._starts, level, old.column, of_episode)
        command, left = draw_commands(c.commands, of_command, n)
        renew = done | (old.command_left <= 0)

        def ended(beginning: Any, going: Any) -> Any:
            """What begins where an episode has ended, what goes on elsewhere."""
            return jax.tree.map(
                lambda a, b: jnp.where(done.reshape((n,) + (1,) * (b.ndim - 1)), a, b), beginning, going
            )

        state = EnvState(
            key=key,
            body=ended(start.body, body),
            action=ended(jnp.zeros_like(action), action),
            targets=ended(start.targets, targets),
            gait=ended(start.gait, gait),
            command=jnp.where(renew[:, None], command, old.command),
            command_left=jnp.where(renew, left, old.command_left - 1),
            push_left=jnp.where(push, round(c.randomisation.push_interval / CONTROL_DT), old.push_left - 1),
            step=jnp.where(done, 0, step),
            life=jnp.where(done, 0, life),
            touched=ended(jnp.zeros((n, 4), bool), contacts.foot),
            flying=ended(jnp.zeros((n, 4), bool), ~(contacts.foot | old.touched)),
            touching=ended(
                jnp.zeros((n, 16), bool),
                jnp.concatenate([contacts.foot, contacts.shank, contacts.foot_block, contacts.shank_block], 1),
            ),
            velocity_error=ended(
                start.velocity_error, kept * old.velocity_error + math.sqrt(1 - kept**2) * fresh_error
            ),
            way=jnp.where(done, 0.0, way),
            commanded=jnp.where(done, 0.0, commanded),
            hits=jnp.where(done, 0.0, hits),
            level=level,
            column=old.column,
            traits=ended(start.traits, old.traits),
            sums=old.sums + sums,
        )
        state = strip_weak_types(state)
        seen = self._observe(ground, state, settings)
        blind = ~jnp.isfinite(jnp.concatenate([seen.exact, seen.privileged, seen.heights], 1).sum(1))
        shown = Observations(*(jnp.where(blind[:, None], 0.0, x) for x in seen))._replace(pose=seen.pose)
        state = state._replace(life=jnp.where(blind, -1, state.life))  # the next step sets the robot back
        return state, lost, StepResult(shown, reward, done.astype(jnp.uint8), timeout.astype(jnp.uint8))

    def _motion(
        self,
        ground: DeviceGround,
        old: EnvState,
        body: Body,
        contacts: Contacts,
        torque: Array,
        action: Array,
        broken: Array,
        steps: Steps,
    ) -> Motion:
        """What the rewards look at; a foot counts as on the ground now or a step ago [legged_gym]."""
        quaternion = body.qpos[:, 3:7]
        down = jnp.broadcast_to(jnp.array([0.0, 0.0, -1.0]), (self.num_envs, 3))
        gravity = rotate_inverse(jnp, quaternion, down)
        return Motion(
            linear=rotate_inverse(jnp, quaternion, body.qvel[:, :3]),
            angular=body.qvel[:, 3:6],
            gravity=gravity,
            joint_speed=body.qvel[:, 6:],
            last_joint_speed=old.body.qvel[:, 6:],
            torque=torque,
            action=action,
            last_action=old.action,
            command=old.command,
            contacts=contacts,
            landed=old.flying & (contacts.foot | old.touched),
            steps=steps,
            fallen=contacts.trunk_down | (gravity[:, 2] > _UPSIDE) | broken,
        )


def _noise_of_rows(config: RandomisationConfig) -> Float[np.ndarray, " numbers"]:
    """Multiplier of the table's noise for every number: what is measured, and what is read from the map."""
    of_map = {HEIGHT_SCAN.name, *(term.name for term in GAIT_ROWS)}
    return np.concatenate(
        [
            np.full(term.size, config.map_noise if term.name in of_map else config.observation_noise, np.float32)
            for term in STEPPING_MAP_TABLE
        ]
    )
