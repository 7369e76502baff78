"""The chain as an environment: ``gymnasium.make("vinl/Home-v0")``. A robot walks through homes in MuJoCo C."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Float, UInt8

from vinl.chain.choose import choose_locomotor
from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes, draw_setup
from vinl.chain.navigators.learned import measure_twist, step_between
from vinl.chain.records import plain_record
from vinl.chain.workers import one_thread
from vinl.config.errors import InputError
from vinl.config.loader import closest, load_config
from vinl.gym.observations import AgentObservation, Cameras, choose_cameras
from vinl.gym.trip import ChaseView, Guide, Legs, Trip
from vinl.nav.config import NavConfig
from vinl.policies.card import navigation_table
from vinl.policies.policy import Policy
from vinl.robot.aliengo import ACTION_SCALE, CONTROL_DT, DEFAULT_POSE
from vinl.world.clutter import choose_clutter
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.readers import open_floorplans
from vinl.world.start_goal import sample_start_goals

JOINT_REACH = 4.0
"""Joint target = default pose + this x action [rad]. Holds what the shipped locomotors ask for: up to 3.4 rad, far
beyond where the joints get, for a target is the way to ask for a torque."""


def joint_target_of(action: Float[np.ndarray, "12"], reach: float) -> Float[np.ndarray, "12"]:
    """Joint targets [rad]: the default pose, and ``reach`` [rad] for an action of 1."""
    return DEFAULT_POSE + reach * action.astype(np.float64)


def check_action(action: np.ndarray, size: int) -> Float[np.ndarray, " n"]:
    """An action of so many numbers, held to [-1, 1].

    Raises:
        InputError: another shape, or numbers that are not finite.
    """
    found = np.asarray(action, dtype=np.float32)
    if found.shape != (size,):
        raise InputError(f"an action of this environment has shape ({size},), got {found.shape}")
    if not np.isfinite(found).all():
        raise InputError("an action must be finite, got NaN or infinite")
    return found.clip(-1.0, 1.0)


Plans = str | Path | FloorPlan | Sequence[str | Path | FloorPlan]
CONTROLS = ("velocity", "joints")


class HomeEnv(gymnasium.Env):
    """One robot in homes with clutter. The agent is its navigator, or its legs.

    ``control="velocity"``: an action (2,) in [-1, 1] is a forward speed and a yaw rate within the limits of ``config``
    (0 to 0.8 m/s, +-60 deg/s) that a locomotor carries out for 0.5 s. Observed are ``vector``, distance / 5 m, cosine
    and sine of the goal's bearing and the last step (by ``previous`` in the config the action, how the robot moved in
    units of the action, or both), and ``depth`` of the navigation camera: what ``vinl/Nav-v0`` has.

    ``control="joints"``: an action (12,) in [-1, 1] x ``joint_reach`` rad is where the joints shall be relative to the
    default pose, for 0.02 s. Observed are ``goal`` (3,), as above, ``proprioception`` (48,), what a robot
    knows of itself, and ``depth`` of the locomotion camera. With a ``navigator`` the command in the table is
    what that chooses, without one it is zero.

    The reward is the navigator's [facts/navigation 1.1, column A]: metres that the goal came nearer on foot, a bonus at
    the goal, a little less for every 0.5 s and for every 0.5 s in which a wall was touched; with joints the last two
    are spread over the control steps. An episode is terminated at the goal or by a fall, truncated when time is over.

    Each ``info`` has ``plan``, ``time_s``, ``straight_m`` and ``geodesic_m`` to the goal, ``foot_steps``
    (control steps with a foot on a block or a wall), ``success`` and ``end_reason`` (empty while under way); at the end
    also ``spl``, ``foot_collisions_per_m`` and ``record``, the episode as it would stand in ``results.json``.

    Args:
        render_mode: ``"rgb_array"``, the robot from behind, or None.
        floorplans: names, files or plans to walk in; the shipped ones by default. To train, rather take plans of your
            own or of ``vinl.generate_home``, and leave the shipped ones for the test.
        obstacles: clutter preset.
        control: what the agent chooses, ``"velocity"`` or ``"joints"``.
        locomotor: name, folder or policy that carries out velocities; the best shipped one by default.
        navigator: name, folder or navigator that guides an agent of joints; none by default.
        cameras: name of the image -> ``"navigation"``, ``"locomotion"`` or a camera record; see above for the default.
        height_scan: also observe ``height_scan`` (187,), the ground around the robot: privileged.
        joint_reach: see above [rad].
        config: the navigator's config, name or file: camera, reward, speeds and ``previous`` are taken.
        overrides: settings of that config as ``key=value``.
        rules: limits of an episode.

    Attributes:
        trip: the episode under way.
        velocity_range: what actions of a navigator mean.

    Raises:
        InputError: a name is unknown, or options do not go together.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2}  # noqa: RUF012 - gymnasium's own

    def __init__(
        self,
        render_mode: str | None = None,
        floorplans: Plans = (),
        obstacles: str = "paper",
        control: str = "velocity",
        locomotor: str | Path | Policy | None = None,
        navigator: Any = None,
        cameras: Cameras | None = None,
        height_scan: bool = False,
        joint_reach: float = JOINT_REACH,
        config: str = "nav/default",
        overrides: Sequence[str] = (),
        rules: str | EvaluationConfig = "eval/default",
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise InputError(f"render_mode is 'rgb_array' or None, not {render_mode!r}")
        if control not in CONTROLS:
            raise InputError(f"control is {' or '.join(CONTROLS)}, not {control!r}")
        if not 0 < joint_reach <= 10:
            raise InputError(f"joint_reach must lie in (0, 10] rad, got {joint_reach}")
        self.render_mode, self._joints, self._reach = render_mode, control == "joints", joint_reach
        self._rules = rules if isinstance(rules, EvaluationConfig) else load_config(EvaluationConfig, rules)
        navigation = load_config(NavConfig, config, overrides)
        self._reward, self._clutter = navigation.reward, choose_clutter(obstacles, "obstacles")
        self._knows, self.velocity_range = navigation.previous, navigation.robot.velocity_range
        self._spaces = [FreeSpace(plan) for plan in _load_plans(floorplans)]
        self._legs = self._guide = None
        if self._joints:
            if locomotor is not None:
                raise InputError('control="joints": the agent is the locomotor; give none')
            self._guide = None if navigator is None else Guide(navigator, self._rules)
        else:
            if navigator is not None:
                raise InputError('control="velocity": the agent is the navigator; give none')
            self._legs = Legs(choose_locomotor(locomotor))
        camera = None if navigation.camera is None else navigation.camera.record()
        chosen = choose_cameras(cameras, self._joints, camera)
        self._steps = 12 if self._joints else sum(row["size"] for row in navigation_table(self._knows)[2:])
        self._observation = AgentObservation(self._joints, chosen, height_scan, self._steps)
        self.observation_space = self._observation.space
        self.action_space = spaces.Box(-1.0, 1.0, (12 if self._joints else 2,), np.float32)
        rate = 1 / CONTROL_DT / (1 if self._joints else self._rules.navigation_period)
        self.metadata = {**self.metadata, "render_fps": round(rate)}
        self._view: ChaseView | None = None
        self.trip: Trip | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Begin an episode; the same seed gives the same one.

        Args:
            seed: of this and the following episodes.
            options: ``plan``, ``episode``, ``seed``: the episode that ``vinl.evaluate`` runs under these numbers, in
                the plan of that name (by default the first, 0 and 0). Without options all is drawn.
        """
        super().reset(seed=seed, options=options)
        space, route, episode, repetition = self._choose(options or {})
        setup = draw_setup(space.plan, route, episode, repetition, self._clutter, self._rules)
        gains = self._legs.gains if self._legs else ()
        self.trip = trip = Trip(space, setup, self._rules, *gains)
        self._command, self._view = np.zeros((1, 3)), None
        self._previous = np.zeros((1, self._steps), np.float32)
        self._observation.enter(trip, self._rules.ceiling)
        for driver in (self._legs, self._guide):
            if driver is not None:
                driver.enter(trip, self._rules.ceiling)
        with one_thread():
            self._decide()
            return self._observation.observe(trip, self._command, self._previous), self._info(trip)

    def step(self, action: np.ndarray) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """One decision of the agent.

        Args:
            action: (2,) or (12,) in [-1, 1]; what is beyond is held to that.

        Raises:
            InputError: an action of another shape or with NaN, or no episode is under way.
        """
        trip = self._under_way()
        chosen = check_action(action, 12 if self._joints else 2)
        with one_thread():
            touched = self._move_joints(trip, chosen) if self._joints else self._walk(trip, chosen)
            if not trip.end:
                self._decide()
            observation = self._observation.observe(trip, self._command, self._previous)
        r, fraction = self._reward, 1.0 / self._rules.navigation_period if self._joints else 1.0
        reward = r.progress * trip.measure_way() + fraction * (r.slack + r.collision * touched)
        reward += r.success * (trip.end == "success")
        over = trip.end in ("success", "fall")
        return observation, r.scale * reward, over, bool(trip.end) and not over, self._info(trip)

    def render(self) -> UInt8[np.ndarray, "height width 3"] | None:  # type: ignore[override]
        """The robot in its home from behind, (480, 640, 3)."""
        if self.render_mode is None or self.trip is None:
            return None
        if self._view is None:
            self._view = ChaseView(self.trip, 1.0 / self.metadata["render_fps"])
        return self._view.draw(self.trip)

    def _choose(self, options: dict[str, Any]) -> tuple[FreeSpace, Any, int, int]:
        """Free floor, route, number of the episode and seed."""
        named = {space.plan.name: space for space in self._spaces}
        for key in options.keys() - {"plan", "episode", "seed"}:
            raise InputError(f"reset has no option {key!r}; known: plan, episode, seed")
        if options:
            plan, episode, seed = (options.get(key, 0) for key in ("plan", "episode", "seed"))
            if plan and plan not in named:
                raise InputError(f"no floor plan {plan!r}{closest(str(plan), named)}; known: {', '.join(named)}")
            if episode < 0 or seed < 0:
                raise InputError("episode and seed must not be negative")
            space = named[plan] if plan else self._spaces[0]
            return space, draw_routes(space.plan, episode + 1, self._rules)[episode], episode, seed
        space = self._spaces[int(self.np_random.integers(len(self._spaces)))]
        rules = self._rules
        route = sample_start_goals(space.plan, 1, self.np_random, rules.min_distance, rules.clearance)[0]
        return space, route, 0, int(self.np_random.integers(2**31))

    def _decide(self) -> None:
        """Ask the navigator that guides an agent of joints, when it is time."""
        assert self.trip is not None
        if self._guide is not None and self.trip.steps % self._rules.navigation_period == 0:
            self._command[0, ::2] = self._guide.choose(self.trip)

    def _walk(self, trip: Trip, action: np.ndarray) -> bool:
        """Have the locomotor carry out a velocity. True if a wall was touched."""
        assert self._legs is not None
        before, began, touched = trip.pose, trip.steps, False
        self._command[0, ::2] = self.velocity_range.velocity(action)
        for _ in range(self._rules.navigation_period):
            trip.advance(self._legs.choose(trip, self._command), self._command)
            touched = touched or trip.touched_wall
            if trip.end:
                break
        twist = measure_twist(before, trip.pose, (trip.steps - began) * CONTROL_DT)[:, [0, 2]]
        asked, motion = action[None], self.velocity_range.action(twist)
        came = step_between(before, trip.pose).astype(np.float32)
        known = {"action": [asked], "motion": [motion], "both": [asked, motion], "step": [asked, came]}
        self._previous = np.concatenate(known[self._knows], 1)
        return touched

    def _move_joints(self, trip: Trip, action: np.ndarray) -> bool:
        self._previous = (action[None] * np.float32(self._reach / ACTION_SCALE)).astype(np.float32)
        trip.advance(joint_target_of(action, self._reach), self._command)
        return trip.touched_wall

    def _info(self, trip: Trip) -> dict[str, Any]:
        info: dict[str, Any] = {
            "plan": trip.setup.plan,
            "time_s": trip.steps * CONTROL_DT,
            "straight_m": float(trip.goal[0, 0]),
            "geodesic_m": trip.geodesic_m,
            "foot_steps": trip.foot_steps,
            "success": trip.end == "success",
            "end_reason": trip.end,
        }
        if trip.end:
            record = trip.close().record
            info["spl"], info["record"] = record.spl, plain_record(record)
            info["foot_collisions_per_m"] = record.foot_steps / max(record.distance_m, self._rules.min_metres)
        return info

    def _under_way(self) -> Trip:
        if self.trip is None or self.trip.end:
            raise InputError("no episode is under way; call reset first")
        return self.trip


def _load_plans(floorplans: Plans) -> list[FloorPlan]:
    plans = open_floorplans(floorplans)
    names = [plan.name for plan in plans]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two floor plans are called {name!r}; give them names of their own")
    return plans
