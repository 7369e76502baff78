"""The 2 Hz navigator. Empty so far: evaluations are driven by the oracle in ``vinl.evaluation``."""
