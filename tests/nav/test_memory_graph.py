"""What is recorded of a memory is its own loop; where no gradients are asked for, nothing is."""

import torch

from vinl.nav.memory_graph import MemoryGraph
from vinl.policies.depth_memory import DepthMemory


def test_minibatches_are_recorded_once_a_shape_and_roll_outs_are_not(monkeypatch) -> None:
    recorded = []

    def record(loop, sample):  # without a GPU
        recorded.append(sample)
        return loop

    monkeypatch.setattr(torch.cuda, "make_graphed_callables", record)
    torch.manual_seed(0)
    memory = DepthMemory("none", 1, 1, 4, 8, 6, 2)
    fresh = torch.rand(5, 3) < 0.3
    vector, start = torch.randn(5, 3, 4), memory.initial_state(3)
    wanted, state = memory(None, vector, start, fresh)
    memory.loop = MemoryGraph(memory)
    for _ in range(2):
        found, after = memory(None, vector, start, fresh)
        torch.testing.assert_close(found, wanted)
        torch.testing.assert_close(after, state)
    found.square().sum().backward()
    assert all(weight.grad is not None for weight in memory.cells.parameters())
    assert len(recorded) == 1
    with torch.no_grad():
        memory(None, vector[:1], start, fresh[:1])
    assert len(recorded) == 1
