"""Trained networks that a training starts from."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from torch import Tensor, nn

from vinl.config.errors import InputError
from vinl.loco.config import LocoConfig
from vinl.policies.card import PolicyCard, find_gait
from vinl.policies.identity import digest_tensors
from vinl.policies.io import find_policy, load_policy
from vinl.policies.lineage import trace_lineage
from vinl.policies.networks import PolicyNetwork, StepActor
from vinl.rl.run_folder import CHECKPOINT, RunFolder


@dataclass(frozen=True)
class Origin:
    """Where the networks of a training come from: this goes onto the card of the new policy.

    Attributes:
        samples: that it had learned from.
        weights: SHA-256 of its actor's weights.
        critic: whether the critic was taken over too.
        lineage: every training behind it, see ``policies.lineage``.
    """

    policy: str
    samples: int
    commit: str
    weights: str
    critic: bool
    lineage: list[dict[str, Any]]


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


def load_warm_start(name_or_path: str, config: LocoConfig) -> WarmStart:
    """The networks of a policy (actor alone) or of a training run (actor and critic).

    Args:
        name_or_path: ``"rough"``, ``"vinl/rough"``, a policy folder or the folder of a training run.

    Raises:
        InputError: no such policy, one of another kind, of other sizes, with another gait or with other joint gains.
    """
    policy = load_policy(name_or_path)
    network = policy.network
    if not isinstance(network, StepActor):
        raise InputError(
            f"--from {name_or_path}: a {policy.card.kind} policy with a {type(network).__name__}; give one of stage 1 "
            "or 2, which have a StepActor"
        )
    # the gait is looked at by itself: one without a map has the same weights
    given, wanted = (_without_gait(x) for x in (network, StepActor(actor=config.ppo.actor)))
    if given != wanted:
        raise InputError(
            f"--from {name_or_path}: its network {_list(given)} is not that of this training "
            f"{_list(wanted)}; set ppo.actor to its own, or give another policy"
        )
    _check_gait(name_or_path, policy.card, config)
    check_gains(name_or_path, policy.card, config)
    actor = {name: weight.clone() for name, weight in network.state_dict().items()}
    critic = _load_critic(name_or_path, config)
    return WarmStart(actor, critic, find_origin(policy.card, network, critic is not None))


def load_teacher(name_or_path: str, config: LocoConfig) -> tuple[StepActor, Origin]:
    """The teacher of a student, and where it comes from.

    Args:
        name_or_path: as for ``load_warm_start``.

    Raises:
        InputError: no such policy, one that is no ``StepActor``, one with another gait, or one with other joint
            gains.
    """
    policy = load_policy(name_or_path)
    if not isinstance(policy.network, StepActor):
        kind = _KINDS.get(type(policy.network).__name__, type(policy.network).__name__)
        raise InputError(
            f"--from {name_or_path}: a student learns from a locomotor that knows where its feet shall go (StepActor, "
            f"such as vinl/teacher); this is {kind}"
        )
    _check_gait(name_or_path, policy.card, config)
    check_gains(name_or_path, policy.card, config)
    return policy.network, find_origin(policy.card, policy.network, critic=False)


_KINDS = {"SteppingActor": "a student itself (SteppingActor)", "NavActor": "a navigator (NavActor)"}


def _check_gait(name_or_path: str, card: PolicyCard, config: LocoConfig) -> None:
    """Refuse a ``StepActor`` that walks with another gait.

    Raises:
        InputError: it does.
    """
    gait = find_gait(card)
    assert gait is not None  # what a StepActor observes is refused on a card without one
    # with a map or without one, what a policy observes of its gait means the same
    other = [name for name, value in asdict(gait).items() if name != "map" and value != getattr(config.gait, name)]
    if other:
        own = " ".join(f"gait.{name}={asdict(gait)[name]}" for name in other)
        raise InputError(f"--from {name_or_path}: it walks with another gait; set {own}, or give another policy")


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
    weights = network.state_dict()
    return Origin(card.name, card.samples, card.commit, digest_tensors(weights), critic, trace_lineage(card, weights))


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
    return critic


def _without_gait(network: PolicyNetwork) -> dict[str, object]:
    return {name: value for name, value in network.describe().items() if name != "gait"}


def _list(description: dict[str, object]) -> str:
    return ", ".join(f"{name} {value}" for name, value in description.items())
