"""DAgger: the student walks by what it believes; at every step it is told how fast the robot was and what lay there.

What it learns are predictions: the velocity of the trunk, and the foothold plan or the heights of the ground about the
robot. Gait, planner and the teacher's actor behind them stay as they are.
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
"""An error of the velocity of this size weighs as much as one of the code of the size of its units [m/s]."""

_SENSED = slice(PROPRIOCEPTION.place("base_linear_velocity").stop, PROPRIOCEPTION_SIZE)
"""What the robot measures, in the environment's observation."""


class Distillation:
    """A learner with the names that ``TrainingLoop`` calls.

    The roll-out keeps images, what the network was given beside them, and the labels on the device. The update runs
    the network over them again, in windows of ``bptt`` steps that begin with the memory that the roll-out had there: to
    keep the roll-out's own graph would save one of four passes and take tens of times the memory.

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
        self._code = torch.zeros(t, n, student.code_size, device=device)
        self._fresh = torch.zeros(t, n, dtype=torch.bool, device=device)
        self._depth = torch.zeros(t, n, *(student.image or (1, 1)), dtype=torch.float16, device=device)
        self._state = student.initial_state(n, device)
        self._starts = [tuple(torch.zeros_like(x) for x in self._network_state()) for _ in range(t // config.bptt)]
        self._begun = torch.ones(n, dtype=torch.bool, device=device)
        self._order = torch.arange(n, device=device) / n
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
            truth = Prediction(obs["velocity"], obs["plan" if student.code == "plan" else "heights"])
            memory = student.begin(vector, student.unpack(self._state), self._begun)
            inputs = student.network_input(vector, memory)
            if student.image is not None:
                self._depth[k].copy_(obs["depth"])
            for kept, now in (
                (self._inputs, inputs), (self._velocity, truth.velocity), (self._code, truth.code),
                (self._fresh, self._begun),
            ):  # fmt: skip
                kept[k].copy_(now)
            if k % c.bptt == 0:
                for start, now in zip(self._starts[k // c.bptt], memory.network, strict=True):
                    start.copy_(now)
            with self._reduced():
                said, network = student.encode(
                    self._depth[k : k + 1], inputs[None], memory.network, self._fresh[k : k + 1]
                )
            believed = Prediction(said.velocity[0], said.code[0])
            if self.teacher_fraction > 0:
                told = self._order[:, None] < self.teacher_fraction
                believed = Prediction(*(torch.where(told, a, b) for a, b in zip(truth, believed, strict=True)))
            action, gait = student.walk(vector, believed, memory)
            self._state = student.pack(Memory(network, gait, believed.velocity))
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
        c, n = self.config, self._code.shape[1]
        for group in self.optimizer.param_groups:
            group["lr"] = self.learning_rate
        parts = min(c.minibatches, n)
        totals = torch.zeros(4, device=self.device)
        for _ in range(c.epochs):
            for robots in torch.randperm(n, device=self.device).chunk(parts):
                velocity_loss, code_loss, unexplained = self.losses(robots)
                loss = c.velocity_weight * velocity_loss / VELOCITY_UNIT**2 + c.code_weight * code_loss
                self.optimizer.zero_grad(set_to_none=True)
                loss.backward()
                norm = nn.utils.clip_grad_norm_(self._learned, c.max_grad_norm)
                self.optimizer.step()
                totals += torch.stack([velocity_loss, code_loss, unexplained, norm]).detach()
        velocity, code, unexplained, norm = (totals / (c.epochs * parts)).tolist()
        return {
            "velocity_rmse": velocity**0.5,
            "code": code,
            "unexplained": unexplained,
            "gradient_norm": norm,
            "teacher_share": self.teacher_fraction,
        }

    def losses(self, robots: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Of some robots' windows: mean squared errors of each component of the velocity [(m/s)^2] and of the code, in
        its units; the code's error as a fraction of the labels' variance."""
        windows = self.config.steps // self.config.bptt

        def cut(buffer: Tensor) -> Tensor:
            """(steps, robots, ...) to (bptt, windows * robots, ...): each window becomes a sequence of its own."""
            chosen = buffer[:, robots].unflatten(0, (windows, self.config.bptt))
            return chosen.transpose(0, 1).flatten(1, 2)

        state = tuple(torch.cat([start[:, robots] for start in part], 1) for part in zip(*self._starts, strict=True))
        with self._reduced():
            said, _ = self.student.encode(cut(self._depth), cut(self._inputs), state, cut(self._fresh))
        code, units = cut(self._code), self.student.units
        velocity_loss = functional.mse_loss(said.velocity, cut(self._velocity))
        code_loss = functional.mse_loss(said.code / units, code / units)
        spread = (code / units).var((0, 1), correction=0).mean().clamp_min(1e-9)
        return velocity_loss, code_loss, code_loss.detach() / spread

    def _reduced(self) -> torch.autocast:
        """bfloat16 for the convolutions on a GPU."""
        on = self.config.bfloat16 and self.device.type == "cuda"
        return torch.autocast(self.device.type, torch.bfloat16, enabled=on)

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
