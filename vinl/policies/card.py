"""The policy card: everything about a trained policy that is not its weights."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.gait.config import GaitConfig
from vinl.gait.observation import STEPPING_TABLE
from vinl.robot.aliengo import ACTION_SCALE, DEFAULT_POSE, KD, KP
from vinl.robot.observation import PROPRIOCEPTION, ObservationTable

SCHEMA = 1
"""Version of ``card.json``."""

CARD_FILE = "card.json"


@dataclass(frozen=True, repr=False)
class PolicyCard:
    """What a policy needs to be used, and where it comes from.

    Attributes:
        kind: what it drives.
        name: short name.
        network: class name and sizes, as ``PolicyNetwork.describe`` gives them.
        observation: rows of the observation table, as ``robot.observation.describe`` gives them.
        action: ``scale`` [rad], ``default_pose`` [rad], ``kp`` [N m/rad], ``kd`` [N m s/rad] that it was trained with;
            of a navigator ``forward_speed`` [m/s] and ``yaw_rate`` [rad/s] at the actions -1 and 1.
        camera: the depth camera that it sees through, or None.
        gait: of a locomotor, the settings of the gait that it observes (``gait.config.GaitConfig``); None: it has none.
        training: the resolved training configuration.
        seed: of the training run.
        samples: environment steps that it learned from.
        commit: of the code that trained it.
        evaluation: measured figures, each group with the command that measured it.
        schema: version of this layout.
    """

    kind: Literal["locomotion", "navigation"]
    name: str
    network: dict[str, Any]
    observation: list[dict[str, Any]]
    action: dict[str, Any]
    camera: dict[str, Any] | None = None
    gait: dict[str, Any] | None = None
    training: dict[str, Any] = field(default_factory=dict)
    seed: int = 0
    samples: int = 0
    commit: str = ""
    evaluation: dict[str, Any] = field(default_factory=dict)
    schema: int = SCHEMA

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise InputError(f"schema {self.schema} is not known; this version reads schema {SCHEMA}")
        if self.samples < 0:
            raise InputError(f"samples must not be negative, got {self.samples}")

    def __repr__(self) -> str:
        network = self.network.get("class", "no network")
        return f"PolicyCard({self.name}, {self.kind}, {network}, {self.samples:,} samples)"

    @property
    def observation_size(self) -> int:
        """Numbers that the policy observes."""
        return sum(int(row["size"]) for row in self.observation)


NAVIGATION_TABLE: tuple[dict[str, Any], ...] = (
    {"name": "goal_distance", "size": 1, "scale": [0.2], "unit": "m"},
    {"name": "goal_direction", "size": 2, "scale": [1.0], "unit": "cosine, sine"},
    {"name": "previous_action", "size": 2, "scale": [1.0], "unit": "1"},
)
"""What a navigator observes beside depth: straight distance to the goal, its bearing in the heading frame (left is
positive), and its last action, held to [-1, 1], zero when an episode begins."""

PREVIOUS_MOTION: dict[str, Any] = {"name": "previous_motion", "size": 2, "scale": [1.0], "unit": "1"}
"""What a navigator may observe in the place of its last action, or behind it: how the robot moved meanwhile, as the
action that asks for just that: (2 x mean forward speed / (1 m/s) - 1, mean yaw rate / (60 deg/s)), held to [-1, 1];
(-1, 0) is a robot that stood or was stopped. Zero when an episode begins."""

PREVIOUS_STEP: dict[str, Any] = {"name": "previous_step", "size": 3, "scale": [1.0], "unit": "m, m, rad"}
"""What a navigator may observe behind its last action: how far it came since its last decision by odometry, ahead, to
the left and turned, in the heading frame that it had then. Zero when an episode begins."""

FORWARD_SPEED = (0.0, 1.0)
"""Forward speed at the actions -1 and 1 [m/s] [paper]."""

YAW_RATE = (-math.pi / 3, math.pi / 3)
"""Yaw rate at the actions -1 and 1 [rad/s] [paper: 60 deg/s]."""


def describe_action(kp: float = KP, kd: float = KD) -> dict[str, Any]:
    """How actions become joint targets on this robot, as plain data for a card."""
    return {"scale": ACTION_SCALE, "default_pose": DEFAULT_POSE.tolist(), "kp": kp, "kd": kd}


def locomotion_card(
    name: str,
    network: dict[str, Any],
    action: dict[str, Any] | None = None,
    gait: dict[str, Any] | None = None,
    table: ObservationTable | None = None,
    **rest: Any,
) -> PolicyCard:
    """A locomotion card with this robot's observation table and, unless given, action; ``rest`` are further fields.

    Args:
        name: short name.
        network: as ``PolicyNetwork.describe`` gives it.
        action: scale, default pose and gains.
        gait: settings of the gait whose rows it observes; None: it observes none.
        table: what it observes, where that is another than ``gait`` says.
    """
    rows = (table or locomotion_table(gait is not None)).describe()
    return PolicyCard("locomotion", name, network, rows, action or describe_action(), gait=gait, **rest)


def locomotion_table(gait: bool) -> ObservationTable:
    """What a locomotor observes: proprioception, then the rows of its gait if it has one."""
    return STEPPING_TABLE if gait else PROPRIOCEPTION


def find_gait(card: PolicyCard) -> GaitConfig | None:
    """The gait whose rows a locomotor observes; None: it observes none.

    Raises:
        InputError: the card asks for a gait that there cannot be.
    """
    return None if card.gait is None else build_config(GaitConfig, card.gait, source=f"{card.name}: gait")


PREVIOUS = ("action", "motion", "both", "step")
"""What a navigator may know of its last step."""


def navigation_table(previous: str = "action") -> list[dict[str, Any]]:
    """What a navigator observes: the goal, and of its last step the action, the motion (``PREVIOUS_MOTION``) or both,
    the action first; ``step``: the action and the ``PREVIOUS_STEP``."""
    goal, action = NAVIGATION_TABLE[:2], NAVIGATION_TABLE[2]
    last = {
        "action": (action,),
        "motion": (PREVIOUS_MOTION,),
        "both": (action, PREVIOUS_MOTION),
        "step": (action, PREVIOUS_STEP),
    }[previous]
    return [dict(row) for row in (*goal, *last)]


def find_previous(card: PolicyCard) -> str:
    """What a navigator's card lists of its last step: one of ``PREVIOUS``."""
    names = {row.get("name") for row in card.observation}
    if PREVIOUS_STEP["name"] in names:
        return "step"
    if PREVIOUS_MOTION["name"] not in names:
        return "action"
    return "both" if NAVIGATION_TABLE[2]["name"] in names else "motion"


def navigation_card(
    name: str,
    network: dict[str, Any],
    camera: dict[str, Any] | None,
    previous: str = "action",
    max_speed: float = FORWARD_SPEED[1],
    max_yaw_rate: float = YAW_RATE[1],
    min_speed: float = FORWARD_SPEED[0],
    **rest: Any,
) -> PolicyCard:
    """A navigation card with the table and the action scaling that ``NavActor`` has; ``previous`` as for
    ``navigation_table``, ``min_speed``, ``max_speed`` [m/s] and ``max_yaw_rate`` [rad/s] as in training, ``rest`` are
    further fields."""
    action = {"forward_speed": [min_speed, max_speed], "yaw_rate": [-max_yaw_rate, max_yaw_rate]}
    return PolicyCard("navigation", name, network, navigation_table(previous), action, camera, **rest)


def write_card(folder: Path, card: PolicyCard) -> None:
    """Write ``card.json`` into the folder."""
    text = json.dumps(asdict(card), indent=2, allow_nan=False)
    (folder / CARD_FILE).write_text(text + "\n", encoding="utf-8")


def read_card(folder: Path) -> PolicyCard:
    """The card of a policy folder.

    Raises:
        InputError: the file is missing, broken, or says something that no policy can be.
    """
    path = folder / CARD_FILE
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{folder} is no policy folder: {CARD_FILE} is missing") from None
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not valid JSON: {error}") from None
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold a JSON object, got {type(data).__name__}")
    card = build_config(PolicyCard, data, source=str(path))
    for row in card.observation:
        if not isinstance(row.get("size"), int) or not isinstance(row.get("name"), str):
            raise InputError(f"{path}: each row of observation needs a name and a whole size, got {row}")
    return card
