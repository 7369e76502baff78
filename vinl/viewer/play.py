"""``vinl.play``: a live robot, or a recording, in the browser or in a frame of a notebook."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vinl.benchmark.recordings import Recordings
from vinl.chain.choose import best_locomotor, best_navigator
from vinl.chain.config import EvaluationConfig, choose_rules
from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.config.errors import InputError
from vinl.policies.card import read_card
from vinl.policies.io import find_policy, list_policies
from vinl.policies.policy import Policy
from vinl.viewer.live import LiveChain
from vinl.viewer.replay import Replay
from vinl.viewer.session import Session
from vinl.viewer.world import open_ground, open_home
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import load_floorplan, shipped_floorplans

if TYPE_CHECKING:
    from vinl.viewer.viewer import Viewer


def require_viser(what: str) -> None:
    """Refuse where viser is not installed. Raises ``InputError`` if it is not."""
    if find_spec("viser") is None:
        raise InputError(f'{what} needs viser, which only the viewer uses; install it: pip install "vinl[viewer]"')


def play(
    plan: str | Path | FloorPlan | None = None,
    locomotion: str | Path | Policy | None = None,
    navigation: str | Path | Navigator | None = None,
    obstacles: str = "paper",
    seed: int = 0,
    *,
    terrain: str | None = None,
    density: float | None = None,
    pace: float = 1.0,
    host: str = "127.0.0.1",
    port: int = 0,
    config: EvaluationConfig | None = None,
) -> Viewer:
    """A live robot on a page in the browser; in a notebook the page shows itself as the last line of a cell.

    Args:
        plan: name, file or plan; the first shipped one by default.
        locomotion: name or folder of a locomotion policy, or a policy; the best shipped one by default.
        navigation: the same of a navigation policy, or ``"oracle"``; the shipped one by default, on open ground the
            oracle.
        obstacles: preset of clutter in a floor plan.
        seed: of clutter and start, the same as in ``evaluate``.
        terrain: open ground in place of a plan: one of ``world.OPEN_GROUNDS``.
        density: blocks or objects of litter per m2 on open ground, see ``world.open_ground``.
        pace: speed of time; 1 is real time.
        host: address to listen on; ``"0.0.0.0"`` lets other machines in.
        port: to listen on; 0 for any free one.
        config: rules of the evaluation.

    Returns:
        The page, which runs in threads of its own until ``close``.

    Raises:
        InputError: a name is unknown, the port is taken, or viser is not installed.
    """
    require_viser("vinl.play")
    from vinl.viewer.viewer import Viewer

    rules = choose_rules(config)
    if terrain is not None and plan is not None:
        raise InputError("plan and terrain do not go together; give one of them")
    shipped = shipped_floorplans()
    if terrain is not None:
        world, plans = open_ground(terrain, seed, density), []
    else:
        if plan is None and not shipped:
            raise InputError("no floor plan is shipped with this version; give a file")
        chosen = plan if plan is not None else shipped[0]
        home = chosen if isinstance(chosen, FloorPlan) else load_floorplan(chosen)
        world = open_home(home, obstacles, seed, rules)
        first = home.name if home.name in shipped else str(chosen)
        plans = [first, *(name for name in shipped if name != first)]
        if isinstance(plan, FloorPlan):
            plans = []  # a plan without a file cannot be opened again by its name
    legs = best_locomotor() if locomotion is None else locomotion
    guide = navigation
    if guide is None:
        guide = best_navigator() if terrain is None else ORACLE
    session = Session(LiveChain(world, legs, guide, rules, seed), pace)
    viewer = Viewer(session, f"vinl play: {world.plan.name}", host, port)
    viewer.add_controls(
        plans,
        _choices(legs, _names_of_kind("locomotion")),
        _choices(guide, [*_names_of_kind("navigation"), ORACLE]),
        "none" if terrain is not None else obstacles,
    )
    session.start()
    return viewer.start()


def _names_of_kind(kind: str) -> list[str]:
    return [name for name in list_policies() if read_card(find_policy(name)).kind == kind]


def _choices(given: Any, names: list[str]) -> dict[str, Any]:
    """What can be chosen by name, the present choice first."""
    first = str(given) if isinstance(given, (str, Path)) else "as given"
    return {first: given, **{name: name for name in names if name != first}}


def replay(
    folder: str | Path, episode: int = 0, *, pace: float = 1.0, host: str = "127.0.0.1", port: int = 0
) -> Viewer:
    """Recorded episodes on a page in the browser.

    Args:
        folder: that ``vinl eval --record`` wrote.
        episode: which one to begin with, counted from 0 in the order of ``results.json``.
        pace: speed of time; 1 is real time.
        host, port: as for ``play``.

    Raises:
        InputError: the folder holds no recordings or not so many, the port is taken, or viser is not installed.
    """
    require_viser("vinl.replay")
    from vinl.viewer.viewer import Viewer

    shelf = Recordings(Path(folder))
    session = Session(Replay(shelf, episode), pace, paused=True)
    viewer = Viewer(session, "vinl play: recording", host, port)
    viewer.add_replay_controls(shelf.labels, episode)
    session.start()
    return viewer.start()
