"""``vinl eval --record`` keeps small files, and ``vinl play --replay`` scrubs through them."""

from pathlib import Path

import numpy as np
import pytest

import vinl
from vinl.benchmark.recordings import RECORDINGS, Recordings, find_recording, read_recording, write_recording
from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.viewer.replay import Replay
from vinl.viewer.session import OpenEpisode, Seek, Session, SetGoal


def test_recordings_are_small_and_hold_the_poses_of_the_walk(folder: Path):
    files = sorted((folder / RECORDINGS).iterdir())
    assert [file.name for file in files] == [f"harbour_flat_episode{k}_seed0.npz" for k in range(2)]
    assert max(file.stat().st_size for file in files) < 4000
    shelf = Recordings(folder)
    assert [label.split(",")[0] for label in shelf.labels] == ["0: harbour_flat", "1: harbour_flat"]
    plan, episode = shelf.open(1)
    walk = vinl.walk("harbour_flat", "rough", "oracle", "paper", 1, 0, vinl.EvaluationConfig(time_limit=1.2))
    assert plan.name == "harbour_flat" and episode.record.key == walk.record.key
    np.testing.assert_allclose(episode.trace.poses, walk.trace.poses, atol=2e-3)
    np.testing.assert_allclose(episode.trace.poses[:, :3], walk.trace.poses[:, :3], atol=1e-5)
    np.testing.assert_allclose(episode.trace.commands, walk.trace.commands, atol=1e-3)


def test_same_command_walks_only_what_has_no_recording(folder: Path, record_command: list[str]):
    path = find_recording(folder, ("harbour_flat", 0, 1))
    kept, other = path.read_bytes(), find_recording(folder, ("harbour_flat", 0, 0))
    path.unlink()
    before = other.stat().st_mtime_ns
    assert main([*record_command, str(folder)]) == 0
    assert path.read_bytes() == kept and other.stat().st_mtime_ns == before


def test_recording_plays_and_goes_to_any_time(folder: Path):
    shelf = Recordings(folder)
    _, episode = shelf.open(0)
    session = Session(Replay(shelf, 0))
    first = session.snapshot
    assert first.state == "recorded" and first.duration_s == pytest.approx((len(episode.trace.poses) - 1) * 0.04)
    np.testing.assert_array_equal(first.goal, episode.record.goal)
    played = session.advance(10)
    np.testing.assert_array_equal(played.qpos, episode.trace.poses[10])
    assert played.time_s == pytest.approx(0.4) and not np.array_equal(
        played.images["locomotion"].depth, first.images["locomotion"].depth
    )
    session.ask(Seek(0.2))
    there = session.advance(0)
    np.testing.assert_array_equal(there.qpos, episode.trace.poses[5])
    assert len(there.path) < len(played.path) and there.distance_m < played.distance_m
    end = session.advance(100)
    assert end.paused and end.time_s == pytest.approx(end.duration_s)
    session.ask(OpenEpisode(1))
    other = session.advance(0)
    assert other.time_s == 0 and other.notice[1].startswith("1: ")
    session.ask(SetGoal(0.0, 0.0))
    assert "this is a recording" in session.advance(0).notice[1]


def test_folder_without_recordings_says_how_to_make_them(folder: Path, record_command: list[str], tmp_path: Path):
    with pytest.raises(InputError, match="vinl eval --record wrote"):
        Recordings(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"run\.json is missing"):
        Recordings(tmp_path)
    bare = tmp_path / "bare"
    assert main([*[word for word in record_command if word != "--record"], str(bare)]) == 0
    with pytest.raises(InputError, match="no recordings; walk it again with vinl eval --record"):
        Recordings(bare)
    with pytest.raises(InputError, match="episodes 0 to 1"):
        Replay(Recordings(folder), 17)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 no archive", "cut"])
def test_broken_recording_is_told(folder: Path, tmp_path: Path, damage: bytes | str):
    _, episode = Recordings(folder).open(0)
    path = write_recording(tmp_path, episode)
    path.write_bytes(path.read_bytes()[:400] if damage == "cut" else damage)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="is broken; delete it"):
        read_recording(tmp_path, episode)
