"""Networks for rsl-rl."""

from __future__ import annotations

from typing import Any

import torch
from rsl_rl.models import MLPModel
from rsl_rl.modules.distribution import GaussianDistribution
from tensordict import TensorDict
from torch import nn

from vinl.gait.observation import STEPPING_TABLE
from vinl.policies.networks import StepActor
from vinl.policies.symmetry import SymmetricMLP

_FIRST_WEIGHTS = 0.003
"""Standard deviation of the last layer's weights at the start."""


class UncheckedGaussian(GaussianDistribution):
    """rsl-rl's actions, drawn without waiting for the device: ``torch.normal``, which rsl-rl draws with, reads back
    whether every standard deviation is positive, at every control step and every minibatch, and cannot be recorded
    into a CUDA graph."""

    def sample(self) -> torch.Tensor:
        """Actions (n, 12)."""
        mean = self.mean.detach()
        return mean + self.std.detach() * torch.randn_like(mean)


class StepModel(MLPModel):
    """rsl-rl actor that is not given the height scan: proprioception and the rows of the gait go into the MLP.

    Args:
        gait: fields of the ``GaitConfig``, for the exported actor.
        rest: as for ``MLPModel``.
    """

    def __init__(self, *args: Any, gait: dict[str, Any], **rest: Any) -> None:
        self._gait = gait
        super().__init__(*args, **rest)
        last = self.mlp[-1]
        assert isinstance(last, nn.Linear)
        nn.init.normal_(last.weight, std=_FIRST_WEIGHTS)  # it begins by standing
        nn.init.zeros_(last.bias)
        self.mlp = SymmetricMLP(*self.mlp)

    def get_latent(self, obs: TensorDict, masks: Any = None, hidden_state: Any = None) -> torch.Tensor:
        """Everything before the height scan."""
        return super().get_latent(obs, masks, hidden_state)[..., : STEPPING_TABLE.size]

    def _get_latent_dim(self) -> int:
        return STEPPING_TABLE.size

    def export(self) -> StepActor:
        """The deterministic actor with the same weights, as policies are shipped."""
        *hidden, actions = [layer.out_features for layer in self.mlp if isinstance(layer, nn.Linear)]
        actor = StepActor(self._gait, hidden, actions)
        weights = {k: v for k, v in self.state_dict().items() if k.startswith("mlp.")}
        actor.load_state_dict({k.replace("mlp.", "actor.", 1): v for k, v in weights.items()})
        return actor


def training_names(weights: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """The weights of a shipped actor under the names of its model for training."""
    return {name.replace("actor.", "mlp.", 1): weight for name, weight in weights.items()}
