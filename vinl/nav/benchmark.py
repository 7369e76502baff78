"""How fast the navigation environment steps, images included, what its homes cost, and how much device memory a
training takes."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from vinl.config.loader import load_config
from vinl.nav.config import NavConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.home_builder import build_home
from vinl.nav.home_store import HomeStore
from vinl.nav.recurrent_model import build_actor
from vinl.nav.recurrent_ppo import build_storage
from vinl.policies.nav_actor import NavActor


def run_nav(
    num_envs: int | None = None,
    homes: int | None = None,
    seconds: float = 5.0,
    device: str = "cpu",
    config: NavConfig | None = None,
    tree: str | None = None,
) -> dict[str, Any]:
    """Step the environment with random actions, a depth image a step.

    Args:
        num_envs: robots in parallel; 4096 on a GPU and 32 on a CPU by default.
        homes: how many; 1000 on a GPU and 16 on a CPU by default.
        seconds: of measuring, after a warm-up.
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:0"``.
        config: defaults to ``nav/default``.
        tree: how ray trees are built, see ``HomeStore``.

    Returns:
        ``steps_per_second`` of all robots, ``blind_steps_per_second`` of the same without images,
        ``single_steps_per_second`` of ``gymnasium.make("vinl/Nav-v0")`` (CPU only) and ``single_steps_per_cpu_second``,
        the same for each second of processor time, which other programs hardly change; ``homes_per_second`` built (by
        all workers, distance fields included) and ``homes_per_cpu_second`` by one core; ``home_kilobytes`` of grids and
        triangles on the device for each home, ``device_gigabytes`` in use by all (GPU only), and what was measured.

    Raises:
        InputError: the device is not there.
    """
    on_gpu = device.startswith("cuda")
    num_envs = (4096 if on_gpu else 32) if num_envs is None else num_envs
    homes = (1000 if on_gpu else 16) if homes is None else homes
    config = config or load_config(NavConfig, "nav/default")
    config = replace(config, num_envs=num_envs, homes=replace(config.homes, count=homes))
    used = _device_bytes(device)
    begin = time.perf_counter()
    store = HomeStore.build(config, device, tree=tree)
    built = time.perf_counter() - begin
    camera = config.camera
    figures: dict[str, Any] = {
        "steps_per_second": _measure(NavEnvironment(config, store, device), seconds),
        "blind_steps_per_second": _measure(NavEnvironment(replace(config, camera=None), store, device), seconds / 2),
        **({} if on_gpu else _measure_single(config, store, seconds / 2)),
        "homes_per_second": (homes + len(store.reasons)) / built,
        "homes_per_cpu_second": _measure_building(config),
        "home_kilobytes": store.memory_bytes / homes / 1e3,
        "homes": homes,
        "dropped": len(store.reasons),
        "num_envs": num_envs,
        "image": "none" if camera is None else f"{camera.width} x {camera.height}",
        "device": torch.cuda.get_device_name(device) if on_gpu else "cpu",
    }
    if on_gpu:
        figures["device_gigabytes"] = (_device_bytes(device) - used) / 1e9
    return figures


def _measure(environment: NavEnvironment, seconds: float) -> float:
    """Steps of all robots in a second."""
    n, device = environment.num_envs, environment.device
    generator = torch.Generator().manual_seed(0)
    # mostly forward, turning slowly: robots get about instead of standing at walls
    actions = [(torch.randn(n, 2, generator=generator) * 0.5 + torch.tensor([0.4, 0.0])).to(device) for _ in range(8)]
    for k in range(5):
        environment.step(actions[k])
    environment.read_measures()
    count, start = 0, time.perf_counter()
    while (passed := time.perf_counter() - start) < seconds or not count:
        for k in range(24):  # as many as a roll-out: one wait for the device in 24 steps
            environment.step(actions[k % 8])
        environment.read_measures()
        count += 24
    return count * n / passed


def _measure_single(config: NavConfig, store: HomeStore, seconds: float) -> dict[str, float]:
    """One robot as gymnasium sees it, a depth image a step."""
    from vinl.nav.gym import NavEnv

    environment = NavEnv(config=replace(config, num_envs=1), store=store)
    environment.reset(seed=0)
    environment.action_space.seed(0)
    actions = [environment.action_space.sample() for _ in range(64)]
    count, start, used = 0, time.perf_counter(), time.process_time()
    while (passed := time.perf_counter() - start) < seconds or not count:
        for action in actions:
            _, _, reached, late, _ = environment.step(action)
            if reached or late:
                environment.reset()
        count += len(actions)
    return {
        "single_steps_per_second": count / passed,
        "single_steps_per_cpu_second": count / (time.process_time() - used),
    }


def _measure_building(config: NavConfig, count: int = 24) -> float:
    """Homes in a second of one core, from their seeds, distance fields included."""
    build_home(0, config)  # compiles the kernels
    used = time.process_time()
    for seed in range(count):
        build_home(config.homes.seed + seed, config)
    return count / (time.process_time() - used)


def _device_bytes(device: str) -> int:
    """In use on the GPU, Warp's and torch's; 0 on a CPU."""
    if not device.startswith("cuda"):
        return 0
    free, total = torch.cuda.mem_get_info(device)
    return total - free


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
            depth, torch.rand(*shape, actor.input_size), actor.memory.initial_state(_TRIED_ROBOTS), fresh
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
