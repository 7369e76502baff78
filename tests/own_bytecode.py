"""What vinl imports is read from the bytecode that it was installed with.

While jaxtyping runs a module of vinl, bytecode goes by a name of jaxtyping's own, for all that this module imports too:
SciPy, JAX and much of torch were compiled anew in each process of the tests, which took ten seconds.
"""

from __future__ import annotations

import functools
from importlib.machinery import SourceFileLoader
from types import CodeType
from unittest.mock import patch

from jaxtyping import _import_hook


def install() -> None:
    """Let ``jaxtyping.install_import_hook`` change the name while it reads a module, not while it runs it."""
    loader = _import_hook._JaxtypingLoader

    def get_code(self: SourceFileLoader, fullname: str) -> CodeType | None:
        named = functools.partial(_import_hook._optimized_cache_from_source, self._typechecker.get_hash())
        with patch("importlib._bootstrap_external.cache_from_source", named):
            return SourceFileLoader.get_code(self, fullname)

    loader.get_code = get_code
    loader.exec_module = SourceFileLoader.exec_module
