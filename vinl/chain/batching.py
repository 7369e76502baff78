"""Networks asked in batches of safe sizes, so that no answer depends on who else is asked."""

from __future__ import annotations

import copy
import weakref
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.chain.navigators.base import Navigator
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.navigators.recovery import RecoveringNavigator
from vinl.policies.card import PolicyCard
from vinl.policies.depth_policy import DepthNetwork, DepthPolicy, State, read_ages
from vinl.policies.networks import PolicyNetwork
from vinl.policies.policy import LocomotionPolicy, Policy
from vinl.robot.cameras import Camera
from vinl.sensing.preparation import prepare_depth


class BatchedPolicy:
    """A shipped kind of policy that is asked for some of its robots, in calls of sizes that give the same bits.

    A call is filled up with copies of its first robot to the next of ``find_safe_sizes``. So the answer for a robot
    depends on that robot alone: not on how many others walk beside it, which of them live, or which worker has it. On a
    GPU all are asked in one call.

    Args:
        policy: its network is called directly; the policy's own memory stays untouched.

    Attributes:
        rows: numbers of the robots that are asked for, see ``ask_only``; None: all.
        dates_images: as the policy's.
    """

    def __init__(self, policy: DepthPolicy | LocomotionPolicy) -> None:
        self.card: PolicyCard = policy.card
        self.camera: Camera | None = policy.camera
        self.rows: Sequence[int] | None = None
        self._network = policy.network
        self._sees = isinstance(policy, DepthPolicy)
        self.dates_images = policy.dates_images
        self._device = policy.device
        self._state: State = ()
        self._fresh = torch.zeros(0, dtype=torch.bool)
        self._answers = np.zeros((0, self._network.action_size), np.float32)

    def reset(self, which: int | Bool[np.ndarray, " n"] | Bool[Tensor, " n"]) -> None:
        """Forget the past of all of n robots, or of those that a mask marks."""
        if not isinstance(which, int):
            self._fresh |= torch.as_tensor(which, device=self._device)
            return
        self._fresh = torch.ones(which, dtype=torch.bool, device=self._device)
        self._answers = np.zeros((which, self._network.action_size), np.float32)
        if self._sees:
            self._state = cast(DepthNetwork, self._network).initial_state(which, self._device)

    def act(
        self, observation: Float[np.ndarray, "n k"], depth: Any = None, age: Any = None
    ) -> Float[np.ndarray, "n actions"]:
        """Actions of the robots in ``rows``; the others keep their last ones.

        Args:
            observation: (n, k) scaled observations.
            depth: (n, height, width) [m], if the policy has a camera.
            age: (n,) of the images [s], see ``DepthPolicy.act``.
        """
        chosen = range(len(observation)) if self.rows is None else self.rows
        sizes = find_safe_sizes(self._network) if self._device.type == "cpu" else (max(len(chosen), 1),)
        inputs = torch.as_tensor(np.asarray(observation, np.float32), device=self._device)
        ages = read_ages(self, age, self._device)
        with torch.no_grad():
            first = 0
            for count, size in split_calls(len(chosen), sizes):
                asked = list(chosen[first : first + count])
                first += count
                some = torch.tensor(asked + asked[:1] * (size - len(asked)), device=self._device)
                answer = self._ask(inputs[some], depth, ages, some, len(asked))
                self._answers[asked] = answer[: len(asked)].cpu().numpy()
        return self._answers.copy()

    def _ask(self, inputs: Tensor, depth: Any, ages: tuple[Tensor, ...], some: Tensor, count: int) -> Tensor:
        """One call; the first ``count`` robots are those asked for."""
        if not self._sees:
            return self._network(inputs)
        if self.camera is None:
            image = torch.zeros(len(some), 1, 1, device=self._device)
        else:
            seen = torch.as_tensor(depth)[some.to(depth.device) if isinstance(depth, Tensor) else some]
            image = prepare_depth(self.camera, seen.to(self._device, torch.float32))
        state = tuple(part[:, some] for part in self._state)
        fresh, dated = self._fresh[some][None], (x[some][None] for x in ages)
        answer, state = self._network(image[None], inputs[None], state, fresh, *dated)
        real = some[:count]
        for part, new in zip(self._state, state, strict=True):
            part[:, real] = new[:, :count]
        self._fresh[real] = False
        return answer[0]


def is_steady(policy: Any) -> bool:
    """Whether ``BatchedPolicy`` can stand in for a policy: it is of a shipped kind, not of a class of one's own."""
    return type(policy) in (DepthPolicy, LocomotionPolicy)


def batch_policy(policy: Policy) -> Policy:
    """The policy in safe batches if it is of a shipped kind, otherwise as it is."""
    return BatchedPolicy(cast(DepthPolicy, policy)) if is_steady(policy) else policy


def batch_navigator(navigator: Navigator) -> Navigator:
    """The navigator, its policy in safe batches if it is a learned one of a shipped kind."""
    if isinstance(navigator, RecoveringNavigator):
        watched = copy.copy(navigator)
        watched.inner = batch_navigator(navigator.inner)
        return watched
    if not is_steady_navigator(navigator) or not isinstance(navigator, LearnedNavigator):
        return navigator
    seated = copy.copy(navigator)
    seated.policy = batch_policy(navigator.policy)
    return seated


def is_steady_navigator(navigator: Navigator) -> bool:
    """Whether a navigator's answer for a robot depends on that robot alone, as far as we know."""
    if isinstance(navigator, RecoveringNavigator):
        return is_steady_navigator(navigator.inner)
    if type(navigator) is LearnedNavigator:
        return is_steady(navigator.policy)
    return type(navigator) is OracleNavigator


def ask_only(rows: Sequence[int], *asked: Policy | Navigator) -> None:
    """Say which robots still live; policies that are asked for all robots at any time do not care."""
    for one in asked:
        one = one.inner if isinstance(one, RecoveringNavigator) else one
        policy = one.policy if isinstance(one, LearnedNavigator) else one
        if isinstance(policy, BatchedPolicy):
            policy.rows = rows


BATCH = 8
"""Robots in a call whose answers all others are held to: published figures were made with calls of this size."""

CANDIDATES = (4, 6, 8, 12, 16, 20, 24)
"""Sizes that are tried, ascending. Fewer than four rows go another way through the libraries."""

_ROWS = 24
"""Robots that the check makes up: each place of the largest call is tried."""

_found: weakref.WeakKeyDictionary[PolicyNetwork, dict[int, tuple[int, ...]]] = weakref.WeakKeyDictionary()


def find_safe_sizes(network: PolicyNetwork) -> tuple[int, ...]:
    """Sizes of calls, ascending, that give the same bits as calls of ``BATCH``; 1 alone where not even those do,
    because a robot's place in the call counts.

    Libraries choose by the number of rows how to add up, and choose otherwise on other machines, so it is tried: here,
    with these weights and as many threads as torch has now. Sums in another order differ in the last bits whatever the
    numbers are, so that made-up inputs show it. It takes some tenths of a second, once a process and network.
    """
    known = _found.setdefault(network, {})
    threads = torch.get_num_threads()
    if threads not in known:
        inputs = _make_inputs(network)
        wanted = _answer(network, inputs, BATCH)
        if all(_equal(_answer(network, inputs, BATCH, shift), wanted) for shift in range(1, BATCH)):
            others = (size for size in CANDIDATES if size != BATCH)
            equal = (size for size in others if _equal(_answer(network, inputs, size), wanted))
            known[threads] = tuple(sorted((BATCH, *equal)))
        else:  # here a robot's place in the call changes its bits: each is asked by itself
            known[threads] = (1,)
    return known[threads]


def split_calls(count: int, sizes: Sequence[int]) -> list[tuple[int, int]]:
    """Calls that ``count`` robots are asked for in: for each, how many they are and to how many they are filled up.

    Args:
        sizes: those that a call may have, ascending.
    """
    full, rest = divmod(count, sizes[-1])
    calls = [(sizes[-1], sizes[-1])] * full
    return [*calls, (rest, next(size for size in sizes if size >= rest))] if rest else calls


def _make_inputs(network: PolicyNetwork) -> tuple[Tensor, ...]:
    """Vectors, then images and states if the network takes them, of ``_ROWS`` robots: the same at any time. Torch's own
    random numbers stay as they are."""
    random = torch.Generator().manual_seed(0)
    vector = torch.randn(_ROWS, network.observation_size, generator=random)
    if not isinstance(network, DepthNetwork):
        return (vector,)
    image = torch.rand(_ROWS, *(network.image or (1, 1)), generator=random)
    state = [torch.randn(part.shape, generator=random) for part in network.initial_state(_ROWS)]
    return (vector, image, *state)


def _answer(network: PolicyNetwork, inputs: Sequence[Tensor], size: int, shift: int = 0) -> list[Tensor]:
    """Actions and states from calls of one size, one row a robot; the last call begins again with the first robots.
    With a ``shift`` the first call begins with another robot, so that each has another place in its call."""
    vector, *seen = inputs
    calls = []
    with torch.no_grad():
        for first in range(shift, _ROWS + shift, size):
            rows = torch.arange(first, first + size) % _ROWS
            if not seen:
                calls.append([network(vector[rows])])
                continue
            image, *state = seen
            before, fresh = tuple(part[:, rows] for part in state), (rows % 2 == 0)[None]  # some begin an episode
            # called as ``BatchedPolicy`` does, layout in memory included: it decides too how libraries add up
            answer, after = cast(Any, network)(image[rows][None], vector[rows][None], before, fresh)
            calls.append([answer[0], *(part.transpose(0, 1) for part in after)])
    return [torch.cat(parts)[:_ROWS].roll(shift, 0) for parts in zip(*calls, strict=True)]


def _equal(some: Sequence[Tensor], others: Sequence[Tensor]) -> bool:
    return all(torch.equal(a, b) for a, b in zip(some, others, strict=True))
