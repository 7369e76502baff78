"""DAgger: the student walks by what it believes; at every step it is told how fast the robot was.

What it learns is to predict the velocity of the trunk. Its elevation map, planner and the teacher's actor follow from
that and stay as they are.
"""

from __future__ import annotations

from typing import Any

import torch
from jaxtyping import Float
from tensordict import TensorDict
from torch import Tensor, nn
from torch.nn import functional

from vinl.gait.state import GaitState
from vinl.loco.student_config import DistillationConfig
from vinl.policies.networks import StepActor
from vinl.policies.stepping_actor import Memory, Prediction, SteppingActor
from vinl.rl.stopwatch import Stopwatch
from vinl.robot.observation import PROPRIOCEPTION, PROPRIOCEPTION_SIZE

VELOCITY_UNIT = 0.2
"""Unit of the velocity's error in the loss [m/s]."""

_SENSED = slice(PROPRIOCEPTION.place("base_linear_velocity").stop, PROPRIOCEPTION_SIZE)
"""What the robot measures, in the environment's observation."""


class Distillation:
    """A learner with the names that ``TrainingLoop`` calls.

    The roll-out keeps what the estimator was given, and the labels, on the device. The update runs it over them again,
    in windows of ``bptt`` steps that begin with the memory that the roll-out had there.

    Args:
        student: its actor is overwritten with the teacher's and stays as it is.
        teacher: knows where its feet shall go.
        config: of the learning.
        num_envs: robots.
        device: torch device.
        stopwatch: times ``network`` (of the roll-out) and ``update``.

    Attributes:
        learning_rate: of the next update.
        teacher_fraction: fraction of the robots that are told the truth in place of what the network predicts.
    """

    def __init__(
        self,
        student: SteppingActor,
        teacher: StepActor,
        config: DistillationConfig,
        num_envs: int,
        device: str,
        stopwatch: Stopwatch,
    ) -> None:
        self.config, self.device, self._stopwatch = config, torch.device(device), stopwatch
        self.student = student.to(device)
        self.student.actor.load_state_dict(teacher.actor.state_dict())
        self.student.actor.requires_grad_(False)
        self._learned = [p for p in self.student.parameters() if p.requires_grad]
        self.learning_rate, self.teacher_fraction = config.rate_at(0.0), config.teacher_share
        self.optimizer = torch.optim.Adam(self._learned, lr=self.learning_rate, fused=self.device.type == "cuda")

        t, n = config.steps, num_envs
        self._inputs = torch.zeros(t, n, student.vector_size, device=device)
        self._velocity = torch.zeros(t, n, 3, device=device)
        self._fresh = torch.zeros(t, n, dtype=torch.bool, device=device)
        self._state = student.initial_state(n, device)
        self._starts = [tuple(torch.zeros_like(x) for x in self._network_state()) for _ in range(t // config.bptt)]
        self._begun = torch.ones(n, dtype=torch.bool, device=device)
        self._order = torch.arange(n, device=device) / n
        self._mapping = torch.zeros(2, device=device)  # squared errors of the maps, and squares of the heights
        self._step = 0

    def gait(self) -> GaitState:
        """The gait that the student keeps of every robot."""
        return self.student.unpack(self._state).gait

    # ---- roll-out -------------------------------------------------------------------------------------------------

    def act(self, obs: TensorDict) -> Float[Tensor, "n 12"]:
        """The student's actions; keeps what was seen, and what was true."""
        with self._stopwatch.part("network"):
            k, c, student = self._step, self.config, self.student
            vector = obs["policy"][:, _SENSED]
            truth = Prediction(obs["velocity"], obs["heights"])
            memory = student.begin(vector, student.unpack(self._state), self._begun)
            inputs = student.network_input(vector, memory)
            for kept, now in (
                (self._inputs, inputs), (self._velocity, truth.velocity), (self._fresh, self._begun),
            ):  # fmt: skip
                kept[k].copy_(now)
            if k % c.bptt == 0:
                for start, now in zip(self._starts[k // c.bptt], memory.network, strict=True):
                    start.copy_(now)
            said, network = student.estimate(inputs[None], memory.network, self._fresh[k : k + 1])
            told = self._order[:, None] < self.teacher_fraction
            velocity = torch.where(told, truth.velocity, said[0])
            heights, map_ = student.survey(obs["depth"], vector, velocity, memory)
            self._mapping += torch.stack([((heights - truth.heights) ** 2).sum(), (truth.heights**2).sum()])
            believed = Prediction(velocity, torch.where(told, truth.heights, heights))
            action, gait = student.walk(vector, believed, memory)
            self._state = student.pack(Memory(network, gait, velocity, map_))
            return action

    def process_env_step(self, obs: TensorDict, rewards: Tensor, dones: Tensor, extras: dict[str, Any]) -> None:
        """Remember whose episode begins with the next step."""
        self._begun.copy_(dones.bool())
        self._step += 1

    def compute_returns(self, obs: TensorDict) -> None:
        """The roll-out is complete."""
        self._step = 0

    def _network_state(self) -> tuple[Tensor, ...]:
        return self.student.unpack(self._state).network

    # ---- update ---------------------------------------------------------------------------------------------------

    def update(self) -> dict[str, float]:
        """Gradient steps on all windows of the roll-out; mean losses and gradient norm. One wait for the device."""
        with self._stopwatch.part("update"):
            return self._update()

    def _update(self) -> dict[str, float]:
        c, n = self.config, self._velocity.shape[1]
        for group in self.optimizer.param_groups:
            group["lr"] = self.learning_rate
        parts = min(c.minibatches, n)
        totals = torch.zeros(2, device=self.device)
        for _ in range(c.epochs):
            for robots in torch.randperm(n, device=self.device).chunk(parts):
                loss = self.loss(robots)
                self.optimizer.zero_grad(set_to_none=True)
                (loss / VELOCITY_UNIT**2).backward()
                norm = nn.utils.clip_grad_norm_(self._learned, c.max_grad_norm)
                self.optimizer.step()
                totals += torch.stack([loss, norm]).detach()
        velocity, norm = (totals / (c.epochs * parts)).tolist()
        missed, raised = self._mapping.tolist()
        self._mapping.zero_()
        return {
            "velocity_rmse": velocity**0.5,
            "map_error": missed / max(raised, 1e-9),
            "gradient_norm": norm,
            "teacher_share": self.teacher_fraction,
        }

    def loss(self, robots: Tensor) -> Tensor:
        """Mean squared error of each component of the velocity in some robots' windows [(m/s)^2]."""
        windows = self.config.steps // self.config.bptt

        def cut(buffer: Tensor) -> Tensor:
            """(steps, robots, ...) to (bptt, windows * robots, ...): each window becomes a sequence of its own."""
            chosen = buffer[:, robots].unflatten(0, (windows, self.config.bptt))
            return chosen.transpose(0, 1).flatten(1, 2)

        state = tuple(torch.cat([start[:, robots] for start in part], 1) for part in zip(*self._starts, strict=True))
        said, _ = self.student.estimate(cut(self._inputs), state, cut(self._fresh))
        return functional.mse_loss(said, cut(self._velocity))

    # ---- what the loop needs --------------------------------------------------------------------------------------

    def train_mode(self) -> None:
        """Nothing in the student behaves differently in training."""

    def get_policy(self) -> SteppingActor:
        """The student."""
        return self.student

    def save(self) -> dict[str, Any]:
        """Weights, optimiser and the robots' memory."""
        return {
            "student": self.student.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "memory": list(self._state),
            "begun": self._begun,
        }

    def load(self, loaded_dict: dict[str, Any], load_cfg: dict | None = None, strict: bool = True) -> None:
        """Go on from what ``save`` gave."""
        self.student.load_state_dict(loaded_dict["student"], strict=strict)
        self.optimizer.load_state_dict(loaded_dict["optimizer"])
        self._state = tuple(x.to(self.device) for x in loaded_dict["memory"])
        self._begun.copy_(loaded_dict["begun"])
