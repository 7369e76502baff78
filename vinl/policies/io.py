"""Policies on disk: a folder with ``policy.safetensors`` and ``card.json``. Nothing is ever unpickled."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import safetensors
import torch
from safetensors.torch import load_file, save_file
from torch import Tensor

from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.config.paths import assets_dir
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import (
    CARD_FILE,
    PolicyCard,
    find_gait,
    find_previous,
    locomotion_table,
    navigation_table,
    read_card,
    write_card,
)
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.device import choose_device
from vinl.policies.lineage import with_lineage
from vinl.policies.networks import PolicyNetwork, build_network
from vinl.policies.policy import LocomotionPolicy

WEIGHTS_FILE = "policy.safetensors"


def list_policies() -> list[str]:
    """Names of the policies that travel with the package."""
    return sorted(path.parent.name for path in (assets_dir() / "policies").glob(f"*/{CARD_FILE}"))


def find_policy(name_or_path: str | Path) -> Path:
    """The folder of a policy: a shipped one (``"rough"`` or ``"vinl/rough"``), a policy folder, or a training run.

    Raises:
        InputError: neither a shipped name nor a policy folder.
    """
    text = str(name_or_path)
    names = list_policies()
    bare = text.removeprefix("vinl/")
    if bare in names:
        return assets_dir() / "policies" / bare
    folder = Path(text)
    if folder.is_dir():
        inside = folder / "policy"
        return inside if not (folder / CARD_FILE).exists() and (inside / CARD_FILE).exists() else folder
    if folder.exists():
        raise InputError(f"{text} is a file; a policy is a folder with {CARD_FILE} and {WEIGHTS_FILE}")
    known = f"shipped: {', '.join(names)}" if names else "none is shipped"
    raise InputError(f"unknown policy {text!r}{closest(bare, names)}; {known}; or give a policy folder")


def load_policy(name_or_path: str | Path, device: str = "cpu") -> LocomotionPolicy | DepthPolicy:
    """A trained policy, ready to act: one that sees or remembers as a ``DepthPolicy``, any other as a
    ``LocomotionPolicy``.

    Args:
        name_or_path: ``"rough"``, ``"vinl/rough"``, a policy folder or the folder of a training run.
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:1"``.

    Raises:
        InputError: unknown name, missing or broken file, a card that does not fit the weights or this robot.
    """
    target = choose_device(device)
    folder = find_policy(name_or_path)
    card = read_card(folder)
    source = str(folder / CARD_FILE)
    with torch.device("meta"):  # allocates nothing before the shapes are known to fit, and draws no random number
        network = build_network(card.network, source)
    if network.observation_size != card.observation_size:
        raise InputError(
            f"{source}: the network takes {network.observation_size} numbers, "
            f"the observation table has {card.observation_size}"
        )
    sees = hasattr(network, "image")
    _check_against_robot(card, folder, network, sees)
    weights = _read_weights(folder / WEIGHTS_FILE)
    _check_weights(network, weights, folder)
    network.load_state_dict({key: w.to(target, torch.float32) for key, w in weights.items()}, assign=True)
    network.to(target)  # what is no weight
    return DepthPolicy(network, card) if sees else LocomotionPolicy(network, card)


def save_policy(folder: str | Path, network: PolicyNetwork, card: PolicyCard, half: bool = False) -> Path:
    """Write a policy folder, whole or not at all; an older policy at the same place is replaced.

    Args:
        folder: where to.
        network: its weights are written, as float16 if ``half`` else float32.
        card: must describe the network.

    Raises:
        InputError: the folder holds other things, or the weights are not finite.
        ValueError: the card describes another network.
    """
    folder = Path(folder)
    if card.network != network.describe():
        raise ValueError(f"the card describes {card.network}, the network is {network.describe()}")
    _refuse_foreign_folder(folder)
    kind = torch.float16 if half else torch.float32
    weights = {k: w.detach().to("cpu", kind).contiguous() for k, w in network.state_dict().items()}
    _check_weights(network, weights, folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as scratch:
        fresh, old = Path(scratch) / "new", Path(scratch) / "old"
        fresh.mkdir()
        write_card(fresh, with_lineage(card, weights))
        save_file(weights, fresh / WEIGHTS_FILE)
        if folder.exists():
            folder.rename(old)
        try:
            fresh.rename(folder)
        except OSError:
            if old.exists():
                old.rename(folder)
            raise
        shutil.rmtree(old, ignore_errors=True)
    return folder


def _refuse_foreign_folder(folder: Path) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError(f"{folder} is a file; a policy is written to a folder")
    foreign = sorted(p.name for p in folder.iterdir() if p.name not in (CARD_FILE, WEIGHTS_FILE))
    if foreign:
        raise InputError(f"{folder} holds {foreign[0]} and is no policy folder; choose another folder")


def _check_against_robot(card: PolicyCard, folder: Path, network: PolicyNetwork, sees: bool) -> None:
    """A policy must have been trained on what this version lets it observe, and move what this robot moves."""
    if card.kind == "navigation":
        wanted, actions = navigation_table(find_previous(card)), 2
    else:
        find_gait(card)
        sensed = network.observation_size == SENSED_TABLE.size
        table = SENSED_TABLE if sensed else locomotion_table(card.gait is not None)
        wanted, actions = table.describe(), 12
    if network.action_size != actions or (card.kind == "navigation" and not sees):
        name, given = card.network["class"], network.action_size
        raise InputError(
            f"{folder} is a {card.kind} policy, but its network {name} ({given} actions) is not one of a {card.kind} "
            f"policy ({actions} actions)"
        )
    for row, expected in zip(card.observation, wanted, strict=False):
        if any(row.get(key) != expected[key] for key in ("name", "size", "scale")):
            near = closest(row["name"], [known["name"] for known in wanted])
            raise InputError(
                f"{folder / CARD_FILE}: observation {row['name']!r} (size {row['size']}) is not what this version "
                f"fills there: {expected['name']!r} (size {expected['size']}, scale {expected['scale']}){near}"
            )
    if len(card.observation) != len(wanted):
        raise InputError(f"{folder / CARD_FILE}: observation has {len(card.observation)} rows, expected {len(wanted)}")


def _read_weights(path: Path) -> dict[str, Tensor]:
    if not path.is_file():
        raise InputError(f"{path.parent} is no policy folder: {WEIGHTS_FILE} is missing")
    try:
        return load_file(path)
    except (safetensors.SafetensorError, OSError, ValueError, KeyError) as error:
        raise InputError(f"{path} is broken or cut off ({error}); copy it again") from None


def _check_weights(network: torch.nn.Module, weights: dict[str, Tensor], folder: Path) -> None:
    expected = network.state_dict()
    for name in expected.keys() | weights.keys():
        if name not in weights:
            raise InputError(f"{folder}: the card's network needs weights {name!r}, {WEIGHTS_FILE} has none")
        if name not in expected:
            raise InputError(f"{folder}: {WEIGHTS_FILE} holds {name!r}, which the card's network does not have")
    for name, weight in weights.items():
        card_shape, file_shape = tuple(expected[name].shape), tuple(weight.shape)
        if card_shape != file_shape:
            raise InputError(
                f"{folder}: the card does not fit the weights: {name} is {card_shape} by {CARD_FILE} "
                f"and {file_shape} in {WEIGHTS_FILE}"
            )
        if not weight.isfinite().all():
            raise InputError(f"{folder}: weights {name!r} are not finite (NaN or infinite); train or export again")
