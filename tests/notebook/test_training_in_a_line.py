"""``vinl.train``: where a run goes, what it refuses. Real trainings run in notebooks/training.ipynb."""

from pathlib import Path

import pytest

import vinl
import vinl.loco.training
import vinl.nav.training
from vinl.config.errors import InputError


def test_config_says_who_is_trained_and_where_to(monkeypatch: pytest.MonkeyPatch) -> None:
    done = []

    def pretend(config, folder: Path, device: str, **more) -> bool:
        folder.mkdir(parents=True)
        (folder / "metrics.jsonl").write_text('{"iteration": 1}\n')
        done.append((type(config).__name__, config.num_envs, str(folder), device))
        return True

    monkeypatch.setattr(vinl.loco.training, "train_locomotor", pretend)
    monkeypatch.setattr(vinl.nav.training, "train_navigator", pretend)
    runs = [vinl.train("loco/rough", ["num_envs=8"]), vinl.train("loco/rough"), vinl.train("nav/blind", out="here")]
    names, counts, folders, devices = zip(*done, strict=True)
    assert names == ("LocoConfig", "LocoConfig", "NavConfig") and set(devices) == {"cpu"} and counts[0] == 8
    assert folders == ("runs/rough", "runs/rough-2", "here")
    assert repr(runs[0]) == "Training(runs/rough: complete)"
    assert runs[0].complete and runs[0].metrics == [{"iteration": 1}]


def test_refusals() -> None:
    for config, words in (("rough", "neither"), ("loco/rouhg", "did you mean"), ("nav/nothing", "nothing")):
        with pytest.raises(InputError, match=words):
            vinl.train(config)
    for out, words in (("", "--out is empty"), ("/proc/foo", "nothing can be written there")):
        with pytest.raises(InputError, match=words):
            vinl.train("nav/default", ["num_envs=8", "iterations=1"], out=out)
    assert not Path("runs").exists()
