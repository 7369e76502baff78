"""``vinl replay-nan``: look at a robot whose numbers went wrong in a training."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from vinl.cli.options import parse_options
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options:
    """Step a robot again from a state that a training saved (FOLDER/not_finite/NUMBER.npz), and tell what goes wrong.

    The action of the step that went wrong is held.
    """

    state: str
    """File that the training wrote."""
    simulator: str = "mjx"
    """mjx: the simulator of the training, on the CPU; mujoco: MuJoCo C with the same model and ground."""
    steps: int = 5
    """Control steps of 20 ms, four physics steps each."""
    video: str | None = None
    """Also write a film, .mp4 or .gif: one picture for each physics step, ten a second."""


def main(argv: list[str]) -> int:
    """Print what happens; 0 whether or not anything goes wrong."""
    options = parse_options(Options, argv, "replay-nan")
    if not 1 <= options.steps <= 500:
        raise InputError(f"--steps must lie between 1 and 500, got {options.steps}")
    video = None if options.video is None else Path(options.video)
    if video is not None and video.suffix not in (".mp4", ".gif"):
        raise InputError(f"--video {video} must end with .mp4 or .gif")
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    import numpy as np

    from vinl.loco.replay import load_lost, replay
    from vinl.robot.aliengo import PHYSICS_DT

    state = load_lost(options.state)
    print(state.describe())
    played = replay(state, options.steps, options.simulator)
    print(f"again in {options.simulator}, physics steps of {PHYSICS_DT * 1000:.0f} ms:")
    print(f"{'ms':>5}  {'height [m]':>10}  {'joint speed':>11}  {'torque [N m]':>12}  {'acceleration':>12}")
    rows = list(zip(played.qpos, played.qvel, played.torque, played.acceleration, strict=True))
    for k, (qpos, qvel, torque, acceleration) in enumerate(rows):
        if k > _SHOWN and k < len(rows) - 1:
            continue
        fastest, strongest, hardest = (np.abs(x).max() for x in (qvel[6:], torque, acceleration))
        print(f"{k * PHYSICS_DT * 1000:5.0f}  {qpos[2]:10.3f}  {fastest:11.4g}  {strongest:12.4g}  {hardest:12.4g}")
    if played.wrong is None:
        print(
            f"nothing went wrong in {(len(rows) - 1) * PHYSICS_DT:.3f} s: either rounding on this processor saves it, "
            "or the cause lies outside the physics"
        )
    else:
        row, what = played.wrong
        print(f"after {row * PHYSICS_DT * 1000:.0f} ms: {what}")
    if video is not None:
        from vinl.render.video import film_state

        if not np.isfinite(played.qpos[0]).all():
            raise InputError(f"{options.state}: the saved pose itself is not finite; there is nothing to film")
        texts = [f"{k * PHYSICS_DT * 1000:.0f} ms" for k in range(len(rows))]
        if played.wrong is not None:
            texts = [t if k < played.wrong[0] else f"{t}: {played.wrong[1]}" for k, t in enumerate(texts)]
        film_state(played.qpos, texts, played.field, video)
        print(f"film: {video}")
    return 0


_SHOWN = 20
"""Rows that are printed from the start; the last one always is."""
