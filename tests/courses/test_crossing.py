"""Bars across a corridor: what counts as clean, who came across, pictures."""

from dataclasses import replace
from pathlib import Path

import imageio.v2 as imageio
import mujoco
import numpy as np
import pytest

from vinl.courses import crossing_pictures
from vinl.courses.crossing import (
    APPROACH,
    SPREAD,
    WIDTH,
    BarConfig,
    CrossingRecord,
    CrossingTrace,
    build_corridor,
    cross_bar,
    draw_start,
    steer,
)
from vinl.courses.evaluate_crossings import aggregate_crossings, compare_crossings
from vinl.courses.trial import BoxHerd
from vinl.policies.io import load_policy
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.aliengo import CONTROL_DT, home_qpos
from vinl.world.grid import BLOCK, WALL

LOW = BarConfig(height=0.1, depth=0.2, speed=0.8, seed=0, kp=40.0, kd=2.0)


class GlidingHerd(BoxHerd):
    """Robots that glide along the corridor in the standing pose, lifted by so much, whatever their policy says."""

    lift = 0.0

    def step(self, targets, rows=None):
        for k in rows if rows is not None else range(len(self._robots)):
            body, reader = self._robots[k], self._readers[k]
            body.qpos[0] += 0.8 * CONTROL_DT
            body.qpos[2] = home_qpos()[2] + self.lift
            body.qpos[7:] = home_qpos()[7:]
            reader.clear()
            mujoco.mj_forward(body.model, body.data)
            reader.look()
            reader.sum_up()
            self._robots.read(k)


def glide(policy: LocomotionPolicy, monkeypatch: pytest.MonkeyPatch, lift: float, height: float = 0.1):
    monkeypatch.setattr(GlidingHerd, "lift", lift)
    monkeypatch.setattr("vinl.courses.crossing.BoxHerd", GlidingHerd)
    bar = replace(LOW, height=height)
    return cross_bar(policy, bar, build_corridor(bar), range(2))


def test_what_flies_over_is_clean_and_what_is_dragged_through_is_not(
    standing: LocomotionPolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    for flying in glide(standing, monkeypatch, lift=0.3):
        assert flying.record.finished and flying.record.touches == 0
    for dragged in glide(standing, monkeypatch, lift=0.0):
        record, trace = dragged.record, dragged.trace
        assert record.finished and record.foot_steps > 5 and record.leg_steps > 0 and record.trunk_steps == 0
        assert record.foot_steps == trace.feet.any(1).sum() and record.leg_steps == trace.legs.any(1).sum()
        front, rear = (trace.feet[:, pair].any(1).nonzero()[0] for pair in ([0, 1], [2, 3]))
        assert front.min() < rear.min()
        assert record.foot_pair_steps == [len(front), len(rear)]
    high = glide(standing, monkeypatch, lift=0.3, height=0.5)[0].record
    assert high.trunk_steps == 0 and high.foot_steps > 0
    figures = aggregate_crossings([flying.record, dragged.record])
    assert figures["clean_crossings"] == figures["clean_foot_crossings"] == 0.5
    assert figures["clean_trunk_crossings"] == 1.0
    low = glide(standing, monkeypatch, lift=0.0, height=0.5)[0].record
    assert low.trunk_steps > 0


def test_rough_comes_across_and_is_seen_to_touch() -> None:
    bar = replace(LOW, height=0.05)
    crossing = cross_bar(load_policy("rough"), bar, build_corridor(bar), [0])[0]
    record, trace = crossing.record, crossing.trace
    assert record.finished and not record.fell and record.foot_steps > 0
    assert trace.qpos[-1, 0] > bar.end and np.abs(trace.qpos[:, 1]).max() < 0.3
    assert record.metres == pytest.approx(record.start_m + bar.end, rel=0.1)
    assert record.gait.work_j > 0 and record.gait.steps == len(trace.qpos)


def test_who_does_not_come_across_has_no_clean_crossing(
    standing: LocomotionPolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vinl.courses.crossing.PATIENCE", 0.1)
    record = cross_bar(standing, LOW, build_corridor(LOW), [3])[0].record
    assert record.touches == 0 and not record.finished and not record.fell
    figures = aggregate_crossings([record])
    assert figures["finished"] == figures["clean_crossings"] == figures["clean_foot_crossings"] == figures["falls"] == 0


def test_a_fall_is_no_crossing(standing: LocomotionPolicy, monkeypatch: pytest.MonkeyPatch) -> None:
    limp = LocomotionPolicy(standing.network, replace(standing.card, action={**standing.card.action, "kp": 0.5}))
    bar = replace(LOW, kp=0.5, speed=1.5)
    crossing = cross_bar(limp, bar, build_corridor(bar), [0, 1])[0]
    assert crossing.record.fell and not crossing.record.finished
    assert len(crossing.trace.qpos) * CONTROL_DT == pytest.approx(crossing.record.time_s)


@pytest.mark.slow
def test_same_numbers_from_two_processes(trotting: LocomotionPolicy) -> None:
    one, two = (compare_crossings([trotting], [0.1], speed=1.5, crossings=17, workers=w)[0] for w in (1, 2))
    assert one.records == two.records and one.aggregate == two.aggregate
    assert [r.crossing for r in one.records] == list(range(17)) and not one.traces


def test_all_policies_meet_the_same_starts_at_every_height(
    standing: LocomotionPolicy, trotting: LocomotionPolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vinl.courses.crossing.PATIENCE", 0.1)
    both = compare_crossings([standing, trotting], [0.1, 0.2], crossings=2, traced=True)
    starts = [[(r.crossing, r.height, r.start_m) for r in one.records] for one in both]
    assert starts[0] == starts[1] and both[0].config == both[1].config
    assert starts[0][0][2] == starts[0][2][2]
    for one in both:
        assert {h: len(t) for h, t in one.traces.items()} == {0.1: 2, 0.2: 2}
        assert one.aggregate["crossings"] == 4 and one.aggregate["by_height"]["0.2"]["crossings"] == 2


def test_starts_are_spread_evenly_and_those_of_few_are_the_first_of_many() -> None:
    gaps = np.sort([-draw_start(LOW, k).x - LOW.depth / 2 - APPROACH for k in range(16)])
    assert gaps[0] >= 0 and gaps[-1] <= SPREAD
    assert np.diff(gaps).max() < 2 * SPREAD / 16
    assert draw_start(LOW, 3).y != draw_start(replace(LOW, seed=1), 3).y


def test_there_is_no_way_around() -> None:
    ground = build_corridor(LOW)
    y = np.linspace(-0.45, 0.45, 37)
    assert WIDTH == 1.0 and ground.on_block(np.stack([0 * y, y], 1)).all()
    row, column = ground.field.frame.cell(np.array([[-1.0, 0.55], [1.0, -0.55], [0.0, 0.0], [0.2, 0.0]])).T
    assert ground.field.labels[row, column].tolist() == [WALL, WALL, BLOCK, 0]
    walls = ground.walls.corners()
    assert walls[..., 0].min() < -2.3 and walls[..., 0].max() > LOW.end


def test_robots_are_steered_to_the_middle_by_yaw_rates_alone() -> None:
    qpos = np.stack([home_qpos(y=0.2), home_qpos(yaw=-0.2), home_qpos(y=-5.0)])
    commands = steer(qpos, 0.5)
    assert (commands[:, 0] == 0.5).all() and (commands[:, 1] == 0).all()
    assert commands[0, 2] < 0 < commands[1, 2] and commands[2, 2] == 0.5


def test_figures_of_known_records() -> None:
    records = [CrossingRecord(k, 0.1, 0.2, 1.5, finished=k < 3, metres=2.5, time_s=5.0) for k in range(4)]
    records[0].foot_steps, records[1].leg_steps, records[3].fell = 4, 2, True
    figures = aggregate_crossings(records)
    assert (figures["finished"], figures["falls"]) == (0.75, 0.25)
    assert (figures["clean_foot_crossings"], figures["clean_leg_crossings"]) == (0.5, 0.5)
    assert figures["clean_crossings"] == 0.25 and figures["speed"] == 0.5
    assert (figures["foot_steps_per_crossing"], figures["leg_steps_per_crossing"]) == (1.0, 0.5)
    assert figures["ci95"]["clean_foot_crossings"] == pytest.approx([0.150, 0.850], abs=0.001)
    assert set(figures["ci95"]) < set(figures)


@pytest.mark.parametrize("name", ["bar.mp4", "bar.gif"])
def test_pictures_are_written(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(crossing_pictures, "SIZE", (64, 32))
    qpos = np.stack([home_qpos(x) for x in np.linspace(-1.2, 1.2, 13)])
    touching = np.zeros((13, 4), bool)
    touching[6] = True
    traces = {name: CrossingTrace(qpos, touching, touching, touching[:, 0]) for name in "ab"}
    crossing_pictures.draw_feet(
        {name: [trace, trace] for name, trace in traces.items()}, 0.1, 0.2, Path("out/feet.png")
    )
    crossing_pictures.film_crossings(traces, 0.1, 0.2, Path("out") / name)
    assert sorted(p.name for p in Path("out").iterdir()) == sorted([name, "feet.png"])
    with imageio.get_reader(Path("out") / name) as film:
        assert film.get_data(0).shape[:2] == (64, 64)
