"""The packages that only the export needs."""

from __future__ import annotations

from importlib.util import find_spec

from vinl.config.errors import InputError

PACKAGES = ("onnx", "onnxscript", "onnxruntime")
"""What ``vinl[export]`` installs: the format, torch's exporter to it, and the runtime that checks the file."""


def check_extra() -> None:
    """Refuse to begin where the extra is not installed.

    Raises:
        InputError: a package is missing; says how to install it.
    """
    missing = [name for name in PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(f'export needs {", ".join(missing)}; install it: pip install "vinl[export]"')
