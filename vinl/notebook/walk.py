"""One episode of the chain, to be looked at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from vinl.chain.choose import choose_locomotor
from vinl.chain.config import EvaluationConfig
from vinl.chain.depth_cameras import open_eyes
from vinl.chain.episode import draw_routes, draw_setup
from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.chain.navigators.choose import load_navigator
from vinl.chain.records import Episode, EpisodeRecord, EpisodeTrace
from vinl.chain.rollout import run_episodes
from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.notebook.plans import draw_plan, open_plan
from vinl.policies.policy import Policy
from vinl.render.panels import colour_depth
from vinl.render.video import POSE_DT
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.world.blocks import Blocks
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal

_VIEW_HEIGHT = 216


@dataclass(frozen=True, eq=False)
class Walk:
    """An episode with the poses of the robot.

    Attributes:
        plan: the floor plan.
        route: start and goal.
        episode: record and trace, as ``evaluate`` returns them.
        config: the rules that it was run by.
    """

    plan: FloorPlan
    route: StartGoal
    episode: Episode
    config: EvaluationConfig

    @property
    def record(self) -> EpisodeRecord:
        """The figures."""
        return self.episode.record

    @property
    def trace(self) -> EpisodeTrace:
        """Path, contacts, blocks and poses."""
        return self.episode.trace

    @property
    def blocks(self) -> Blocks:
        """The clutter."""
        return Blocks(self.trace.blocks)

    def draw(self) -> Image.Image:
        """The way from above."""
        r = self.record
        title = (
            f"{r.end_reason}: {r.distance_m:.1f} m in {r.time_s:.0f} s, {r.foot_steps} steps with a foot on something"
        )
        heading = replace(self.route, yaw=self.record.yaw)  # drawn anew for every seed
        return draw_plan(self.plan, self.blocks, [heading], [self.trace.path], title)

    def see(self, time: float, camera: Camera = LOCOMOTION_CAMERA) -> np.ndarray:
        """What a depth camera on the trunk saw.

        Args:
            time: since the start [s]; poses are kept every 0.04 s.
            camera: the record of the camera, for example ``policy.camera``.

        Returns:
            (height, width) [m].
        """
        if not 0 <= time <= self.record.time_s:
            raise InputError(f"time must lie between 0 and {self.record.time_s:g} s, got {time:g}")
        pose = self.trace.poses[min(round(time / POSE_DT), len(self.trace.poses) - 1)]
        return open_eyes(self.plan, [self.blocks], camera, self.config.ceiling).look(pose[None])[0].numpy().copy()

    def draw_views(
        self, time: float, cameras: tuple[Camera, ...] = (LOCOMOTION_CAMERA, NAVIGATION_CAMERA)
    ) -> Image.Image:
        """The same as a picture, cameras side by side: bright is near, black is the far limit."""
        views = []
        for camera in cameras:
            view = Image.fromarray(colour_depth(self.see(time, camera), camera.far))
            size = (round(_VIEW_HEIGHT * camera.width / camera.height), _VIEW_HEIGHT)
            views.append(np.asarray(view.resize(size, Image.Resampling.NEAREST)))
            views.append(np.full((_VIEW_HEIGHT, 8, 3), 255, np.uint8))
        return Image.fromarray(np.concatenate(views[:-1], 1))


def walk(
    plan: str | Path | FloorPlan,
    locomotor: str | Path | Policy | None = None,
    navigator: str | Path | Navigator = ORACLE,
    obstacles: str = "paper",
    episode: int = 0,
    seed: int = 0,
    config: EvaluationConfig | None = None,
) -> Walk:
    """Walk one episode: the one that ``evaluate`` runs under the same plan, number and seed.

    Args:
        plan: name, file or plan.
        locomotor: name or folder of a policy, or one of one's own (``as_locomotor``); the best shipped one by default.
        navigator: ``"oracle"``, name or folder of a policy, or one of one's own (``as_navigator``).
        obstacles: clutter preset.
        episode: number of the start/goal pair.
        seed: of clutter, heading and joint angles at the start.
        config: limits and rules; the paper's by default.

    Raises:
        InputError: a name is unknown, or a policy answered what is no answer.
    """
    rules, home = config or EvaluationConfig(), open_plan(plan)
    if obstacles not in CLUTTER:
        known = ", ".join(CLUTTER)
        raise InputError(f"obstacles {obstacles!r} is no preset{closest(obstacles, CLUTTER)}; known: {known}")
    if episode < 0 or seed < 0:
        raise InputError(f"episode and seed must not be negative, got {episode} and {seed}")
    legs = choose_locomotor(locomotor)
    guide = load_navigator(navigator, rules) if isinstance(navigator, (str, Path)) else navigator
    route = draw_routes(home, episode + 1, rules)[episode]
    setup = draw_setup(home, route, episode, seed, CLUTTER[obstacles], rules)
    return Walk(home, route, run_episodes(home, [setup], legs, guide, rules, filmed=(0,))[0], rules)
