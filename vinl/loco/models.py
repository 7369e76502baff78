"""Networks for rsl-rl."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from rsl_rl.models import MLPModel
from rsl_rl.modules.distribution import GaussianDistribution
from tensordict import TensorDict
from torch import nn

from vinl.policies.networks import MapActor, StepActor, mlp
from vinl.robot.observation import PROPRIOCEPTION_SIZE


class UncheckedGaussian(GaussianDistribution):
    """rsl-rl's actions, drawn without waiting for the device: ``torch.normal``, which rsl-rl draws with, reads back
    whether every standard deviation is positive, at every control step and every minibatch, and cannot be recorded
    into a CUDA graph."""

    def sample(self) -> torch.Tensor:
        """Actions (n, 12)."""
        mean = self.mean.detach()
        return mean + self.std.detach() * torch.randn_like(mean)


class MapModel(MLPModel):
    """rsl-rl actor that turns the height scan into a short code before the MLP [paper III-A]; the scan is all that it
    is given behind the proprioception.

    Args:
        proprioception: numbers before the height scan.
        encoder: widths of the encoder's hidden layers.
        code: size of the map code.
        rest: as for ``MLPModel``.
    """

    def __init__(
        self,
        *args: Any,
        proprioception: int = PROPRIOCEPTION_SIZE,
        encoder: Sequence[int] = (128, 64),
        code: int = 32,
        **rest: Any,
    ) -> None:
        self._front, self._code_size = proprioception, code
        super().__init__(*args, **rest)
        self._encoder_sizes = (self.obs_dim - proprioception, *encoder, code)
        self.encoder = mlp(self._encoder_sizes, nn.ReLU)

    def get_latent(self, obs: TensorDict, masks: Any = None, hidden_state: Any = None) -> torch.Tensor:
        """Proprioception and map code, (n, proprioception + code)."""
        full = super().get_latent(obs, masks, hidden_state)
        return torch.cat([full[..., : self._front], self.encoder(full[..., self._front :])], -1)

    def _get_latent_dim(self) -> int:
        return self._front + self._code_size

    def export(self) -> MapActor:
        """The deterministic actor with the same weights, as policies are shipped."""
        *hidden, actions = _widths(self)
        scan, *encoder, code = self._encoder_sizes
        actor = MapActor(self._front, scan, encoder, code, hidden, actions)
        actor.load_state_dict(_shipped_names(self))
        return actor


class StepModel(MLPModel):
    """rsl-rl actor that is not given the height scan: proprioception and the rows of the gait go into the MLP.

    Args:
        proprioception: numbers before the height scan.
        rest: as for ``MLPModel``.
    """

    def __init__(self, *args: Any, proprioception: int = PROPRIOCEPTION_SIZE, **rest: Any) -> None:
        self._front = proprioception
        super().__init__(*args, **rest)

    def get_latent(self, obs: TensorDict, masks: Any = None, hidden_state: Any = None) -> torch.Tensor:
        """Everything before the height scan."""
        return super().get_latent(obs, masks, hidden_state)[..., : self._front]

    def _get_latent_dim(self) -> int:
        return self._front

    def export(self) -> StepActor:
        """The deterministic actor with the same weights, as policies are shipped."""
        *hidden, actions = _widths(self)
        actor = StepActor(self._front, hidden, actions)
        actor.load_state_dict(_shipped_names(self))
        return actor


def training_names(weights: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """The weights of a shipped actor under the names of its model for training."""
    return {name.replace("actor.", "mlp.", 1): weight for name, weight in weights.items()}


def _shipped_names(model: nn.Module) -> dict[str, torch.Tensor]:
    weights = {k: v for k, v in model.state_dict().items() if k.startswith(("encoder.", "mlp."))}
    return {k.replace("mlp.", "actor.", 1): v for k, v in weights.items()}


def _widths(model: MLPModel) -> list[int]:
    """Outputs of the linear layers of the MLP."""
    return [layer.out_features for layer in model.mlp if isinstance(layer, nn.Linear)]
