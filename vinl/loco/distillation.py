"""DAgger: the student drives, the teacher says at every step which code it would have read from the ground."""

from __future__ import annotations

from typing import Any

import torch
from jaxtyping import Float
from tensordict import TensorDict
from torch import Tensor, nn
from torch.nn import functional

from vinl.loco.student_config import DistillationConfig
from vinl.policies.depth_actor import DepthActor
from vinl.policies.networks import MapActor
from vinl.rl.stopwatch import Stopwatch
from vinl.robot.observation import PROPRIOCEPTION_SIZE


class Distillation:
    """A learner with the names that ``TrainingLoop`` calls.

    The roll-out keeps images, proprioception and the teacher's codes on the device. The update runs the student over
    them again, in windows of ``bptt`` steps that begin with the memory that the roll-out had there: to keep the
    roll-out's own graph would save one of four passes and take tens of times the memory.

    Args:
        student: its actor is overwritten with the teacher's and stays as it is.
        teacher: reads the exact height scan.
        config: of the learning.
        num_envs: robots.
        device: torch device.
        stopwatch: times ``network`` (of the roll-out) and ``update``.

    Attributes:
        learning_rate: of the next update.
        teacher_share: share of the robots that the teacher drives.
    """

    def __init__(
        self,
        student: DepthActor,
        teacher: MapActor,
        config: DistillationConfig,
        num_envs: int,
        device: str,
        stopwatch: Stopwatch,
    ) -> None:
        self.config, self.device, self._stopwatch = config, torch.device(device), stopwatch
        self.student = student.to(device)
        self.teacher = teacher.to(device).eval().requires_grad_(False)
        self.student.actor.load_state_dict(self.teacher.actor.state_dict())
        self.student.actor.requires_grad_(False)
        self._learned = [p for p in self.student.parameters() if p.requires_grad]
        self.learning_rate, self.teacher_share = config.rate_at(0.0), config.teacher_share
        self.optimizer = torch.optim.Adam(self._learned, lr=self.learning_rate, fused=self.device.type == "cuda")

        t, n = config.steps, num_envs
        self._vectors = torch.zeros(t, n, student.observation_size, device=device)
        self._labels = torch.zeros(t, n, student.code, device=device)
        self._fresh = torch.zeros(t, n, dtype=torch.bool, device=device)
        self._depth = torch.zeros(t, n, *(student.image or (1, 1)), dtype=torch.float16, device=device)
        self._state = student.initial_state(n, device)
        self._starts = [tuple(torch.zeros_like(x) for x in self._state) for _ in range(t // config.bptt)]
        self._begun = torch.ones(n, dtype=torch.bool, device=device)
        self._order = torch.arange(n, device=device) / n
        self._step = 0

    # ---- roll-out -------------------------------------------------------------------------------------------------

    def act(self, obs: TensorDict) -> Float[Tensor, "n 12"]:
        """The student's actions, and the teacher's for some robots in the beginning; keeps what was seen."""
        with self._stopwatch.part("network"):
            k, c = self._step, self.config
            vector, exact = obs["policy"][:, :PROPRIOCEPTION_SIZE], obs["critic"]
            if self.student.image is not None:
                self._depth[k].copy_(obs["depth"])
            self._vectors[k].copy_(vector)
            self._fresh[k].copy_(self._begun)
            if k % c.bptt == 0:
                for start, now in zip(self._starts[k // c.bptt], self._state, strict=True):
                    start.copy_(now)
            with self._reduced():
                code, self._state = self.student.encode(
                    self._depth[k : k + 1], self._vectors[k : k + 1], self._state, self._fresh[k : k + 1]
                )
            label = self.teacher.encoder(exact[:, PROPRIOCEPTION_SIZE:])
            self._labels[k].copy_(label)
            if self.teacher_share > 0:
                guided = self._order[:, None] < self.teacher_share
                code = torch.where(guided, label, code[0])[None]
            action = self.student.act(vector, code[0])
            return action + c.exploration * torch.randn_like(action) if c.exploration else action

    def process_env_step(self, obs: TensorDict, rewards: Tensor, dones: Tensor, extras: dict[str, Any]) -> None:
        """Remember whose episode begins with the next step."""
        self._begun.copy_(dones.bool())
        self._step += 1

    def compute_returns(self, obs: TensorDict) -> None:
        """The roll-out is complete."""
        self._step = 0

    # ---- update ---------------------------------------------------------------------------------------------------

    def update(self) -> dict[str, float]:
        """Gradient steps on all windows of the roll-out; mean losses and gradient norm. One wait for the device."""
        with self._stopwatch.part("update"):
            return self._update()

    def _update(self) -> dict[str, float]:
        c, n = self.config, self._labels.shape[1]
        for group in self.optimizer.param_groups:
            group["lr"] = self.learning_rate
        parts = min(c.minibatches, n)
        totals = torch.zeros(4, device=self.device)
        for _ in range(c.epochs):
            for robots in torch.randperm(n, device=self.device).chunk(parts):
                code_loss, action_loss, unexplained = self.losses(robots)
                loss = code_loss * c.code_weight if c.loss != "action" else action_loss * c.action_weight
                if c.loss == "both":
                    loss = loss + action_loss * c.action_weight
                self.optimizer.zero_grad(set_to_none=True)
                loss.backward()
                norm = nn.utils.clip_grad_norm_(self._learned, c.max_grad_norm)
                self.optimizer.step()
                totals += torch.stack([code_loss, action_loss, unexplained, norm]).detach()
        means = (totals / (c.epochs * parts)).tolist()
        losses = dict(zip(("code", "action", "unexplained", "gradient_norm"), means, strict=True))
        return {**losses, "teacher_share": self.teacher_share}

    def losses(self, robots: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Mean squared errors of the codes and of the actions for some robots' windows; the code's error as a share of
        the labels' variance."""
        windows = self.config.steps // self.config.bptt

        def cut(buffer: Tensor) -> Tensor:
            """(steps, robots, ...) to (bptt, windows * robots, ...): each window becomes a sequence of its own."""
            chosen = buffer[:, robots].unflatten(0, (windows, self.config.bptt))
            return chosen.transpose(0, 1).flatten(1, 2)

        vectors, labels = cut(self._vectors), cut(self._labels)
        state = tuple(torch.cat([start[:, robots] for start in part], 1) for part in zip(*self._starts, strict=True))
        with self._reduced():
            code, _ = self.student.encode(cut(self._depth), vectors, state, cut(self._fresh))
        code = code.float()  # autocast leaves it in bfloat16 on a GPU, and the labels are not
        code_loss = functional.mse_loss(code, labels)
        # the same noisy proprioception on both sides: the actions differ by what the codes say
        with torch.no_grad():
            wanted = self.student.act(vectors, labels)
        action_loss = functional.mse_loss(self.student.act(vectors, code), wanted)
        spread = labels.var((0, 1), correction=0).mean().clamp_min(1e-9)
        return code_loss, action_loss, code_loss.detach() / spread

    def _reduced(self) -> torch.autocast:
        """bfloat16 for the convolutions on a GPU."""
        on = self.config.bfloat16 and self.device.type == "cuda"
        return torch.autocast(self.device.type, torch.bfloat16, enabled=on)

    # ---- what the loop needs --------------------------------------------------------------------------------------

    def train_mode(self) -> None:
        """Nothing in the student behaves differently in training."""

    def get_policy(self) -> DepthActor:
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
