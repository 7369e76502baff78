"""Training of the navigator: PPO with memory in the kinematic environment."""

from __future__ import annotations

import os
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.console import Console
from tensordict import TensorDict

from vinl.config.errors import InputError
from vinl.config.loader import build_config, dump_config
from vinl.nav.config import NavConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.home_store import HomeStore
from vinl.nav.recurrent_model import RecurrentActorCritic, build_actor, load_critic, load_start, save_critic
from vinl.nav.recurrent_ppo import RecurrentPPO, build_storage
from vinl.policies.card import PolicyCard, navigation_card
from vinl.policies.io import save_policy
from vinl.policies.lineage import find_commit, trace_lineage
from vinl.policies.nav_actor import NavActor
from vinl.rl.learning_rate import DeviceRate
from vinl.rl.parallel import PeerLoop, Peers, join_peers, peer_folder
from vinl.rl.run_folder import RunFolder
from vinl.world.homes.generate import RESERVED_FROM

_SEEDS_BETWEEN = 10_000_000
"""Each process has homes of its own: their seeds lie this far apart."""

_HOST_THREADS = 4
"""Threads of torch on the host beside a GPU. On 64 cores a training with as many threads used 15 cores while it copied
homes to the GPU, and several at once brought the machine to a stand."""

_RATE_DOWN, _RATE_UP = 1.5, 1.1
"""The adaptive learning rate moves by these once an update; rsl-rl's 1.5 both ways when it moves at each minibatch."""


class NavTrainingEnv:
    """Actions go in held to their range, observations come out as rsl-rl has them."""

    def __init__(self, environment: NavEnvironment) -> None:
        self.environment = environment
        self.num_envs = environment.num_envs

    def get_observations(self) -> TensorDict:
        """Of the present state."""
        depth, vector = self.environment.observe()
        return self._pack(depth, vector)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Actions (n, 2), held to [-1, 1], to observations, rewards (n,), dones (n,) and ``time_outs`` (n,)."""
        result = self.environment.step(actions.clamp(-1.0, 1.0))
        return self._pack(result.depth, result.vector), result.reward, result.done, {"time_outs": result.timeout}

    def read_measures(self) -> dict[str, float]:
        """Figures of the episodes that ended since the last call."""
        return self.environment.read_measures()

    def save_state(self) -> dict[str, Any]:
        """Of all robots."""
        return self.environment.save_state()

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from a saved state."""
        self.environment.load_state(state)

    def _pack(self, depth: torch.Tensor, vector: torch.Tensor) -> TensorDict:
        seen = {"vector": vector}
        if self.environment.camera is not None:
            seen["depth"] = depth
        return TensorDict(seen, batch_size=[len(vector)])


def train_navigator(
    config: NavConfig | None,
    folder: str | Path,
    device: str = "cpu",
    save_every: float = 60.0,
    iterations: int | None = None,
    minutes: float | None = None,
    from_policy: str | None = None,
    profile: bool = False,
    memory: float | None = None,
) -> bool:
    """Train a navigator, or go on with a run. Under torchrun, this is one of the processes.

    Args:
        config: of a new run; None resumes the run in ``folder``.
        device: ``"cpu"`` or ``"cuda"``.
        save_every: seconds between checkpoints.
        iterations: updates in all; defaults to the configuration's.
        minutes: after which the training is over too; settings that move over the training keep to them.
        from_policy: start from the weights of this policy or run, of a run from its critic and spread of the actions
            too; default: fresh ones.
        memory: torch takes at most so much of the GPU's memory [GB]; default: all of it.
        profile: write where the time of one iteration goes to ``profile.txt`` in the folder.

    Returns:
        Whether the run is complete (an interrupt stops it earlier; both leave a checkpoint and a policy).

    Raises:
        InputError: the folder or a setting cannot be used, or the GPU's memory is too small for it.
    """
    run = RunFolder(folder)
    resume = config is None
    if config is None:
        config = build_config(NavConfig, run.open(), source=str(run.path / "config.yaml"))
    robots, parts = config.num_envs, config.ppo.minibatches
    if robots % parts:
        raise InputError(f"num_envs must be a multiple of ppo.minibatches, got {robots} and {parts}")
    check_seeds(config, int(os.environ.get("WORLD_SIZE", "1")))
    peers, device = join_peers(device)
    origin = None
    start = load_start(from_policy, config) if from_policy else None
    if not resume and peers.leads:
        run.create(dump_config(config))
        if start is not None:
            known = {"policy": str(from_policy), "samples": start[1].samples}
            run.write_origin(origin := known | {"lineage": trace_lineage(start[1], start[0])})
    if resume:
        origin = run.read_origin()
    if device.startswith("cuda"):
        torch.set_num_threads(min(torch.get_num_threads(), _HOST_THREADS))
        torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = torch.backends.cudnn.benchmark = True
        if memory is not None:
            index = torch.device(device).index or 0
            total = torch.cuda.get_device_properties(index).total_memory
            torch.cuda.set_per_process_memory_fraction(min(memory * 1e9 / total, 1.0), index)
    torch.manual_seed(config.seed + peers.rank)
    own = separate(config, peers.rank, peers.count)
    environment = build_environment(own, device, peers)
    algorithm = build_algorithm(config, device, peers, None if start is None else start[0])
    if start is not None:
        load_critic(algorithm.model, Path(str(from_policy)))
        peers.share(algorithm.model)
    commit = find_commit()

    def write(model: RecurrentActorCritic, samples: int, folder: Path) -> None:
        assert isinstance(model.actor, NavActor)
        trained = replace(config, iterations=max(loop.current_learning_iteration, 1))  # so far, or when time was up
        save_policy(folder, model.actor, make_card(run.path.name, trained, samples, commit, origin))

    def export(model: RecurrentActorCritic, samples: int) -> None:
        if peers.leads:
            write(model, samples, run.policy)
            save_critic(model, run.path)

    def schedule(learner: RecurrentPPO, fraction: float) -> None:
        learner.rate.limit(*config.ppo.rate_limits(fraction))
        learner.entropy = config.ppo.entropy_at(fraction)
        if config.ppo.last_log_std is not None:
            learner.model.limit_spread(config.ppo.spread_at(fraction))
        done, warmup = loop.current_learning_iteration, config.ppo.critic_warmup
        learner.let_actor_learn(done >= warmup)
        if done == warmup > 0:  # it rose while the actor stood still
            learner.rate.set(config.ppo.learning_rate)
        for mark in config.ppo.keep_at:
            kept = run.path / "kept" / f"{mark / 1e6:g}M"
            if peers.leads and loop.samples >= mark and not kept.exists():
                write(learner.model, loop.samples, kept)

    loop = PeerLoop(
        peers,
        NavTrainingEnv(environment),
        algorithm,
        config.ppo.steps,
        peer_folder(run, peers),
        device,
        export,
        describe_figures,
        schedule,
        save_every,
        profile=profile,
    )
    if resume:
        loop.resume()
    try:
        return loop.train(iterations or config.iterations, minutes)
    except torch.OutOfMemoryError:
        raise InputError(
            f"the GPU's memory is too small for num_envs={config.num_envs}, ppo.minibatches={config.ppo.minibatches}; "
            "lower the first or raise the second (vinl bench memory predicts what they take)"
        ) from None
    finally:
        peers.close()


def describe_figures(row: dict[str, float]) -> dict[str, str]:
    """What the progress bar shows."""
    samples = row["samples"]
    said = f"{samples / 1e6:.1f} M" if samples >= 1_000_000 else f"{samples:,.0f}"
    shown = {"samples/s": f"{row['samples_per_second']:,.0f}", "samples": said}
    for key, digits in (("success", 3), ("spl", 3), ("collisions", 1)):
        if key in row:
            shown[key] = f"{row[key]:.{digits}f}"
    return {**shown, "rate": np.format_float_positional(row["learning_rate"], 2, fractional=False)}


def check_seeds(config: NavConfig, processes: int) -> None:
    """Homes of trainings and homes that judge have different seeds.

    Raises:
        InputError: a process would draw homes from seeds that are kept for judging.
    """
    if config.homes.seed + processes * _SEEDS_BETWEEN > RESERVED_FROM:
        raise InputError(
            f"homes.seed {config.homes.seed}: seeds from {RESERVED_FROM:,} on are kept for judging; choose one below "
            f"{RESERVED_FROM - processes * _SEEDS_BETWEEN:,}"
        )


def separate(config: NavConfig, rank: int, count: int = 1) -> NavConfig:
    """The configuration with a process's own homes and random numbers, and its fraction of the cores."""
    workers = config.homes.workers
    if workers is None and count > 1:
        workers = max((os.cpu_count() or 1) // count - 1, 1)
    homes = replace(config.homes, seed=config.homes.seed + rank * _SEEDS_BETWEEN, workers=workers)
    return replace(config, seed=config.seed + rank, homes=homes)


def build_environment(config: NavConfig, device: str, peers: Peers | None = None) -> NavEnvironment:
    """Homes and robots; a line on the terminal counts the homes."""
    console = Console(stderr=True)
    shown = console.status("building homes") if peers is None or peers.leads else nullcontext()
    with shown as status:

        def progress(done: int, total: int) -> None:
            if status is not None:
                status.update(f"building homes: {done} of {total}")

        homes = HomeStore.build(config, device, progress)
    environment = NavEnvironment(config, homes, device)
    environment.stagger()
    return environment


def build_algorithm(
    config: NavConfig, device: str, peers: Peers | None = None, weights: dict[str, torch.Tensor] | None = None
) -> RecurrentPPO:
    """Network, buffers and PPO as the configuration says.

    Args:
        weights: of the actor; default: fresh ones.
    """
    p = config.ppo
    actor = build_actor(config)
    if weights is not None:
        actor.load_state_dict(weights)
    model = RecurrentActorCritic(actor, p.log_std, p.log_std_range).to(device)
    rate = DeviceRate(p.learning_rate, *p.rate_limits(0.0), p.desired_kl, _RATE_DOWN, _RATE_UP, device)
    return RecurrentPPO(model, build_storage(config, actor, device), rate, p, peers)


def make_card(
    name: str, config: NavConfig, samples: int, commit: str, origin: dict[str, Any] | None = None
) -> PolicyCard:
    """The card of a navigator of this training; ``origin`` describes the policy that it started from."""
    with torch.device("meta"):
        network = build_actor(config).describe()
    training = {**dump_config(config), **({"origin": origin} if origin else {})}
    camera = config.camera.record().describe() if config.camera is not None else None
    return navigation_card(
        name,
        network,
        camera,
        config.previous,
        config.robot.max_speed,
        config.robot.max_yaw_rate,
        config.robot.min_speed,
        training=training,
        seed=config.seed,
        samples=samples,
        commit=commit,
    )
