"""A function as JAX traced it, kept beside XLA's compiled programs: the next process neither traces nor lowers it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax import export

from vinl.config.output import write_whole

_SHA = 32

_PACKAGE = Path(__file__).resolve().parents[1]

_config: Any = jax.config  # type checkers do not know its flags


class KeptProgram:
    """A function under ``jax.jit``, for arguments of one shape, that need not be traced where it was traced before.

    MJX takes seconds to trace. Where JAX keeps what it compiles (``jax_compilation_cache_dir``) the traced program is
    kept too, under a digest of all that it was made from: this package's code, the versions of the libraries, the
    device, ``reads``, and the shapes of the arguments.

    Args:
        function: of pytrees of arrays.
        donated: which arguments it may use up.
        outputs: a pytree of the structure that it returns.
        reads: tells what it reads beside its arguments: a pytree of arrays and of what has a ``repr``. Asked once,
            and only where programs are kept.
    """

    def __init__(
        self, function: Callable[..., Any], donated: tuple[int, ...], outputs: Any, reads: Callable[[], Any]
    ) -> None:
        self._function, self._donated, self._reads = function, donated, reads
        self._outputs = jax.tree.structure(outputs)
        self._program: Callable[..., Any] | None = None

    def __call__(self, *arguments: Any) -> Any:
        """What the function returns."""
        if self._program is None:
            self._program = self._open(arguments)
        return jax.tree.unflatten(self._outputs, self._program(*jax.tree.leaves(arguments)))

    def _open(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        leaves, tree = jax.tree.flatten(arguments)
        of = [at for at, argument in enumerate(arguments) for _ in jax.tree.leaves(argument)]
        donated = tuple(k for k, at in enumerate(of) if at in self._donated)

        def flat(*leaves: Any) -> list[Any]:
            return jax.tree.leaves(self._function(*jax.tree.unflatten(tree, leaves)))

        program = jax.jit(flat, donate_argnums=donated)
        folder = _config.jax_compilation_cache_dir
        if not folder:
            return program
        path = Path(folder) / "traced" / self._digest(leaves, tree)
        exported = _read(path)
        if exported is None:
            exported = export.export(program)(*leaves)
            _write(path, exported)
        return jax.jit(exported.call, donate_argnums=donated)

    def _digest(self, leaves: list[Any], tree: Any) -> str:
        device = jax.devices()[0]
        flags = _config.jax_default_matmul_precision, _config.jax_enable_x64
        versions = [version(name) for name in ("jax", "jaxlib", "mujoco", "mujoco-mjx", "numpy")]
        words = [versions, flags, device.platform, device.device_kind, str(tree), [repr(jax.typeof(x)) for x in leaves]]
        digest = hashlib.sha256(repr(words).encode())
        for file in sorted(_PACKAGE.rglob("*.py")):
            digest.update(file.read_bytes())
        for part in jax.tree.leaves(self._reads()):
            if isinstance(part, (np.ndarray, jax.Array)):
                part = np.asarray(part)
                digest.update(repr((part.shape, part.dtype)).encode() + part.tobytes())
            else:
                digest.update(repr(part).encode())
        return digest.hexdigest()


def _read(path: Path) -> export.Exported | None:
    """None: it is not there, or damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(data[_SHA:]).digest() != data[:_SHA]:
        return None
    return export.deserialize(bytearray(data[_SHA:]))


def _write(path: Path, exported: export.Exported) -> None:
    data = bytes(exported.serialize())
    with suppress(OSError), write_whole(path) as file:  # a full disk costs the next start some seconds, no more
        file.write(hashlib.sha256(data).digest() + data)
