"""Everything that a locomotion training can be told, as frozen records; the values live in ``configs/loco/*.yaml``."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Literal

import numpy as np

from vinl.config.errors import InputError
from vinl.config.limits import Range, check_fields, check_limits
from vinl.gait.config import GaitConfig
from vinl.loco.student_config import StudentConfig
from vinl.robot.aliengo import KD, KP
from vinl.robot.commands import CommandConfig
from vinl.world.terrain import TerrainConfig

MAX_LATENCY = 0.04
"""Longest time from an observation to its action's effect that is simulated [s]: two control steps."""


@dataclass(frozen=True)
class RewardConfig:
    """Weights of the reward terms, for each second (they are multiplied by the control step) [ViNL code, section 2].

    Attributes:
        linear_velocity: exp(-error^2 / sigma) of the commanded velocity in the plane.
        yaw_rate: exp(-error^2 / sigma) of the commanded turning rate.
        vertical_velocity: vertical speed squared.
        roll_pitch_rate: squared rates of roll and pitch.
        orientation: squared tilt of the trunk.
        hip_height: 1 - exp(-error^2 / (2 cm)^2) of each hip's height over its foot that stands, against the gait's:
            footholds are chosen for legs that hang from there.
        torque: squared joint torques.
        joint_acceleration: squared joint accelerations.
        joint_speed: squares of what joint speeds exceed 0.9 of the data sheet's by [(rad/s)^2].
        action_rate: squared change of the action.
        foot_tracking: mean over the legs: of a foot that swings, how near it is to its path, where height counts only
            if it is missing; of one that should stand, whether it touches.
        clearance: height that swinging feet lack on their paths, summed over the legs [m].
        swing_contact: feet that touch anything in the middle of their swing.
        slip: squared speed of feet that should stand, up to 1 (m/s)^2 each.
        collision: shanks and trunk that touch anything.
        obstacle_contact: feet that touch a block or wall.
        leg_contact: shanks that touch a block or wall (``collision`` counts them once more).
        near_block: legs within 3 cm of a block or wall below the knee: 1 each at a touch, less farther away.
        leg_crossing: legs that touch each other.
        fall: one fall (not multiplied by the control step).
        sigma: width of the tracking terms [(m/s)^2].
        floor: the sum of a step's terms is held to at least this for each second [legged_gym: 0].
    """

    linear_velocity: float = 1.5
    yaw_rate: float = 0.75
    vertical_velocity: float = -0.5
    roll_pitch_rate: float = -0.05
    orientation: float = -0.5
    hip_height: float = 0.0
    torque: float = -1e-5
    joint_acceleration: float = -2.5e-7
    joint_speed: float = 0.0
    action_rate: float = -0.01
    foot_tracking: float = 3.0
    clearance: float = 0.0
    swing_contact: float = -0.5
    slip: float = -0.2
    collision: float = -1.0
    obstacle_contact: float = 0.0
    leg_contact: float = 0.0
    near_block: float = 0.0
    leg_crossing: float = 0.0
    fall: float = 0.0
    sigma: float = 0.25
    floor: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self, "rewards.", positive=("sigma",))
        if self.floor > 0:
            raise InputError(f"rewards.floor must not be positive, got {self.floor}")


@dataclass(frozen=True)
class RandomisationConfig:
    """What differs from robot to robot, from start to start, and between what happens and what is measured.

    What a robot is like is drawn anew for every episode.

    Attributes:
        friction: range of the feet's friction [ViNL config: 0.5-1.25].
        added_mass: range of the mass added to the trunk [kg] [ViNL config: +-5, on a robot 4.3 kg lighter].
        kp_scale, kd_scale: ranges of the factors of the joint gains.
        joint_friction: range of the factor of the joints' dry friction and damping.
        latency: range of the time from an observation to its action's effect [s], up to 0.04; in steps of the physics.
        push_speed: pushes set the trunk's velocity in the plane to a random one up to this [m/s].
        push_interval: time between pushes [s] [ViNL config: 15].
        start_xy: half-width of the square that robots start in [m].
        start_joints: joint angles start within this fraction of the default pose.
        start_height: height of the trunk over the highest ground near the start [m].
        start_velocity: largest velocity of the trunk at the start [m/s and rad/s] [ViNL code: 0.5].
        observation_noise: multiplier of the noise that the observation table gives proprioception.
        map_noise: the same for what is read from the map: height scan and foothold plan.
        velocity_bias: standard deviation of the error of the observed base velocity that changes slowly [m/s].
        velocity_bias_time: in which it changes [s].
        angular_velocity_bias: largest constant error of each observed angular velocity [rad/s].
        gravity_bias: largest constant error of each component of the observed direction of gravity.
        noise_from: fractions of the training from which noise, biases and latency grow from nothing, and at which they
            are all there: exact first.
    """

    friction: Range = (0.5, 1.25)
    added_mass: Range = (-5.0, 3.0)
    kp_scale: Range = (1.0, 1.0)
    kd_scale: Range = (1.0, 1.0)
    joint_friction: Range = (1.0, 1.0)
    latency: Range = (0.0, 0.0)
    push_speed: float = 1.0
    push_interval: float = 15.0
    start_xy: float = 0.6
    start_joints: float = 0.15
    start_height: float = 0.42
    start_velocity: float = 0.5
    observation_noise: float = 1.0
    map_noise: float = 1.0
    velocity_bias: float = 0.0
    velocity_bias_time: float = 1.0
    angular_velocity_bias: float = 0.0
    gravity_bias: float = 0.0
    noise_from: Range = (0.0, 0.0)

    def __post_init__(self) -> None:
        scales, noises = ("friction", "kp_scale", "kd_scale"), ("observation_noise", "map_noise", "gravity_bias")
        check_fields(
            self,
            "randomisation.",
            rising=(*scales, "added_mass", "joint_friction", "noise_from"),
            positive=(*scales, "push_interval", "velocity_bias_time"),
            unsigned=("joint_friction", "velocity_bias", "angular_velocity_bias", *noises),
            fractions=("noise_from",),
        )
        check_limits(self, "randomisation.", latency=(0.0, MAX_LATENCY))

    def noise_at(self, fraction: float) -> float:
        """How much of noise, biases and latency there is after a fraction of the training, from 0 to 1."""
        begin, end = self.noise_from
        if fraction >= end:
            return 1.0
        return max(fraction - begin, 0.0) / (end - begin)


@dataclass(frozen=True)
class CurriculumConfig:
    """When a robot moves to a harder or an easier tile.

    The measure is progress along the command, because a command that turns the robot in circles never takes it far.

    Attributes:
        first_level: robots start on a random level up to this [legged_gym: 5].
        promote: fraction of the commanded way that promotes.
        demote: fraction of the commanded way that demotes when not reached.
        min_way: episodes with less commanded way than this [m] change nothing.
        max_contacts: promote only robots with at most this many control steps of a foot or shank on blocks for each
            metre of progress [1/m]; None: contacts do not matter.
    """

    first_level: int = 5
    promote: float = 0.75
    demote: float = 0.5
    min_way: float = 2.0
    max_contacts: float | None = None

    def __post_init__(self) -> None:
        check_fields(self, "curriculum.", unsigned=("first_level", "max_contacts"))
        if not 0 <= self.demote <= self.promote:
            raise InputError("curriculum: need 0 <= demote <= promote")


@dataclass(frozen=True)
class LocoPpoConfig:
    """Proximal policy optimisation [legged_gym].

    Attributes:
        steps: control steps of each robot between updates.
        epochs, minibatches: passes over the roll-out and parts of each.
        learning_rate: at the start; adapts to the divergence.
        desired_kl: divergence that the learning rate is steered to.
        cool_from: from this fraction of the iterations on the learning rate is limited; 1: never. What ships acts
            without chance, as its last update left it: one that still takes long steps leaves it anywhere about its
            optimum.
        cool_rates: the limit at ``cool_from`` and at the end; it falls linearly.
        gamma, lam: discount and GAE factor.
        clip: of the probability ratio and of the value.
        entropy: weight of the entropy bonus.
        value: weight of the value loss.
        max_grad_norm: gradients are clipped to this norm.
        init_std: standard deviation of the actions at the start, also after ``from_policy``.
        critic_warmup: in so many first updates only the critic learns: one that starts afresh beside a trained actor
            would otherwise teach it nonsense.
        actor, critic: widths of the hidden layers; the critic sees the height scan too.
        update: fast (rsl-rl's numbers with fewer waits for the device; see ``vinl.loco.fast_ppo``) or graphs (fast, its
            minibatches as CUDA graphs).
    """

    steps: int = 24
    epochs: int = 5
    minibatches: int = 4
    learning_rate: float = 1e-3
    desired_kl: float = 0.01
    cool_from: float = 1.0
    cool_rates: tuple[float, float] = (3e-4, 1e-5)
    gamma: float = 0.99
    lam: float = 0.95
    clip: float = 0.2
    entropy: float = 0.01
    value: float = 1.0
    max_grad_norm: float = 1.0
    init_std: float = 1.0
    critic_warmup: int = 0
    actor: tuple[int, ...] = (512, 256, 128)
    critic: tuple[int, ...] = (512, 256, 128)
    update: Literal["fast", "graphs"] = "graphs"

    def __post_init__(self) -> None:
        rates = ("learning_rate", "desired_kl", "cool_rates", "init_std", "gamma")
        counts, fractions = ("steps", "epochs", "minibatches"), ("cool_from", "gamma", "lam")
        check_fields(self, "ppo.", counts=counts, unsigned=("critic_warmup",), positive=rates, fractions=fractions)

    def highest_rate(self, fraction: float) -> float | None:
        """The limit of the learning rate after a fraction of the iterations; None: there is none."""
        if fraction < self.cool_from or self.cool_from >= 1:
            return None
        return float(np.interp(fraction, (self.cool_from, 1.0), self.cool_rates))


@dataclass(frozen=True)
class AnnealConfig:
    """Settings that move towards others late in the training: first learn to walk at all, then to walk precisely.

    Attributes:
        begin, end: fractions of the iterations between which the settings move, linearly.
        rewards: names and last values of settings of ``RewardConfig`` that move.
        entropy: last value of ``ppo.entropy``; None: it stays.
    """

    begin: float = 0.6
    end: float = 0.9
    rewards: dict[str, float] = field(default_factory=dict)
    entropy: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.begin < self.end <= 1:
            raise InputError(f"anneal: need 0 <= begin < end <= 1, got {self.begin} and {self.end}")
        check_fields(self, "anneal.", unsigned=("entropy",))
        try:
            RewardConfig(**self.rewards)
        except TypeError:
            known = {f.name for f in fields(RewardConfig)}
            raise InputError(f"anneal.rewards: unknown term {', '.join(sorted(set(self.rewards) - known))}") from None

    def blend(self, fraction: float, before: float, after: float) -> float:
        """The value of a setting after a fraction of the iterations."""
        moved = min(max((fraction - self.begin) / (self.end - self.begin), 0.0), 1.0)
        return before + moved * (after - before)

    def rewards_at(self, fraction: float, first: RewardConfig) -> RewardConfig:
        """The reward settings after a fraction of the iterations, starting from ``first``."""
        moved = {name: self.blend(fraction, getattr(first, name), last) for name, last in self.rewards.items()}
        return replace(first, **moved)


@dataclass(frozen=True)
class LocoConfig:
    """One locomotion training.

    Attributes:
        stage: 1 (rough ground), 2 (blocks) or 3 (blocks, seen through a camera).
        from_policy: the policy or run whose networks the training starts from; None: fresh ones.
        num_envs: robots in parallel, on all devices together.
        iterations: updates.
        seed: of everything random.
        episode_length: [s] [ViNL config: 20].
        kp, kd: joint gains [N m / rad, N m s / rad].
        gait: clock, footholds and swing paths that robots are told, and rewarded for.
        ppo, anneal: not used by stage 3.
        student: stage 3 alone.
    """

    stage: int = 1
    from_policy: str | None = None
    num_envs: int = 4096
    iterations: int = 1000
    seed: int = 1
    episode_length: float = 20.0
    kp: float = KP
    kd: float = KD
    gait: GaitConfig = field(default_factory=GaitConfig)
    terrain: TerrainConfig = field(default_factory=TerrainConfig)
    commands: CommandConfig = field(default_factory=CommandConfig)
    rewards: RewardConfig = field(default_factory=RewardConfig)
    randomisation: RandomisationConfig = field(default_factory=RandomisationConfig)
    curriculum: CurriculumConfig = field(default_factory=CurriculumConfig)
    ppo: LocoPpoConfig = field(default_factory=LocoPpoConfig)
    anneal: AnnealConfig = field(default_factory=AnnealConfig)
    student: StudentConfig | None = None

    def __post_init__(self) -> None:
        if self.stage not in (1, 2, 3):
            raise InputError(f"stage {self.stage} does not exist; choose 1, 2 or 3")
        if (self.stage == 3) != (self.student is not None):
            raise InputError(f"stage {self.stage}: the group student belongs to stage 3, and to no other")
        check_limits(self, num_envs=(1, 65536))
        check_fields(self, counts=("iterations",), positive=("episode_length", "kp"), unsigned=("kd",))

    def separate(self, rank: int, count: int) -> LocoConfig:
        """What one of several devices simulates: its part of the robots, with random numbers of its own.

        Raises:
            InputError: this cannot be trained on so many devices.
        """
        if count == 1:
            return self
        if self.stage == 3:
            raise InputError(f"--devices {count}: stage 3 is trained on one device; leave --devices out")
        if self.num_envs % count:
            raise InputError(f"--devices {count}: num_envs must be a multiple of it, got {self.num_envs}")
        return replace(self, num_envs=self.num_envs // count, seed=self.seed + rank)
