"""An actor with memory and a critic on the same feature, as PPO trains them."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, cast

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.policies.depth_memory import State
from vinl.policies.networks import PolicyNetwork


class MemoryActor(Protocol):
    """What a ``PolicyNetwork`` needs to be trained with a critic beside it (``NavActor`` has it).

    Attributes:
        image: (height, width) of the depth image [pixels], or None if blind.
        feature_size: numbers in a feature.
    """

    image: tuple[int, int] | None
    feature_size: int
    observation_size: int
    action_size: int

    def initial_state(self, n: int, device: Any = None) -> State:
        """The memory of n robots that have seen nothing."""
        ...

    def look(self, depth: Any, vector: Any, state: State, fresh: Any) -> tuple[Any, State]:
        """Features (t, n, f) of t steps and the last state."""
        ...

    def choose(self, feature: Any) -> Any:
        """Mean actions (t, n, a)."""
        ...


class Outlook(NamedTuple):
    """What the model makes of t steps.

    Attributes:
        mean: (t, n, a) of the actions.
        value: (t, n).
        state: the memory after the last step.
        guess: (t, n, g) of what is hidden from the robots; g is 0 where nothing is to be guessed.
    """

    mean: Float[Tensor, "t n a"]
    value: Float[Tensor, "t n"]
    state: State
    guess: Float[Tensor, "t n g"]


class RecurrentActorCritic(nn.Module):
    """Shared trunk and heads: the actor's mean, the value, and guesses at what is hidden. The actions' spread does not
    depend on the state.

    Args:
        actor: a ``MemoryActor``.
        log_std: logarithm of the actions' standard deviation at the start.
        log_std_range: it is held within these.
        guesses: hidden numbers that the feature is to tell.
    """

    _log_std_range: Tensor

    def __init__(
        self,
        actor: PolicyNetwork,
        log_std: float = -0.5,
        log_std_range: tuple[float, float] = (-2.0, 0.2),
        guesses: int = 0,
    ) -> None:
        super().__init__()
        self.actor = actor
        self.log_std = nn.Parameter(torch.full((actor.action_size,), float(log_std)))
        self.register_buffer("_log_std_range", torch.tensor(log_std_range, dtype=torch.float32), persistent=False)
        width = cast(MemoryActor, actor).feature_size
        value = nn.Linear(width, 1)
        self.value = nn.Sequential(value)
        self.guess = nn.Linear(width, guesses) if guesses else None
        nn.init.orthogonal_(value.weight)
        nn.init.zeros_(value.bias)

    def forward(
        self,
        depth: Tensor | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> Outlook:
        """What is made of t steps; images in [0, 1] or as bytes."""
        actor = cast(MemoryActor, self.actor)
        feature, state = actor.look(as_unit(depth), vector, state, fresh)
        feature = feature.float()
        with torch.autocast(feature.device.type, enabled=False):
            guess = feature[..., :0] if self.guess is None else self.guess(feature)
            return Outlook(actor.choose(feature), self.value(feature)[..., 0], state, guess)

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


def as_unit(depth: Tensor | None) -> Tensor | None:
    """Stored images as numbers in [0, 1] of the type that the network computes in."""
    if depth is None:
        return None
    kind = depth.device.type
    wanted = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else torch.float32
    return depth.to(wanted) / 255.0 if depth.dtype == torch.uint8 else depth.to(wanted)
