"""The policy card: everything about a trained policy that is not its weights."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.robot.aliengo import ACTION_SCALE, DEFAULT_POSE, KD, KP
from vinl.robot.observation import describe

SCHEMA = 1
"""Version of ``card.json``."""

CARD_FILE = "card.json"


@dataclass(frozen=True)
class PolicyCard:
    """What a policy needs to be used, and where it comes from.

    Attributes:
        kind: what it drives.
        name: short name.
        network: class name and sizes, as ``PolicyNetwork.describe`` gives them.
        observation: rows of the observation table, as ``robot.observation.describe`` gives them.
        action: ``scale`` [rad], ``default_pose`` [rad], ``kp`` [N m/rad], ``kd`` [N m s/rad] that it was trained with.
        camera: the depth camera that it sees through, or None.
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

    @property
    def observation_size(self) -> int:
        """Numbers that the policy observes."""
        return sum(int(row["size"]) for row in self.observation)


def describe_action() -> dict[str, Any]:
    """How actions become joint targets on this robot, as plain data for a card."""
    return {"scale": ACTION_SCALE, "default_pose": DEFAULT_POSE.tolist(), "kp": KP, "kd": KD}


def locomotion_card(
    name: str, network: dict[str, Any], action: dict[str, Any] | None = None, **rest: Any
) -> PolicyCard:
    """A locomotion card with this robot's observation table and, unless given, action; ``rest`` are further fields."""
    return PolicyCard("locomotion", name, network, describe(), action or describe_action(), **rest)


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
        if not isinstance(row.get("size"), int) or "name" not in row:
            raise InputError(f"{path}: each row of observation needs a name and a whole size, got {row}")
    return card
