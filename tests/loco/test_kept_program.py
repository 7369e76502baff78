"""A program that was traced once is not traced again, and gives the same."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from vinl.loco.kept_program import KeptProgram


class Pair(NamedTuple):
    first: jax.Array
    second: jax.Array


@pytest.fixture
def folder(tmp_path):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path / "traced"
    jax.config.update("jax_compilation_cache_dir", before)


@pytest.fixture
def start():
    """``start(factor)``: the program of a new process, and how often it was traced."""

    def start(factor=2.0):
        traced = []

        def function(scale, pair):
            traced.append(1)
            return Pair(pair.second * scale["by"], pair.first * factor), pair.first.sum()

        outputs, reads = (Pair(*range(2)), 0), ("function", np.float32(factor))
        return KeptProgram(function, donated=(1,), outputs=outputs, reads=lambda: reads), traced

    return start


def run(program, n=3):
    scale, pair = {"by": np.float32(3.0)}, Pair(jnp.arange(n, dtype=jnp.float32), jnp.ones(n))
    swapped, total = program(scale, pair)
    assert np.array_equal(swapped.first, np.full(n, 3.0)) and total == n * (n - 1) / 2
    return swapped.second, pair


def test_the_next_process_does_not_trace(folder, start):
    first, second = start(), start()
    a, _ = run(first[0])
    b, given = run(second[0])
    assert first[1] and not second[1] and np.array_equal(a, b) and len(list(folder.iterdir())) == 1
    assert given.first.is_deleted() and given.second.is_deleted()


@pytest.mark.parametrize(("factor", "n"), [(5.0, 3), (2.0, 4)])
def test_what_it_reads_and_shapes_make_another_program(factor, n, folder, start):
    run(start()[0])
    program, traced = start(factor)
    assert np.array_equal(run(program, n)[0], factor * np.arange(n))
    assert traced and len(list(folder.iterdir())) == 2


def test_a_damaged_file_is_written_anew(folder, start):
    run(start()[0])
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    for damaged in (b"", whole[:100], whole[:-1] + b"x"):
        path.write_bytes(damaged)
        program, traced = start()
        run(program)
        assert traced
    program, traced = start()
    run(program)
    assert not traced


def test_without_a_folder_nothing_is_kept(folder, start):
    jax.config.update("jax_compilation_cache_dir", None)
    program, traced = start()
    run(program)
    assert traced and not folder.exists()


def test_a_folder_that_cannot_be_written_is_no_error(folder, start):
    folder.write_text("no folder")
    program, traced = start()
    run(program)
    assert traced
