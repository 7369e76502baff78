"""How much device memory a training of the navigation policy takes, from its configuration, without a device."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from vinl.nav.config import NavConfig
from vinl.nav.home_builder import build_home
from vinl.nav.home_store import HomeStore
from vinl.nav.recurrent_ppo import build_storage
from vinl.nav.warm_start import build_actor
from vinl.policies.nav_actor import NavActor

_TRIED_ROBOTS, _TRIED_STEPS, _TRIED_HOMES = 4, 2, 12

_BYTES_PER_WEIGHT = 16
"""Weight, gradient and two moments of Adam, float32 each."""

_TREE_BYTES = 80
"""A triangle's part in the ray tree: two nodes of two corners, 16 bytes each, and its place in the order."""

_FIXED_GB = 1.5
"""CUDA's context, cuDNN's workspaces and what the allocator leaves unused: a rule of thumb, not measured [GB]."""


def predict_memory(config: NavConfig) -> dict[str, float]:
    """Device memory of a training [GB].

    Args:
        config: of the training, on each device.

    Returns:
        ``rollout``: the buffers; ``weights``, with gradients and moments; ``activations``: what the forward pass of a
        minibatch keeps for the backward one, counted in eager mode with bfloat16 images on a CPU, so that a compiled
        network takes less; ``homes``: grids, triangles and ray trees; ``fixed``; and their sum ``total``.
    """
    actor = build_actor(config)
    gigabyte = 1e9
    parts = {
        "rollout": _count_rollout(config, actor) / gigabyte,
        "weights": _BYTES_PER_WEIGHT * sum(w.numel() for w in actor.parameters()) / gigabyte,
        "activations": _count_activations(actor)
        * config.num_envs
        * config.ppo.steps
        / config.ppo.minibatches
        / gigabyte,
        "homes": _count_homes(config) * config.homes.count / gigabyte,
        "fixed": _FIXED_GB,
    }
    return {**parts, "total": sum(parts.values())}


def _count_rollout(config: NavConfig, actor: NavActor) -> int:
    """Bytes of the roll-out's buffers, by their shapes alone."""
    storage = build_storage(config, actor, "meta")
    tensors = [value for value in vars(storage).values() if isinstance(value, Tensor)]
    return sum(tensor.nbytes for tensor in [*tensors, *storage.state])


def _count_activations(actor: NavActor) -> float:
    """Bytes that the forward pass of one image and one step of the memory keeps for the backward pass."""
    kept: dict[tuple[int, int], int] = {}
    weights = {weight.data_ptr() for weight in actor.parameters()}

    def keep(tensor: Tensor) -> Tensor:
        if tensor.untyped_storage().data_ptr() not in weights:
            kept[tensor.data_ptr(), tensor.nbytes] = tensor.nbytes
        return tensor

    def give(tensor: Any) -> Any:
        return tensor

    shape = _TRIED_STEPS, _TRIED_ROBOTS
    depth = None if actor.image is None else torch.rand(*shape, *actor.image).to(torch.bfloat16)
    fresh = torch.zeros(shape, dtype=torch.bool)
    with torch.autograd.graph.saved_tensors_hooks(keep, give), torch.autocast("cpu", torch.bfloat16):
        feature, _ = actor.look(
            depth, torch.rand(*shape, actor.observation_size), actor.initial_state(_TRIED_ROBOTS), fresh
        )
        feature.sum()
    return sum(kept.values()) / (_TRIED_STEPS * _TRIED_ROBOTS)


def _count_homes(config: NavConfig) -> float:
    """Bytes of a home, on average over the first ones of the configuration."""
    local = replace(config, homes=replace(config.homes, plans=(), plans_share=0.0))
    built = [build_home(config.homes.seed + k, local) for k in range(_TRIED_HOMES)]
    homes = [home for home in built if not isinstance(home, str)]
    trees = _TREE_BYTES * sum(len(home.faces) for home in homes)
    return (HomeStore(homes).memory_bytes + trees) / len(homes)
