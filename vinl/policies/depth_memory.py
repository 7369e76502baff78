"""What student and navigator share: a depth image and a vector, with memory of the past, become a feature."""

from __future__ import annotations

from collections.abc import Callable

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.policies.networks import mlp
from vinl.policies.vision import ResNet18, SmallCnn, Vision

State = tuple[Tensor, ...]
"""Memory of n robots: hidden and cell state of an LSTM, (layers, n, hidden) each; empty without memory."""

VISIONS = ("cnn", "resnet18", "none")
MEMORIES = ("lstm", "mlp")


class DepthMemory(nn.Module):
    """A depth image and a vector, with memory of the past, to a feature.

    Under autocast only the images run in the reduced type; vector and memory stay float32, so that a state carried
    over thousands of steps does not lose digits.

    Args:
        vision: ``"cnn"`` (the paper's locomotion CNN), ``"resnet18"`` (the navigator's) or ``"none"`` (blind).
        height, width: of the images [pixels].
        vector: numbers beside the image.
        visual: numbers that the image becomes.
        hidden: width of the memory and size of the feature.
        memory: ``"lstm"``, or ``"mlp"``: as many ReLU layers of the same width, which remember nothing [paper IV-B].
        planes: channels of the ResNet's first stage.
        channels: of the images: 1, or 2 with one for the pixels that are marked as lost.

    Attributes:
        loop: does what ``remember`` does, faster, in a training; see ``vinl.nav.memory_graph``.

    Raises:
        ValueError: unknown ``vision`` or ``memory``.
    """

    loop: Callable[[Tensor, State, Tensor], tuple[Tensor, State]] | None = None

    def __init__(
        self,
        vision: str,
        height: int,
        width: int,
        vector: int,
        visual: int,
        hidden: int,
        layers: int,
        memory: str = "lstm",
        planes: int = 32,
        channels: int = 1,
    ) -> None:
        super().__init__()
        if vision not in VISIONS or memory not in MEMORIES:
            raise ValueError(f"vision is one of {VISIONS}, memory one of {MEMORIES}; got {vision!r} and {memory!r}")
        self.vision: Vision | None = None
        if vision == "cnn":
            self.vision = SmallCnn(height, width, visual, channels)
        elif vision == "resnet18":
            self.vision = ResNet18(height, width, visual, planes, channels)
        self.image = None if vision == "none" else (height, width)
        self.hidden, self.layers, self.remembers = hidden, layers, memory == "lstm"
        size = vector + (visual if self.vision is not None else 0)
        self.cells, self.mlp = nn.ModuleList(), nn.Sequential()
        if self.remembers:
            self.cells.extend(nn.LSTMCell(hidden if k else size, hidden) for k in range(layers))
            for name, weight in self.cells.named_parameters():
                nn.init.orthogonal_(weight) if "weight" in name else nn.init.zeros_(weight)
        else:
            self.mlp = nn.Sequential(*mlp([size] + [hidden] * layers, nn.ReLU), nn.ReLU())

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The state of n robots that remember nothing."""
        if not self.remembers:
            return ()
        return tuple(torch.zeros(self.layers, n, self.hidden, device=device) for _ in range(2))

    def spread_memory(self, steps: int) -> None:
        """Start the LSTM's cells so that they keep what they hold for 1 to ``steps`` steps, spread evenly over the
        cells: the biases of the forget gates are the logarithms of these times, those of the input gates the opposite
        [Tallec and Ollivier 2018]. With zero biases a cell forgets within two steps."""
        times = torch.linspace(1, max(steps - 1, 1), self.hidden)
        with torch.no_grad():
            for cell in self.cells:
                assert isinstance(cell, nn.LSTMCell)
                cell.bias_ih[: self.hidden] = -times.log()
                cell.bias_ih[self.hidden : 2 * self.hidden] = times.log()

    def forward(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n hidden"], State]:
        """Features of t steps in a row.

        Args:
            depth: (t, n, H, W) in [0, 1]; not looked at when blind.
            vector: (t, n, k).
            fresh: (t, n) an episode begins with this step: its state is zeroed before it.

        Returns:
            (t, n, hidden) float32 features, and the state after the last step.
        """
        t, n = fresh.shape
        x = vector.float()
        if self.vision is not None:
            assert depth is not None
            x = torch.cat([self.vision(depth.flatten(0, 1)).float().unflatten(0, (t, n)), x], -1)
        with torch.autocast(x.device.type, enabled=False):
            return (self.loop or self.remember)(x, state, fresh) if self.remembers else (self.mlp(x), state)

    def remember(self, x: Tensor, state: State, fresh: Tensor) -> tuple[Tensor, State]:
        """A loop over time: among thousands of robots some episode begins at nearly every step, so that cuDNN's fused
        sequences would be cut at each; next to the images the loop costs little."""
        keep = (~fresh).to(x.dtype)[..., None]
        hidden, cell = list(state[0].unbind(0)), list(state[1].unbind(0))
        features = []
        for now, kept in zip(x.unbind(0), keep.unbind(0), strict=True):
            for k, layer in enumerate(self.cells):
                hidden[k], cell[k] = layer(now, (hidden[k] * kept, cell[k] * kept))
                now = hidden[k]
            features.append(now)
        return torch.stack(features), (torch.stack(hidden), torch.stack(cell))
