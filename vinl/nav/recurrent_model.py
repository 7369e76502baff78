"""An actor with memory and a critic on the same feature, as PPO trains them; its roll-outs, of whole sequences with
images in two bytes or one; and what a training starts from: fresh weights, or those of an earlier run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

import torch
from jaxtyping import Bool, Float
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor, nn

from vinl.config.errors import InputError
from vinl.config.output import write_whole
from vinl.nav.config import NavConfig
from vinl.policies.card import PolicyCard
from vinl.policies.depth_memory import State
from vinl.policies.io import load_policy
from vinl.policies.nav_actor import PREVIOUS_SIZE, STEP_SIZE, NavActor
from vinl.policies.networks import PolicyNetwork


class MemoryActor(Protocol):
    """What a ``PolicyNetwork`` needs to be trained with a critic beside it; see ``NavActor``, which has it."""

    feature_size: int

    def look(self, depth: Any, vector: Any, state: State, fresh: Any) -> tuple[Any, State]: ...
    def choose(self, feature: Any) -> Any: ...


class Outlook(NamedTuple):
    """What the model makes of t steps.

    Attributes:
        mean: (t, n, a) of the actions.
        value: (t, n).
        state: the memory after the last step.
    """

    mean: Float[Tensor, "t n a"]
    value: Float[Tensor, "t n"]
    state: State


class RecurrentActorCritic(nn.Module):
    """Shared trunk and two heads: the actor's mean and the value. The actions' spread does not depend on the state.

    Args:
        actor: a ``MemoryActor``.
        log_std: logarithm of the actions' standard deviation at the start.
        log_std_range: it is held within these.
    """

    _log_std_range: Tensor

    def __init__(
        self,
        actor: PolicyNetwork,
        log_std: float = -0.5,
        log_std_range: tuple[float, float] = (-2.0, 0.2),
    ) -> None:
        super().__init__()
        self.actor = actor
        self.log_std = nn.Parameter(torch.full((actor.action_size,), float(log_std)))
        self.register_buffer("_log_std_range", torch.tensor(log_std_range, dtype=torch.float32), persistent=False)
        width = cast(MemoryActor, actor).feature_size
        value = nn.Linear(width, 1)
        self.value = nn.Sequential(value)
        nn.init.orthogonal_(value.weight)
        nn.init.zeros_(value.bias)

    def forward(
        self, depth: Tensor | None, vector: Float[Tensor, "t n k"], state: State, fresh: Bool[Tensor, "t n"]
    ) -> Outlook:
        """What is made of t steps; images in [0, 1] or as bytes."""
        actor = cast(MemoryActor, self.actor)
        images = None if depth is None else as_unit(depth)
        feature, state = actor.look(images, vector, state, fresh)
        feature = feature.float()
        with torch.autocast(feature.device.type, enabled=False):
            return Outlook(actor.choose(feature), self.value(feature)[..., 0], state)

    def actor_parameters(self) -> list[nn.Parameter]:
        """Those of the actor, the part shared with the critic included, and of its spread."""
        return [*self.actor.parameters(), self.log_std]

    @torch.no_grad()
    def hold_spread(self) -> None:
        """Keep the actions' spread within its range. A clamp inside ``forward`` would stop its gradient for good."""
        self.log_std.copy_(self.log_std.clamp(self._log_std_range[0], self._log_std_range[1]))

    def limit_spread(self, log_std_range: tuple[float, float]) -> None:
        """Move the limits of the actions' spread; they hold from the next step of the optimiser on."""
        self._log_std_range.copy_(torch.tensor(log_std_range, dtype=torch.float32))

    @property
    def output_std(self) -> Float[Tensor, " a"]:
        """Standard deviation of the actions."""
        return self.log_std.exp()


def as_unit(depth: Tensor) -> Tensor:
    """Stored images as numbers in [0, 1] of the type that the network computes in."""
    kind = depth.device.type
    wanted = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else torch.float32
    return depth.to(wanted) / 255.0 if depth.dtype == torch.uint8 else depth.to(wanted)


class Minibatch(NamedTuple):
    """All steps of some of the robots; arguments of the model first. Shapes (t, n, ...), the state (layers, n, ...)."""

    depth: Tensor | None
    vector: Tensor
    state: State
    fresh: Tensor
    actions: Tensor
    log_prob: Tensor
    means: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor


class RecurrentStorage:
    """Buffers that are written during the roll-out and never reallocated.

    Args:
        image: (height, width) of the images, or None.
        image_type: one of ``config.IMAGE_TYPES``.
        vector, actions: sizes.
        state: of the robots at the start; its shapes are taken.
    """

    def __init__(
        self,
        steps: int,
        robots: int,
        image: tuple[int, int] | None,
        image_type: str,
        vector: int,
        actions: int,
        state: State,
        device: torch.device | str,
    ) -> None:
        def room(*size: int, dtype: torch.dtype = torch.float32) -> Tensor:
            return torch.zeros(steps, robots, *size, dtype=dtype, device=device)

        self.steps, self.robots = steps, robots
        self.depth = room(*image, dtype=getattr(torch, image_type)) if image else None
        self.vector, self.actions, self.means = room(vector), room(actions), room(actions)
        self.fresh, self.done = room(dtype=torch.bool), room(dtype=torch.bool)
        self.log_prob, self.values, self.rewards = room(), room(), room()
        self.advantages, self.returns = room(), room()
        self.state = tuple(torch.zeros_like(part) for part in state)
        self.log_std = torch.zeros(actions, device=device)

    def as_stored(self, depth: Tensor) -> Tensor:
        """Images in [0, 1] as they are kept; the policy acts on these, so that it learns from what it saw."""
        assert self.depth is not None
        if self.depth.dtype == torch.uint8:
            return (depth * 255.0 + 0.5).to(torch.uint8)
        return depth.to(self.depth.dtype)

    def begin(self, state: State, log_std: Float[Tensor, " a"]) -> None:
        """A roll-out begins with this memory and this spread of the actions."""
        for part, now in zip(self.state, state, strict=True):
            part.copy_(now)
        self.log_std.copy_(log_std)

    def estimate_advantages(self, last_values: Float[Tensor, " n"], gamma: float, lam: float) -> None:
        """Generalised advantages and returns of the whole roll-out, not yet normalised."""
        going_on = (~self.done).float()
        advantage = torch.zeros_like(last_values)
        following = last_values
        for t in reversed(range(self.steps)):
            error = self.rewards[t] + gamma * going_on[t] * following - self.values[t]
            advantage = error + gamma * lam * going_on[t] * advantage
            self.advantages[t] = advantage
            following = self.values[t]
        torch.add(self.advantages, self.values, out=self.returns)

    def take(self, robots: Bool[Tensor, "..."] | Tensor) -> Minibatch:
        """All steps of the robots of an index (n,)."""

        def pick(buffer: Any) -> Any:
            if isinstance(buffer, tuple):
                return tuple(map(pick, buffer))
            return None if buffer is None else buffer.index_select(1, robots)

        return Minibatch(*(pick(getattr(self, name)) for name in Minibatch._fields))


CRITIC = "critic.safetensors"
"""File of a run beside its policy."""


def build_actor(config: NavConfig) -> NavActor:
    """A navigator with fresh weights."""
    camera = config.camera
    image: dict[str, Any] = {"vision": "none", "height": 1, "width": 1}
    if camera is not None:
        image = {"height": camera.height, "width": camera.width, "channels": 2 if camera.missing == "plane" else 1}
    previous = {"both": 2 * PREVIOUS_SIZE, "step": PREVIOUS_SIZE + STEP_SIZE}.get(config.previous, PREVIOUS_SIZE)
    sizes = asdict(config.network)
    if sizes.pop("grid"):
        assert camera is not None  # held to by the config
        speeds = list(config.robot.velocity_range.forward_speed)
        sizes["grid"] = {"camera": camera.record().describe(), "forward_speed": speeds}
    return NavActor(**{**sizes, **image, "previous": previous})


def load_start(policy: str, config: NavConfig) -> tuple[dict[str, torch.Tensor], PolicyCard]:
    """Weights and card of a trained navigator to start from.

    Raises:
        InputError: it is no navigator, or has another network than the configuration.
    """
    loaded = load_policy(policy)
    with torch.device("meta"):
        wanted = build_actor(config).describe()
    if not isinstance(loaded.network, NavActor):
        raise InputError(f"--from {policy}: a {loaded.card.kind} policy; give a navigator")
    given = loaded.network.describe()
    if given != wanted:
        other = [f"{k} {given.get(k)} instead of {wanted[k]}" for k in wanted if given.get(k) != wanted[k]]
        raise InputError(f"--from {policy}: another network than the config's: {', '.join(other)}")
    return loaded.network.state_dict(), loaded.card


def save_critic(model: RecurrentActorCritic, folder: Path) -> None:
    """What a policy folder leaves away, for ``--from``: the critic, and the spread of the actions."""
    rest = {k: v.detach().cpu().contiguous() for k, v in model.state_dict().items() if not k.startswith("actor.")}
    with write_whole(folder / CRITIC) as file:
        file.write(save(rest))


def load_critic(model: RecurrentActorCritic, folder: Path) -> bool:
    """Take up what ``save_critic`` left in a run's folder, if there is such a file and it is of the same shape."""
    file = folder / CRITIC
    if not file.is_file():
        return False
    try:
        rest = load_file(file)
    except (SafetensorError, OSError) as error:
        raise InputError(f"{file} is broken ({error}); remove it to start with a fresh critic") from None
    own = {k: v for k, v in model.state_dict().items() if not k.startswith("actor.")}
    if {k: v.shape for k, v in rest.items()} != {k: v.shape for k, v in own.items()}:
        return False
    model.load_state_dict(rest, strict=False)
    return True
