"""How fast the locomotion environment steps: robots x control steps per second, height scan and contacts included."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import jax
import numpy as np

from vinl.config.loader import load_config
from vinl.loco.config import LocoConfig
from vinl.loco.environment import LocoEnvironment


def run_loco(num_envs: int = 4096, seconds: float = 10.0, config: LocoConfig | None = None) -> dict[str, Any]:
    """Step the stage-1 environment with random actions on JAX's default device.

    Args:
        seconds: of measuring, after compilation and a warm-up.
        config: defaults to ``loco/rough``.

    Returns:
        ``steps_per_second`` (control steps of all robots), ``compile_seconds``, ``num_envs``, ``device``.
    """
    config = replace(config or load_config(LocoConfig, "loco/rough"), num_envs=num_envs)
    env = LocoEnvironment(config)
    rng = np.random.default_rng(0)
    actions = [jax.device_put(rng.normal(size=(num_envs, 12)).astype(np.float32), jax.devices()[0]) for _ in range(8)]
    start = time.perf_counter()
    result = jax.block_until_ready(env.step(actions[0]))
    compiled = time.perf_counter() - start
    for k in range(10):
        result = env.step(actions[k % 8])
    jax.block_until_ready(result)
    steps, start = 0, time.perf_counter()
    while (elapsed := time.perf_counter() - start) < seconds or steps == 0:
        for k in range(24):  # as many as a roll-out: one wait for the device in 24 steps
            result = env.step(actions[k % 8])
        jax.block_until_ready(result)
        steps += 24
    return {
        "num_envs": num_envs,
        "steps_per_second": steps * num_envs / elapsed,
        "compile_seconds": compiled,
        "device": str(jax.devices()[0].device_kind),
    }
