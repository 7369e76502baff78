"""Training of the locomotor: rsl-rl PPO on the MJX environment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax
import torch

from vinl.config.errors import InputError
from vinl.config.loader import build_config, dump_config
from vinl.loco.config import LocoConfig
from vinl.loco.environment import LocoEnvironment
from vinl.loco.vec_env import LocoVecEnv
from vinl.policies.card import PolicyCard, describe_action, locomotion_card
from vinl.policies.commit import find_commit
from vinl.policies.io import save_policy
from vinl.rl.models import MapModel
from vinl.rl.run_folder import RunFolder
from vinl.rl.runner import TrainingRunner


def rsl_rl_settings(config: LocoConfig) -> dict[str, Any]:
    """Our PPO settings under rsl-rl's names."""
    p = config.ppo
    return {
        "num_steps_per_env": p.steps,
        "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
        "actor": {
            "class_name": "vinl.rl.models:MapModel",
            "hidden_dims": list(p.actor),
            "activation": "elu",
            "encoder": list(p.encoder),
            "code": p.code,
            "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": p.init_std},
        },
        "critic": {"class_name": "MLPModel", "hidden_dims": list(p.critic), "activation": "elu"},
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": p.epochs,
            "num_mini_batches": p.minibatches,
            "learning_rate": p.learning_rate,
            "desired_kl": p.desired_kl,
            "gamma": p.gamma,
            "lam": p.lam,
            "clip_param": p.clip,
            "entropy_coef": p.entropy,
            "value_loss_coef": p.value,
            "max_grad_norm": p.max_grad_norm,
        },
    }


def describe_figures(row: dict[str, float]) -> dict[str, str]:
    """What the progress bar shows."""
    return {
        "samples/s": f"{row['samples_per_second']:,.0f}",
        "level": f"{row['level']:.2f}",
        "reward": f"{row['reward']:.2f}",
        "tracking": f"{row['linear_tracking']:.2f}/{row['yaw_tracking']:.2f}",
        "falls/min": f"{row['falls_per_minute']:.2f}",
    }


def check_devices(device: str) -> None:
    """JAX and torch must run on the same kind of device.

    Raises:
        InputError: they do not.
    """
    jax_kind = "cuda" if jax.default_backend() == "gpu" else jax.default_backend()
    if jax_kind != device.split(":")[0]:
        raise InputError(f"--device {device}: JAX runs on {jax_kind} here; install jax[cuda13] or use --device cpu")


def train_locomotor(
    config: LocoConfig | None,
    folder: str | Path,
    device: str = "cpu",
    name: str = "",
    save_every: float = 60.0,
    iterations: int | None = None,
) -> bool:
    """Train a locomotor, or go on with a run.

    Args:
        config: of a new run; None resumes the run in ``folder``.
        folder: of the run.
        device: ``"cpu"`` or ``"cuda"``.
        name: of the policy; defaults to the folder's.
        save_every: seconds between checkpoints.
        iterations: updates in all; defaults to the configuration's.

    Returns:
        Whether the run is complete (an interrupt stops it earlier; both leave a checkpoint and a policy).

    Raises:
        InputError: the folder or a setting cannot be used.
    """
    check_devices(device)
    run = RunFolder(folder)
    resume = config is None
    if config is None:
        config = build_config(LocoConfig, run.open(), source=str(run.path / "config.yaml"))
    else:
        run.create(dump_config(config))
    torch.manual_seed(config.seed)
    torch.backends.cuda.matmul.allow_tf32 = True
    environment = LocoEnvironment(config)
    env = LocoVecEnv(environment, device)
    commit = find_commit()

    def export(model: MapModel, samples: int) -> None:
        actor = model.export()
        card = make_card(name or run.path.name, config, actor.describe(), samples, commit)
        save_policy(run.policy, actor, card)

    def schedule(algorithm: Any, share: float) -> None:
        environment.set_rewards(config.anneal.rewards_at(share, config.rewards))
        if config.anneal.entropy is not None:
            algorithm.entropy_coef = config.anneal.blend(share, config.ppo.entropy, config.anneal.entropy)

    runner = TrainingRunner(env, rsl_rl_settings(config), run, device, export, describe_figures, schedule, save_every)
    if resume:
        runner.resume()
    return runner.train(iterations or config.iterations)


def make_card(name: str, config: LocoConfig, network: dict[str, Any], samples: int, commit: str) -> PolicyCard:
    """The card of a policy of this training."""
    action = {**describe_action(), "kp": config.kp, "kd": config.kd}
    card = locomotion_card(
        name, network, training=dump_config(config), seed=config.seed, samples=samples, commit=commit
    )
    return PolicyCard(**{**vars(card), "action": action})
