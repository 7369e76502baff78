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

from vinl.gait.local_map import POINTS
from vinl.gait.observation import SENSED_TABLE
from vinl.gait.state import GaitState
from vinl.loco.student_config import DistillationConfig
from vinl.policies.networks import StepActor
from vinl.policies.stepping_actor import Memory, Prediction, SteppingActor
from vinl.rl.step_graph import StepGraph
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
        on_gpu = self.device.type == "cuda"
        self._rate = torch.tensor(self.learning_rate, device=device)
        self.optimizer = torch.optim.Adam(self._learned, lr=self._rate, fused=on_gpu, capturable=on_gpu)

        t, n = config.steps, num_envs
        self._inputs = torch.zeros(t, n, student.vector_size, device=device)
        self._velocity = torch.zeros(t, n, 3, device=device)
        self._fresh = torch.zeros(t, n, dtype=torch.bool, device=device)
        self._state = student.initial_state(n, device)
        self._starts = [tuple(torch.zeros_like(x) for x in self._network_state()) for _ in range(t // config.bptt)]
        self._vector = torch.zeros(n, SENSED_TABLE.size, device=device)
        self._depth = torch.zeros(n, *(student.image or (0, 0)), dtype=torch.float16, device=device)
        self._age = torch.zeros(n, device=device)
        self._truth = Prediction(torch.zeros(n, 3, device=device), torch.zeros(n, len(POINTS), device=device))
        self._told = torch.zeros(n, 1, dtype=torch.bool, device=device)
        self._action = torch.zeros(n, student.action_size, device=device)
        self._begun = torch.ones(n, dtype=torch.bool, device=device)
        self._order, self._steps = torch.arange(n, device=device)[:, None] / n, torch.arange(t, device=device)
        # squared errors of the maps, squares of the heights, squared errors of the velocity that robots walk by
        self._beliefs = torch.zeros(3, device=device)
        self._step = 0
        self._parts, self._totals = min(config.minibatches, n), torch.zeros(2, device=device)
        self._graph = StepGraph(self._walk) if on_gpu else None
        # a graph wants minibatches that are all as large
        self._descent = StepGraph(self._descend) if on_gpu and n % self._parts == 0 else None

    def gait(self) -> GaitState:
        """The gait that the student keeps of every robot."""
        return self.student.unpack(self._state).gait

    # ---- roll-out -------------------------------------------------------------------------------------------------

    def act(self, obs: TensorDict) -> Float[Tensor, "n 12"]:
        """The student's actions, good until the next call; keeps what was seen, and what was true.

        On a GPU the two thousand launches of a step are one CUDA graph, which reads and writes where they are.
        """
        with self._stopwatch.part("network"):
            self._vector.copy_(obs["policy"][:, _SENSED])
            for kept, name in (
                (self._depth, "depth"),
                (self._age, "age"),
                (self._truth.velocity, "velocity"),
                (self._truth.heights, "heights"),
            ):
                kept.copy_(obs[name])
            self._told.copy_(self._order < self.teacher_fraction)
            if self._step % self.config.bptt == 0:
                for start, now in zip(self._starts[self._step // self.config.bptt], self._network_state(), strict=True):
                    start.copy_(now)
            now = self._steps[self._step : self._step + 1]
            if self._graph is None:
                self._walk(now)
            else:
                self._graph.run(now)
            return self._action

    def _walk(self, step: Tensor) -> None:
        """One step of the roll-out; ``step`` (1,) is its number."""
        student, vector, truth, told = self.student, self._vector, self._truth, self._told
        stance = student.stance(vector)
        memory = student.begin(stance, student.unpack(self._state), self._begun)
        inputs = student.network_input(vector, stance, memory)
        for kept, now in ((self._inputs, inputs), (self._velocity, truth.velocity), (self._fresh, self._begun)):
            kept.index_copy_(0, step, now[None])
        said, network = student.estimate(inputs[None], memory.network, self._begun[None])
        velocity = torch.where(told, truth.velocity, student.believe(said[0], stance, memory))
        heights, map_ = student.survey(self._depth, stance, velocity, memory, self._age)
        wrong = ((a - b) ** 2 for a, b in ((heights, truth.heights), (velocity, truth.velocity)))
        missed, erred = (x.sum() for x in wrong)
        self._beliefs += torch.stack([missed, (truth.heights**2).sum(), erred])
        believed = Prediction(velocity, torch.where(told, truth.heights, heights))
        action, gait = student.walk(vector, stance, believed, memory)
        self._action.copy_(action)
        for kept, now in zip(self._state, student.pack(Memory(network, gait, velocity, map_)), strict=True):
            kept.copy_(now)

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
        n, epochs = self._velocity.shape[1], self.config.epochs
        self._rate.fill_(self.learning_rate)
        self._totals.zero_()
        for _ in range(epochs):
            for robots in torch.randperm(n, device=self.device).chunk(self._parts):
                if self._descent is None:
                    self._descend(robots)
                else:
                    self._descent.run(robots)
        velocity, norm = (self._totals / (epochs * self._parts)).tolist()
        missed, raised, erred = self._beliefs.tolist()
        self._beliefs.zero_()
        return {
            "velocity_rmse": velocity**0.5,
            "believed_rmse": (erred / self._velocity.numel()) ** 0.5,
            "map_error": missed / max(raised, 1e-9),
            "gradient_norm": norm,
            "teacher_share": self.teacher_fraction,
        }

    def _descend(self, robots: Tensor) -> None:
        """One step of the optimiser on some robots' windows."""
        loss = self.loss(robots)
        self.optimizer.zero_grad(set_to_none=True)
        (loss / VELOCITY_UNIT**2).backward()
        norm = nn.utils.clip_grad_norm_(self._learned, self.config.max_grad_norm)
        self.optimizer.step()
        self._totals += torch.stack([loss, norm]).detach()

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
        for group in self.optimizer.param_groups:
            group["lr"] = self._rate
        for kept, x in zip(self._state, loaded_dict["memory"], strict=True):
            kept.copy_(x)
        self._begun.copy_(loaded_dict["begun"])
