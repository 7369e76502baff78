"""The chain on one robot, a control step at a time, with goal, command, clutter and policies changed in between."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from vinl.chain.choose import check_cameras, choose_locomotor, choose_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.controller import open_controller
from vinl.chain.depth_cameras import CameraErrors, DepthCameras, RealCameras, open_depth_cameras
from vinl.chain.navigators.base import Navigator, Task, decide
from vinl.chain.navigators.learned import DeadReckoning
from vinl.chain.robot import KINDS_OF, FaultyState, Robot, build_model
from vinl.chain.scene import FORCE_SENSORS
from vinl.config.errors import InputError
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, FOOT_GEOMS
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.robot.rotation import yaw_of
from vinl.viewer.session import (
    ChangePolicies,
    DepthImage,
    Drive,
    Footholds,
    OpenPlan,
    PlaceRobot,
    Push,
    Request,
    Reset,
    ScatterClutter,
    SetGoal,
    Snapshot,
    ToggleBlock,
)
from vinl.viewer.world import World, draw_block, open_home
from vinl.world.free_space import FreeSpace
from vinl.world.readers import load_floorplan
from vinl.world.start_goal import measure_route

CONTACT_MEMORY = 6.0
"""Contacts of so many last seconds are shown [s]."""

SNAP = 0.5
"""A goal off the free floor is moved to the nearest place where the robot fits, at most this far [m]."""

_PATH_EVERY = 5


def look_through(
    cameras: Mapping[str, DepthCameras | RealCameras], qpos: Float[np.ndarray, "1 19"]
) -> dict[str, DepthImage]:
    """What one robot's cameras see, by name."""
    return {name: DepthImage(one.camera, one.look(qpos)[0].numpy().copy()) for name, one in cameras.items()}


class LiveChain:
    """One robot in a world, driven by its policies, given as such or by name or folder. What is drawn (clutter, dropped
    blocks, errors) follows from the seed; ``config`` has how often the navigator decides, what is a fall, what a goal
    reached, errors of cameras and odometry, faults of the body."""

    dt = CONTROL_DT
    """Time of a step [s]."""

    def __init__(
        self,
        world: World,
        locomotion: str | Path | Policy | None,
        navigation: str | Path | Navigator,
        config: EvaluationConfig,
        seed: int = 0,
    ) -> None:
        self._config, self._rng = config, np.random.Generator(np.random.Philox(seed))
        self._seed = seed % 2**31
        self._errors = None if config.sensors.is_ideal else CameraErrors(config.sensors, [self._seed])
        self._locomotion = choose_locomotor(locomotion)
        self._navigator = choose_navigator(navigation, config)
        check_cameras(self._locomotion, self._navigator)
        self._enter(world)

    # ---- from outside ----------------------------------------------------------------------------------------------

    def apply(self, request: Request) -> str:
        """Do what is asked, and say what there is to say about it; empty for nothing. Raises ``InputError`` if it
        cannot be done; nothing has changed then."""
        match request:
            case Reset():
                self._put_down(self._home)
            case SetGoal(x, y):
                return self._go_to(np.array([x, y]))
            case Drive(forward, turn):
                self._goal, self._state = None, "driven" if forward or turn else "standing"
                self._command[:] = [[forward, 0.0, turn]]
            case Push(speed, angle):
                towards = angle + self._yaw
                self._walker.qvel[:2] += speed * np.array([np.cos(towards), np.sin(towards)])
            case PlaceRobot(x, y):
                self._place(np.array([x, y]))
            case ToggleBlock(x, y):
                xy, world = np.array([x, y]), self.world
                self._rebuild(world.without_block(xy) or world.with_block(draw_block(xy, self._rng), self._xy))
            case ScatterClutter(preset):
                self._rebuild(self.world.scattered(preset, self._rng, self._xy))
                return f"{len(self.world.blocks)} blocks"
            case ChangePolicies(locomotion, navigation):
                self._change_policies(locomotion, navigation)
            case OpenPlan(plan):
                self._enter(
                    open_home(load_floorplan(plan), "paper" if len(self.world.blocks) else "none", 0, self._config)
                )
            case _:
                raise InputError(f"{type(request).__name__} is for recordings")
        return ""

    def step(self) -> bool:
        """One control step; whether time should stop, because the robot has fallen."""
        if self._state == "fallen":
            return True
        qpos, qvel = self._walker.qpos[None].copy(), self._walker.qvel[None].copy()
        if self._errors is not None:
            self._errors.note(qpos)
        known = (qpos, qvel) if self._faulty is None else self._faulty.measure(qpos, qvel, [0])
        if self._goal is not None and self._since_goal % self._config.navigation_period == 0:
            self._decide(self._goal)
        self._since_goal += 1
        target = self._controller.step(*known, self._command)[0]
        self._footholds = self._read_footholds()
        self._walker.step(target)
        self._count()
        if self._walker.has_fallen(self._config.max_tilt):
            self._state, self._goal = "fallen", None
            return True
        if self._goal is not None and np.linalg.norm(self._xy - self._goal) < self._config.success_radius:
            self._state, self._goal = "reached", None
            self._command[:] = 0.0
        return False

    def snapshot(self, look: bool) -> Snapshot:
        """The present moment. ``look``: render depth images anew."""
        if look or not self._images:
            self._images = look_through(self._cameras, self._walker.qpos[None])
        data = self._walker.data
        return Snapshot(
            world=self.world,
            time_s=self._steps * CONTROL_DT,
            state=self._state,
            qpos=self._walker.qpos.copy(),
            velocity=self._velocity(),
            command=self._command[0].copy(),
            goal=None if self._goal is None else self._goal.copy(),
            path=np.array([*self._path, self._xy]),
            distance_m=self._distance,
            contacts=np.array(self._contacts, np.float64).reshape(-1, 5),
            contact_steps=(self._limb_steps[0], self._limb_steps[1], self._limb_steps[2]),
            feet=data.geom_xpos[self._feet].copy(),
            foot_forces=np.linalg.norm(data.sensordata[self._forces].reshape(4, 3), axis=1),
            images=self._images,
            footholds=self._footholds,
            occupied=self._occupied,
        )

    # ---- the robot -------------------------------------------------------------------------------------------------

    @property
    def _xy(self) -> Float[np.ndarray, "2"]:
        return self._walker.qpos[:2].copy()

    @property
    def _yaw(self) -> float:
        return float(yaw_of(np, self._walker.qpos[3:7]))

    def _velocity(self) -> Float[np.ndarray, "3"]:
        c, s = np.cos(self._yaw), np.sin(self._yaw)
        x, y = self._walker.qvel[:2]
        return np.array([c * x + s * y, -s * x + c * y, self._walker.qvel[5]])

    def _count(self) -> None:
        """Path and contacts of the step."""
        now = self._xy
        self._distance += float(np.linalg.norm(now - self._at))
        self._at = now
        self._steps += 1
        if self._steps % _PATH_EVERY == 0:
            self._path.append(now)
        time = self._steps * CONTROL_DT
        touches = list(self._walker.contacts.touches.values())
        self._contacts.extend((time, touch.kind, touch.x, touch.y, touch.z) for touch in touches)
        while self._contacts and self._contacts[0][0] < time - CONTACT_MEMORY:
            self._contacts.popleft()
        for k, kinds in enumerate(KINDS_OF.values()):
            self._limb_steps[k] += any(touch.kind in kinds for touch in touches)

    def _put_down(self, pose: Float[np.ndarray, "3"]) -> None:
        """Let the robot stand somewhere, all memory gone; a goal stays."""
        self._home = pose
        x, y, yaw = pose.tolist()
        self._walker.spawn(x, y, yaw, self.world.joints)
        self._controller.reset(1)
        faults, qpos = self._config.faults, self._walker.qpos[None]
        rngs = [np.random.Generator(np.random.Philox(self._seed))]
        self._faulty = FaultyState(faults, rngs) if faults.spoils_state else None
        if self._errors is not None:
            self._errors.restart(qpos)
        self._footholds = Footholds()
        self._steps, self._distance, self._at = 0, 0.0, self._xy
        self._path: list[np.ndarray] = [self._xy]
        self._contacts: deque[tuple[float, int, float, float, float]] = deque()
        self._limb_steps = [0, 0, 0]
        self._command, self._since_goal = np.zeros((1, 3)), 0
        self._state, self._images = "standing", dict[str, DepthImage]()
        self._occupied = np.zeros((0, 2))
        if self._goal is not None:
            self._go_to(self._goal)

    def _place(self, xy: Float[np.ndarray, "2"]) -> None:
        if len(self.world.blocks) and self.world.blocks.boxes().distances(xy[None]).min() < 0.25:
            raise InputError("the robot cannot be put down there: a block is in the way")
        self._goal = None
        self._put_down(np.array([*self._fit(xy), self._yaw]))

    # ---- the goal --------------------------------------------------------------------------------------------------

    def _fit(self, xy: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
        """The point itself if the robot fits there, or the nearest one where it does."""
        space = self._space
        row, column = space.plan.frame.cell(xy)
        if space.traversable[row, column] and np.abs(space.plan.frame.xy(np.array([row, column])) - xy).max() < 0.1:
            return xy
        cells = space.plan.frame.xy(np.argwhere(space.traversable))
        away = np.linalg.norm(cells - xy, axis=1)
        if away.min() > SNAP:
            raise InputError("the robot does not fit there")
        return cells[away.argmin()]

    def _go_to(self, wanted: Float[np.ndarray, "2"]) -> str:
        if self._state == "fallen":
            raise InputError("the robot has fallen; reset it first")
        goal, space = self._fit(wanted), self._space
        route = replace(measure_route(space, self._xy, goal), yaw=self._yaw)
        if not np.isfinite(route.geodesic_m):
            raise InputError("there is no path to that goal from here")
        self._navigator.reset([Task(space, route)])
        odometry = self._config.odometry
        self._reckoning = None if odometry.is_exact else DeadReckoning(odometry, [self._seed])
        self._goal, self._state, self._since_goal = goal, "walking", 0
        self._choice, self._occupied = np.zeros((1, 2)), np.zeros((0, 2))
        return f"goal: {route.geodesic_m:.1f} m to walk"

    def _decide(self, goal: Float[np.ndarray, "2"]) -> None:
        """Ask the navigator for the next command."""
        pose = np.array([[*self._xy, self._yaw]])
        believed = None if self._reckoning is None else self._reckoning.follow(pose)
        depth = None if self._navigator.camera is None else self._ahead.look(self._walker.qpos[None])
        self._choice = decide(self._navigator, goal[None], self._choice, pose, believed, depth)
        self._command[0] = [self._choice[0, 0], 0.0, self._choice[0, 1]]
        tell = getattr(self._navigator, "occupied", lambda: np.zeros((0, 2)))  # navigators may have such a method
        c, s = np.cos(self._yaw), np.sin(self._yaw)
        self._occupied = tell() @ np.array([[c, s], [-s, c]]) + self._xy

    # ---- the world -------------------------------------------------------------------------------------------------

    def _enter(self, world: World) -> None:
        """Put the robot into another home."""
        self._space = FreeSpace(world.plan)
        self._goal: np.ndarray | None = None
        self._build(world)
        self._put_down(world.start)

    def _build(self, world: World) -> None:
        """Physics, gait and cameras of a world."""
        faults, blocks, ceiling = self._config.faults, [world.blocks], self._config.ceiling
        model = build_model(world.plan.boxes, world.blocks.boxes(), self._locomotion.card, faults)
        self._walker = Robot(model, faults.delay_steps)
        self._controller = open_controller(self._locomotion, world.plan, blocks, ceiling, self._errors)
        # where a policy has no camera, the robot's own, to look through
        cameras = {
            "locomotion": self._locomotion.camera or LOCOMOTION_CAMERA,
            "navigation": self._navigator.camera or NAVIGATION_CAMERA,
        }
        ideal = {name: open_depth_cameras(world.plan, blocks, camera, ceiling) for name, camera in cameras.items()}
        # what the page shows and what the navigator sees have errors of their own: looking on changes no walk
        self._cameras: Mapping[str, DepthCameras | RealCameras] = ideal
        self._ahead: DepthCameras | RealCameras = ideal["navigation"]
        if self._errors is not None:
            self._cameras = {name: self._errors.put_on(cameras) for name, cameras in ideal.items()}
            self._ahead = self._errors.put_on(ideal["navigation"])
        self._feet = [int(model.geom(name).id) for name in FOOT_GEOMS]
        first = int(model.sensor(FORCE_SENSORS[0]).adr[0])
        self._forces = slice(first, first + 12)
        self.world = world

    def _rebuild(self, world: World) -> None:
        """The world changes under the walking robot: its motion goes on."""
        walker, controller = self._walker, self._controller
        self._build(world)
        self._controller.take_over(controller)
        self._walker.take_over(walker)
        self._images, self._footholds = {}, Footholds()

    # ---- the policies ----------------------------------------------------------------------------------------------

    def _change_policies(
        self, locomotion: str | Path | Policy | None, navigation: str | Path | Navigator | None
    ) -> None:
        legs = self._locomotion if locomotion is None else choose_locomotor(locomotion)
        guide = self._navigator if navigation is None else choose_navigator(navigation, self._config)
        check_cameras(legs, guide)
        goal, self._goal = self._goal, None
        self._locomotion, self._navigator = legs, guide
        self._rebuild(self.world)
        self._controller.reset(1)
        if goal is not None:
            self._go_to(goal)

    def _read_footholds(self) -> Footholds:
        """What the policies tell of their footholds, in the world frame; before the robot moves on."""
        tell = getattr(self._locomotion, "footholds", dict[str, np.ndarray])  # policies may have such a method
        found = self._controller.footholds() | tell()
        c, s = np.cos(self._yaw), np.sin(self._yaw)
        turn, at = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), self._walker.qpos[:3]
        places = {name: points[0] @ turn + at for name, points in found.items()}
        return Footholds(places.get("planned"), places.get("predicted"))
