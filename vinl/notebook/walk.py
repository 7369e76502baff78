"""One episode of the chain, to be looked at."""

from __future__ import annotations

import base64
import html
import numbers
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path

import numpy as np
from PIL import Image

from vinl.chain.choose import choose_locomotor, choose_navigator
from vinl.chain.config import EvaluationConfig, choose_rules
from vinl.chain.depth_cameras import open_depth_cameras
from vinl.chain.episode import draw_routes, draw_setup
from vinl.chain.navigators.base import Navigator
from vinl.chain.records import Episode, EpisodeRecord, EpisodeTrace
from vinl.chain.rollout import run_episodes
from vinl.chain.workers import one_thread, show_line
from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.config.output import check_out
from vinl.notebook.plans import draw_plan, open_plan
from vinl.policies.policy import Policy
from vinl.render.drawing import encode_picture
from vinl.render.panels import colour_depth
from vinl.render.video import POSE_DT, FilmJob, film
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.world.boxes import Blocks
from vinl.world.clutter import choose_clutter
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal

_VIEW_HEIGHT = 216

_STANDARD = {"locomotion": LOCOMOTION_CAMERA, "navigation": NAVIGATION_CAMERA}


@dataclass(frozen=True, eq=False)
class Walk:
    """An episode with the poses of the robot.

    Attributes:
        plan: the floor plan.
        route: start and goal.
        episode: record and trace, as ``evaluate`` returns them.
        config: the rules that it was run by.
        cameras: ``"locomotion"`` and ``"navigation"``: what its policies saw through, or the robot's standard cameras
            where they are blind.
    """

    plan: FloorPlan
    route: StartGoal
    episode: Episode
    config: EvaluationConfig
    cameras: Mapping[str, Camera] = field(default_factory=lambda: dict(_STANDARD))

    def __repr__(self) -> str:
        r = self.record
        return f"Walk({r.plan}, episode {r.episode}, seed {r.seed}: {self.describe()})"

    def describe(self) -> str:
        """How it ended, in a few words."""
        r = self.record
        return (
            f"{r.end_reason}, {r.distance_m:.1f} m in {r.time_s:.0f} s, "
            f"{r.foot_steps} control steps with a foot on something"
        )

    def _repr_html_(self) -> str:
        """What happened, over the path from above."""
        return f'<p>{html.escape(repr(self))}</p><img src="{encode_picture(self.draw())}">'

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
        heading = replace(self.route, yaw=self.record.yaw)  # drawn anew for every seed
        return draw_plan(self.plan, self.blocks, [heading], [self.trace.path], self.describe())

    def see(self, time: float, camera: str | Camera = "locomotion") -> np.ndarray:
        """What a depth camera on the trunk saw.

        Args:
            time: since the start [s]; poses are kept every 0.04 s.
            camera: ``"locomotion"`` or ``"navigation"``, or the record of a camera, for example ``policy.camera``.

        Returns:
            (height, width) [m].

        Raises:
            InputError: the walk was over by then, or there is no such camera.
        """
        camera = self._find(camera)
        if not isinstance(time, numbers.Real):
            raise InputError(f"see(time, camera): time is seconds since the start, got {time!r}")
        if not 0 <= time <= self.record.time_s:
            raise InputError(f"time must lie between 0 and {self.record.time_s:g} s, got {time:g}")
        pose = self.trace.poses[min(round(time / POSE_DT), len(self.trace.poses) - 1)]
        return (
            open_depth_cameras(self.plan, [self.blocks], camera, self.config.ceiling).look(pose[None])[0].numpy().copy()
        )

    def draw_views(self, time: float, cameras: Sequence[str | Camera] = ("locomotion", "navigation")) -> Image.Image:
        """The same as a picture, cameras side by side: bright is near, black is the far limit."""
        views = []
        for camera in map(self._find, cameras):
            view = Image.fromarray(colour_depth(self.see(time, camera), camera.far))
            size = (round(_VIEW_HEIGHT * camera.width / camera.height), _VIEW_HEIGHT)
            views.append(np.asarray(view.resize(size, Image.Resampling.NEAREST)))
            views.append(np.full((_VIEW_HEIGHT, 8, 3), 255, np.uint8))
        return Image.fromarray(np.concatenate(views[:-1], 1))

    def _find(self, camera: str | Camera) -> Camera:
        if isinstance(camera, Camera):
            return camera
        if camera not in self.cameras:
            known = ", ".join(self.cameras)
            raise InputError(f"there is no camera {camera!r}{closest(str(camera), self.cameras)}; known: {known}")
        return self.cameras[camera]


def walk(
    plan: str | Path | FloorPlan,
    locomotor: str | Path | Policy | None = None,
    navigator: str | Path | Navigator | None = None,
    obstacles: str = "paper",
    episode: int = 0,
    seed: int = 0,
    config: EvaluationConfig | None = None,
) -> Walk:
    """Walk one episode: the one that ``evaluate`` runs under the same plan, number and seed. On a terminal and in a
    notebook a bar shows how much of the time limit has passed in the simulation.

    Args:
        plan: name, file or plan.
        locomotor: name or folder of a policy, or one of one's own (``as_locomotor``); ``loco`` by default.
        navigator: name or folder of a policy, ``"oracle"``, or one of one's own (``as_navigator``); ``nav`` by default.
        obstacles: clutter preset.
        episode: number of the start/goal pair.
        seed: of clutter, heading and joint angles at the start.
        config: limits and rules; the paper's by default.

    Raises:
        InputError: a name is unknown, or a policy answered what is no answer.
    """
    rules, home = choose_rules(config), open_plan(plan)
    clutter = choose_clutter(obstacles, "obstacles")
    if not all(isinstance(number, numbers.Integral) and number >= 0 for number in (episode, seed)):
        raise InputError(f"episode and seed are whole numbers from 0 on, got {episode!r} and {seed!r}")
    legs, guide = choose_locomotor(locomotor), choose_navigator(navigator, rules)
    route = draw_routes(home, episode + 1, rules)[episode]
    setup = draw_setup(home, route, episode, seed, clutter, rules)
    decisions = count()
    with one_thread(), show_line("walking", "s") as show:

        def note() -> bool:
            show(next(decisions) * rules.navigation_period * CONTROL_DT, rules.time_limit)
            return False

        done = run_episodes(home, [setup], legs, guide, rules, filmed=(0,), is_stopped=note)[0]
    seen = {"locomotion": legs.camera, "navigation": guide.camera}
    return Walk(home, route, done, rules, {name: camera or _STANDARD[name] for name, camera in seen.items()})


@dataclass(frozen=True)
class Film:
    """A film: show it as the last line of a cell, so many pixels wide, or open the MP4 at ``path``."""

    path: Path
    width: int = 800

    def __repr__(self) -> str:
        return f"Film({self.path.name})"

    def _repr_html_(self) -> str:
        """A player with the film inside: the notebook needs no file."""
        data = base64.b64encode(self.path.read_bytes()).decode()
        return f'<video controls width="{self.width}" src="data:video/mp4;base64,{data}"></video>'


def show_video(
    walk: Walk, start: float = 0.0, stop: float | None = None, out: str | Path | None = None, width: int = 800
) -> Film:
    """The film of a walk: the robot, what its cameras see, the map. About 0.1 s a picture, 12.5 pictures a second.

    Args:
        walk: the episode.
        start, stop: show this part [s]; all of it by default. The clock of the film begins with it.
        out: folder for the file; a temporary one by default, which is gone with the film.
        width: in the notebook [pixels].

    Raises:
        InputError: start and stop leave nothing to show, it is no walk, or the folder cannot be written to.
    """
    if not isinstance(walk, Walk):
        raise InputError(f"show_video shows what vinl.walk returns, got {type(walk).__name__}")
    for name, time in (("start", start), ("stop", stop)):
        if time is not None and not isinstance(time, numbers.Real):
            raise InputError(f"show_video(walk, start, stop): {name} is a time [s], got {time!r}; a folder is out=...")
    part = cut_episode(walk.episode, start, stop)
    folder = Path(tempfile.mkdtemp(prefix="vinl-film-")) if out is None else check_out(out)
    shown = Film(folder / film(FilmJob(walk.plan, part, str(folder)), walk.config), width)
    if out is None:
        weakref.finalize(shown, shutil.rmtree, folder, ignore_errors=True)
    return shown


def cut_episode(episode: Episode, start: float, stop: float | None) -> Episode:
    """The part of an episode from ``start`` to ``stop`` [s], as a film needs it. Raises ``InputError`` if no pose lies
    between them."""
    trace, record = episode.trace, episode.record
    first, last = round(start / POSE_DT), len(trace.poses) if stop is None else round(stop / POSE_DT)
    if not 0 <= first < min(last, len(trace.poses)):
        raise InputError(f"nothing to show from {start:g} s to {stop or record.time_s:g} s of {record.time_s:g} s")
    end = record.time_s if stop is None else min(stop, record.time_s)
    kept = trace.contacts[(trace.contacts[:, 0] >= start) & (trace.contacts[:, 0] <= end)]
    part = replace(
        trace,
        poses=trace.poses[first:last],
        commands=trace.commands[first:last],
        contacts=kept - [first * POSE_DT, 0, 0, 0],
    )
    return Episode(record if end == record.time_s else replace(record, end_reason=""), part)
