"""The 50 Hz locomotor: environment in MJX, training."""

import os

# torch and JAX share one GPU only when JAX does not take most of its memory at the start.
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
