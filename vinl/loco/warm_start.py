"""Trained networks that a training starts from."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from vinl.config.errors import InputError
from vinl.loco.config import LocoConfig
from vinl.policies.card import PolicyCard, find_detour
from vinl.policies.depth_actor import DepthActor
from vinl.policies.io import find_policy, load_policy
from vinl.policies.networks import BlindActor, MapActor
from vinl.rl.run_folder import CHECKPOINT, RunFolder
from vinl.robot.observation import PROPRIOCEPTION_SIZE, HeightScan, find_scan
from vinl.sensing.detour import DetourConfig


@dataclass(frozen=True)
class Origin:
    """Where the networks of a training come from: this goes onto the card of the new policy.

    Attributes:
        policy: name on the card of the old policy.
        samples: that it had learned from.
        commit: of the code that trained it.
        weights: first digits of the SHA-256 of its actor's weights.
        critic: whether the critic was taken over too.
    """

    policy: str
    samples: int
    commit: str
    weights: str
    critic: bool


@dataclass(frozen=True, eq=False)
class WarmStart:
    """Weights under the names of the shipped actors and of rsl-rl's critic.

    Attributes:
        actor: weights of encoder and actor.
        critic: weights of the critic; None: the policy came without one.
        origin: where they come from.
    """

    actor: dict[str, Tensor]
    critic: dict[str, Tensor] | None
    origin: Origin

    def describe(self) -> dict[str, object]:
        """The origin as plain data."""
        return asdict(self.origin)


def load_warm_start(name_or_path: str, config: LocoConfig) -> WarmStart:
    """The networks of a policy (actor alone) or of a training run (actor and critic).

    One that reads fewer points of the ground than the training gives is widened: it acts as before until it learns
    what the new points are good for.

    Args:
        name_or_path: ``"rough"``, ``"vinl/rough"``, a policy folder or the folder of a training run.
        config: of the training that shall start from them.

    Raises:
        InputError: no such policy, one of another kind, of other sizes or with other joint gains.
    """
    policy = load_policy(name_or_path)
    network, p = policy.network, config.ppo
    sizes: dict[str, Any] = {"scan": config.scan.size, "actor": p.actor}
    fresh = MapActor(encoder=p.encoder, code=p.code, **sizes) if p.map else BlindActor(**sizes)
    given, wanted = network.describe(), fresh.describe()
    read = find_scan(network.observation_size)
    if given != wanted and (read is None or not config.scan.covers(read) or given != {**wanted, "scan": read.size}):
        raise InputError(
            f"--from {name_or_path}: its network {_list(given)} is not that of this training "
            f"{_list(wanted)}; set scan_spacing, scan_ahead, scan_feet, ppo.map, ppo.encoder, ppo.code and ppo.actor "
            "to its own, or give another policy"
        )
    check_gains(name_or_path, policy.card, config)
    actor = {name: weight.clone() for name, weight in network.state_dict().items()}
    if p.map:
        actor["encoder.0.weight"] = widen_scan(actor["encoder.0.weight"], 0, config.scan)
    critic = _load_critic(name_or_path, config)
    return WarmStart(actor, critic, find_origin(policy.card, network, critic is not None))


def load_teacher(name_or_path: str, config: LocoConfig) -> tuple[MapActor, Origin, DetourConfig | None]:
    """The teacher of a student, where it comes from, and how its commands are bent.

    Args:
        name_or_path: as for ``load_warm_start``.
        config: of the student's training; with no detour of its own it takes the teacher's.

    Raises:
        InputError: no such policy, one that does not read the height scan of this training, one with other detours
            than this training asks for, or one with other joint gains.
    """
    policy = load_policy(name_or_path)
    if not isinstance(policy.network, MapActor):
        kind = _KINDS.get(type(policy.network).__name__, type(policy.network).__name__)
        raise InputError(
            f"--from {name_or_path}: a student learns from a locomotor with a height scan (MapActor, such as "
            f"vinl/teacher); this is {kind}"
        )
    given = find_scan(policy.card.observation_size)
    if given is None or given != config.scan:
        own = "" if given is None else f"; set {given.settings}"
        raise InputError(
            f"--from {name_or_path}: it observes {policy.card.observation_size} numbers, this training gives "
            f"{config.scan.observation_size}{own}"
        )
    bent = find_detour(policy.card)
    if config.detour not in (None, bent):
        own = "none" if bent is None else " ".join(f"detour.{name}={value:g}" for name, value in asdict(bent).items())
        raise InputError(
            f"--from {name_or_path}: commands are bent otherwise here than it knows; take detour out of the config, a "
            f"student has its teacher's ({own})"
        )
    check_gains(name_or_path, policy.card, config)
    return policy.network, find_origin(policy.card, policy.network, critic=False), bent


def take_over_student(name_or_path: str, student: DepthActor, config: LocoConfig) -> None:
    """Give a student the image network and memory of another one; the teacher's actor comes behind them later.

    Args:
        name_or_path: as for ``load_warm_start``.
        student: its weights are overwritten.
        config: of its training.

    Raises:
        InputError: no such policy, one with other networks or with other joint gains.
    """
    policy = load_policy(name_or_path)
    given, wanted = policy.network.describe(), student.describe()
    if given not in (wanted, {name: value for name, value in wanted.items() if name != "detour"}):
        raise InputError(
            f"student.start={name_or_path}: its network {_list(given)} is not that of this training {_list(wanted)}; "
            "set student.network and student.camera to its own"
        )
    check_gains(name_or_path, policy.card, config)
    weights = policy.network.state_dict()
    if given != wanted:  # it knows of no detours yet
        lacking = student.code - len(weights["head.weight"])
        for name in ("head.weight", "head.bias"):
            rows = weights[name]
            weights[name] = torch.cat([rows, rows.new_zeros(lacking, *rows.shape[1:])])
    student.load_state_dict(weights)


_KINDS = {
    "BlindActor": "a locomotor without a map (BlindActor)",
    "DepthActor": "a student itself (DepthActor)",
    "NavActor": "a navigator (NavActor)",
}


def widen_scan(weight: Tensor, ahead: int, scan: HeightScan) -> Tensor:
    """The first layer of a network for a finer or farther height scan than it was trained with.

    The weights of each old point go to the same point. All others are zero, so that the network answers as before.

    Args:
        weight: (width, ahead + k), for a scan of k points.
        ahead: inputs before the scan.
        scan: of the new network.

    Returns:
        (width, ahead + scan.size); the weight itself if it is of this scan.
    """
    old = find_scan(PROPRIOCEPTION_SIZE + weight.shape[1] - ahead)
    if old is None or old == scan:
        return weight
    places = ahead + torch.from_numpy(scan.places_of(old))
    wide = weight.new_zeros(len(weight), ahead + scan.size)
    wide[:, :ahead], wide[:, places] = weight[:, :ahead], weight[:, ahead:]
    return wide


def check_gains(name_or_path: str, card: PolicyCard, config: LocoConfig) -> None:
    """Refuse a policy that was trained with other joint gains.

    Raises:
        InputError: it was.
    """
    gains = float(card.action["kp"]), float(card.action["kd"])
    if gains != (config.kp, config.kd):
        raise InputError(f"{name_or_path}: it was trained with kp {gains[0]:g} and kd {gains[1]:g}; set kp and kd")


def find_origin(card: PolicyCard, network: nn.Module, critic: bool) -> Origin:
    """What the card of the new policy says about the old one."""
    weights = network.state_dict().values()
    digest = hashlib.sha256(b"".join(weight.cpu().numpy().tobytes() for weight in weights)).hexdigest()[:12]
    return Origin(card.name, card.samples, card.commit, digest, critic)


def _load_critic(name_or_path: str, config: LocoConfig) -> dict[str, Tensor] | None:
    """The critic of a run; None for a policy folder, and where the new critic has other widths."""
    folder = Path(name_or_path)
    if not (folder / CHECKPOINT).is_file() or find_policy(name_or_path) != folder / "policy":
        return None
    checkpoint = RunFolder(folder).load_checkpoint() or {}
    critic = checkpoint.get("algorithm", {}).get("critic_state_dict")
    if not isinstance(critic, dict):
        raise InputError(
            f"{folder / CHECKPOINT} holds no critic; give {folder / 'policy'} to start from the actor alone"
        )
    widths = tuple(w.shape[0] for name, w in critic.items() if name.startswith("mlp.") and w.ndim == 2)
    if widths != (*config.ppo.critic, 1):
        return None
    return critic | {"mlp.0.weight": widen_scan(critic["mlp.0.weight"], PROPRIOCEPTION_SIZE, config.scan)}


def _list(description: dict[str, object]) -> str:
    return ", ".join(f"{name} {value}" for name, value in description.items())
