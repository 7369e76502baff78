"""Training of the locomotor: rsl-rl PPO on the MJX environment; stage 3 is handed on to ``student``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import jax
import torch

from vinl.config.errors import InputError
from vinl.config.loader import build_config, dump_config
from vinl.loco.config import LocoConfig, LocoPpoConfig
from vinl.loco.environment import LocoEnvironment
from vinl.loco.models import StepModel, training_names
from vinl.loco.runner import TrainingRunner
from vinl.loco.vec_env import LocoVecEnv
from vinl.loco.warm_start import load_warm_start
from vinl.policies.card import PolicyCard, describe_action, locomotion_card
from vinl.policies.io import save_policy
from vinl.policies.lineage import find_commit
from vinl.rl.parallel import Peers, join_peers, peer_folder
from vinl.rl.run_folder import CHECKPOINT, RunFolder

WARMUP_RATE = 1e-3
"""Learning rate while only the critic learns."""


def rsl_rl_settings(config: LocoConfig, peers: Peers | None = None) -> dict[str, Any]:
    """Our PPO settings under rsl-rl's names."""
    p = config.ppo
    return {
        "num_steps_per_env": p.steps,
        "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
        "actor": {
            "class_name": "vinl.loco.models:StepModel",
            "gait": asdict(config.gait),
            "hidden_dims": list(p.actor),
            "activation": "elu",
            "distribution_cfg": {"class_name": "vinl.loco.models:UncheckedGaussian", "init_std": p.init_std},
        },
        "critic": {"class_name": "MLPModel", "hidden_dims": list(p.critic), "activation": "elu"},
        "algorithm": {
            "class_name": "vinl.loco.fast_ppo:FastPPO",
            "graphs": p.update == "graphs",
            "peers": peers,
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
    save_every: float = 60.0,
    iterations: int | None = None,
    minutes: float | None = None,
) -> bool:
    """Train a locomotor, or go on with a run. Under torchrun, this is one of the processes.

    Args:
        config: of a new run; None resumes the run in ``folder``.
        device: ``"cpu"`` or ``"cuda"``. JAX simulates on the first GPU that the process sees: of several processes,
            each must see its own alone.
        save_every: seconds between checkpoints.
        iterations: updates in all; defaults to the configuration's.
        minutes: after which the training is over too; settings that move over the training keep to them.

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
    peers, device = join_peers(device)
    own = config.separate(peers.rank, peers.count)
    if config.stage == 3:
        from vinl.loco.student import train_student  # Warp is started for stage 3 alone

        return train_student(config, run, resume, device, save_every, iterations, minutes)
    begun = resume and (run.path / CHECKPOINT).exists()
    start = load_warm_start(config.from_policy, config) if config.from_policy and not begun else None
    if not resume and peers.leads:
        run.create(dump_config(config))
    if start is not None and peers.leads:
        run.write_origin(asdict(start.origin))
    origin = run.read_origin()
    torch.manual_seed(own.seed)
    torch.backends.cuda.matmul.allow_tf32 = True
    environment = LocoEnvironment(own)
    env = LocoVecEnv(environment, device)
    commit = find_commit()

    def export(model: StepModel, samples: int) -> None:
        if not peers.leads:
            return
        actor = model.export()
        card = make_card(run.path.name, config, actor.describe(), samples, commit, origin)
        save_policy(run.policy, actor, card)

    def schedule(algorithm: Any, fraction: float) -> None:
        teach_critic_first(algorithm, runner.current_learning_iteration, config.ppo)
        environment.set_rewards(config.anneal.rewards_at(fraction, config.rewards))
        environment.set_noise(config.randomisation.noise_at(fraction))
        environment.simulation.set_solid(fraction >= config.terrain.ghost)
        if config.anneal.entropy is not None:
            algorithm.entropy_coef = config.anneal.blend(fraction, config.ppo.entropy, config.anneal.entropy)
        highest = config.ppo.highest_rate(fraction)
        if highest is not None:
            algorithm.limit_rate(highest)

    settings, place = rsl_rl_settings(config, peers), peer_folder(run, peers)
    runner = TrainingRunner(peers, env, settings, place, device, export, describe_figures, schedule, save_every)
    if start is not None:
        runner.start_from(training_names(start.actor), start.critic)
    if resume:
        runner.resume()
    try:
        return runner.train(iterations or config.iterations, minutes)
    finally:
        peers.close()


def teach_critic_first(algorithm: Any, iteration: int, ppo: LocoPpoConfig) -> None:
    """Hold the actor still during ``critic_warmup`` and let it go afterwards; called before every iteration."""
    if not ppo.critic_warmup or iteration > ppo.critic_warmup:
        return
    warming = iteration < ppo.critic_warmup
    algorithm.get_policy().requires_grad_(not warming)
    # without a divergence to steer by, rsl-rl leaves the learning rate alone
    algorithm.desired_kl = None if warming else ppo.desired_kl
    algorithm.learning_rate = WARMUP_RATE if warming else ppo.learning_rate
    for group in algorithm.optimizer.param_groups:
        group["lr"] = algorithm.learning_rate


def make_card(
    name: str,
    config: LocoConfig,
    network: dict[str, Any],
    samples: int,
    commit: str,
    origin: dict[str, Any] | None = None,
) -> PolicyCard:
    """The card of a policy of this training; ``origin`` describes the policy that it started from."""
    action = describe_action(config.kp, config.kd)
    training = {**dump_config(config), **({"origin": origin} if origin else {})}
    learned = {"seed": config.seed, "samples": samples, "commit": commit}
    return locomotion_card(name, network, action, asdict(config.gait), training=training, **learned)
