"""Straight over one block: where the feet go, drawn beside the block's profile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.robot import Walker, joint_targets
from vinl.chain.scene import build_scene
from vinl.chain.workers import one_thread
from vinl.courses.block_contacts import BlockReader, BlockTouches
from vinl.courses.grounds import Ground
from vinl.courses.herd import MAX_TILT
from vinl.courses.trial import sense_ground
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE, FOOT_RADIUS, LEGS
from vinl.robot.rotation import yaw_of
from vinl.world.blocks import Blocks
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.heightfield import BLOCK, flat_field, raise_boxes

DEPTH, ACROSS = 0.2, 0.8
"""The block to step over, along and across the way [m]: so wide, like two side by side, that no foot passes beside."""

BEGIN, END = -1.5, 1.1
"""The trunk starts and is done at about these places [m]; the middle of the block is the origin."""

CROSSINGS = 6
"""Robots that cross, from places up to half a stride apart: so many phases of the gait meet the block."""

_STRIDE, _PATIENCE = 0.3, 2.5
_COLOURS = ("#1f77b4", "#ff7f0e")


@dataclass(frozen=True, eq=False)
class Crossing:
    """One robot's way over the block.

    Attributes:
        qpos: (t, 19) at every control step.
        feet: (t, 4, 3) middles of the feet in the order of ``LEGS`` [m].
        foot_touches, leg_touches: (t, 4) which of them touched the block in the control step.
        done: whether it came across without a fall.
    """

    qpos: Float[np.ndarray, "t 19"]
    feet: Float[np.ndarray, "t 4 3"]
    foot_touches: Bool[np.ndarray, "t 4"]
    leg_touches: Bool[np.ndarray, "t 4"]
    done: bool


def cross_block(policy: Policy, height: float = 0.15, speed: float = 0.5, crossings: int = CROSSINGS) -> list[Crossing]:
    """Walk over a block of a height [m] at a speed [m/s], steered back to the middle as a navigator would."""
    block = Blocks(np.array([[0.0, 0.0, np.pi / 2, ACROSS, DEPTH, height]]))
    field = flat_field(GridFrame(-4.0, -4.0, 0.05, (161, 161)))
    raise_boxes(field, block.boxes(), BLOCK)
    action = policy.card.action
    model = build_scene(Boxes.empty(), block.boxes(), kp=float(action["kp"]), kd=float(action["kd"]))
    ground = Ground(model, field, np.zeros((1, 3)), np.array([-1]), ["step"], np.inf, 0.0, block, Boxes.empty())
    touches, walkers = BlockTouches.none(crossings), [Walker(model) for _ in range(crossings)]
    feet = [model.geom(f"{leg}_foot").id for leg in LEGS]
    for k, walker in enumerate(walkers):
        walker.contacts = BlockReader(model, walker.data, touches, k)
        walker.spawn(BEGIN - _STRIDE * k / crossings, 0.0, 0.0, DEFAULT_POSE)
    steps = round(_PATIENCE * (END - BEGIN) / speed / CONTROL_DT)
    actions, last, done = np.zeros((crossings, 12), np.float32), np.full(crossings, steps), np.zeros(crossings, bool)
    rows: list[tuple[np.ndarray, ...]] = []
    with one_thread():
        policy.reset(crossings)
        senses = sense_ground(policy, ground, crossings)
        for step in range(steps):
            qpos, qvel = np.stack([w.qpos for w in walkers]), np.stack([w.qvel for w in walkers])
            turn = np.clip(-1.5 * yaw_of(np, qpos[:, 3:7]) - 1.0 * qpos[:, 1], -0.5, 0.5)
            command = np.stack([np.full(crossings, speed), np.zeros(crossings), turn], 1)
            actions = senses.act(qpos, qvel, command, actions)
            for walker, target in zip(walkers, joint_targets(actions, policy.card), strict=True):
                walker.step(target)
            places = np.stack([w.data.geom_xpos[feet] for w in walkers])
            rows.append((np.stack([w.qpos for w in walkers]), places, touches.feet.copy(), touches.legs.copy()))
            for k, walker in enumerate(walkers):
                over, fallen = walker.qpos[0] > END, walker.has_fallen(MAX_TILT)
                if last[k] == steps and (over or fallen):
                    last[k], done[k] = step + 1, over and not fallen
            if (last <= step + 1).all():
                break
    columns = [np.stack(column, 1) for column in zip(*rows, strict=True)]
    return [
        Crossing(*(column[k, : last[k]] for column in columns), done=bool(done[k]))  # type: ignore[arg-type]
        for k in range(crossings)
    ]


def describe_steps(crossings: list[Crossing]) -> str:
    """How many crossings touched nothing, in one line."""
    clean = sum(way.done and not way.foot_touches.any() and not way.leg_touches.any() for way in crossings)
    feet, legs = (
        sum(int(touches.any(1).sum()) for touches in side)
        for side in ([way.foot_touches for way in crossings], [way.leg_touches for way in crossings])
    )
    fell = len(crossings) - sum(way.done for way in crossings)
    return (
        f"{clean} of {len(crossings)} crossings without a touch, {fell} not finished; control steps on the block: "
        f"feet {feet}, legs {legs}"
    )


def draw_steps(ways: Mapping[str, list[Crossing]], height: float, path: Path) -> None:
    """Height of the feet over the way, front and rear apart, one row of panels for each policy.

    A line is the lowest point of a foot: the first crossing strong, the others faint. Red: it touches the block.
    Where a foot passes beside the block there is no line.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(11, 2.6 * len(ways) + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(ways), 2, sharex=True, sharey=True, squeeze=False)
    for row, (name, crossings) in zip(panels, ways.items(), strict=True):
        for axes, pair, title in zip(row, ((0, 1), (2, 3)), ("front feet", "rear feet"), strict=True):
            axes.add_patch(Rectangle((-DEPTH / 2, 0), DEPTH, height, color="0.75"))
            for k, way in enumerate(crossings):
                for foot, colour in zip(pair, _COLOURS, strict=True):
                    x, z = way.feet[:, foot, 0], way.feet[:, foot, 2] - FOOT_RADIUS
                    z = np.where(np.abs(way.feet[:, foot, 1]) < ACROSS / 2 + FOOT_RADIUS, z, np.nan)
                    strength = {"linewidth": 1.8} if k == 0 else {"linewidth": 0.7, "alpha": 0.35}
                    axes.plot(x, z, color=colour, label=LEGS[foot] if k == 0 else None, **strength)
                    hit = way.foot_touches[:, foot]
                    axes.plot(x[hit], z[hit], "o", color="red", markersize=3)
            touched = sum(int(way.foot_touches[:, list(pair)].any(1).sum()) for way in crossings)
            axes.set_title(f"{name}, {title}: {touched} steps on the block in {len(crossings)} crossings", fontsize=10)
            axes.legend(frameon=False, loc="upper right")
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_xlim(-0.8, 0.8)
            axes.set_ylim(-0.02, max(0.45, height + 0.2))
        row[0].set_ylabel("lowest point of the foot [m]")
    for axes in panels[-1]:
        axes.set_xlabel("way from the middle of the block [m]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
