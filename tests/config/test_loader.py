"""Configs: files, inheritance, overrides typed by the dataclass, errors that help."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.config.loader import build_config, dump_config, find_config, load_config


@dataclass(frozen=True)
class Ppo:
    epochs: int = 5
    rate: float = 1e-3
    hidden: tuple[int, ...] = (512, 256)
    window: tuple[float, float] = (0.0, 1.0)
    schedule: Literal["adaptive", "fixed"] = "adaptive"

    def __post_init__(self) -> None:
        if self.epochs < 1:
            raise InputError(f"ppo.epochs must be at least 1, got {self.epochs}")


@dataclass(frozen=True)
class Run:
    name: str
    ppo: Ppo = field(default_factory=Ppo)
    weights: dict[str, float] = field(default_factory=dict)
    limit: float | None = None
    video: bool = False
    note: str | None = None


def write(name: str, text: str) -> str:
    Path(name).write_text(text)
    return name


def test_file_and_overrides():
    file = write("run.yaml", "name: first\nppo: {rate: 3e-4, hidden: [64, 32]}\nweights: {torque: -1e-5}\n")
    run = load_config(Run, file, ["ppo.epochs=3", "weights.height=2", "limit=1e3", "video=true", "ppo.window=0.5,2"])
    assert run == Run("first", Ppo(3, 3e-4, (64, 32), (0.5, 2.0)), {"torque": -1e-5, "height": 2.0}, 1000.0, True)
    assert isinstance(run.weights["height"], float)


def test_text_stays_text():
    file = write("run.yaml", "name: first")
    run = load_config(Run, file, ["name=3", "note=a=b", "limit=5"])
    assert (run.name, run.note) == ("3", "a=b")
    assert load_config(Run, file, ["note=null", "limit=None"]).note is None


def test_extends_holds_only_the_difference():
    write("base.yaml", "name: base\nppo: {epochs: 7, rate: 0.1}\nweights: {a: 1, b: 2}")
    write("middle.yaml", "extends: base\nppo: {rate: 0.2}")
    top = write("top.yaml", "extends: middle.yaml\nname: top\nweights: {b: 3}")
    assert load_config(Run, top) == Run("top", Ppo(7, 0.2), {"a": 1.0, "b": 3.0})


def test_shipped_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "loco").mkdir()
    write("loco/rough.yaml", "name: rough")
    write("loco/blind.yaml", "extends: loco/rough\nname: blind")
    monkeypatch.setattr("vinl.config.loader.configs_dir", lambda: tmp_path)
    assert load_config(Run, "loco/blind").name == "blind"
    with pytest.raises(
        InputError, match=r"unknown config 'loco/ruogh', did you mean 'loco/rough'\?; known: loco/blind"
    ):
        find_config("loco/ruogh")


def test_round_trip():
    run = Run("x", Ppo(2, 0.5, (1, 2), (0.0, 3.0)), {"a": 1.0}, limit=None)
    plain = dump_config(run)
    assert plain["ppo"]["hidden"] == [1, 2]
    assert build_config(Run, plain) == run


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_number_survives_as_an_override(value: float):
    assert build_config(Run, {"name": "x"}, [f"limit={value!r}"]).limit == value


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: x\nppo:\n  epochs: [1\n", r"bad\.yaml, line \d, is not valid YAML"),
        ("name: x\nname: y\n", "line 2, is not valid YAML: 'name' stands twice"),
        ("name: x\nppo:\n\tepochs: 1\n", "line 3, is not valid YAML"),
        ("- a\n- b\n", "must hold keys and values .* got list"),
        ("just words", "must hold keys and values .* got str"),
        ("", r"bad\.yaml: name is missing; add it"),
        ("name: !!python/object/apply:os.system [ls]", "line 1, is not valid YAML"),
        (
            "name: x\nppo: {epoch: 3}",
            r"bad\.yaml: unknown key 'ppo\.epoch', did you mean 'epochs'\?; known: epochs, rate",
        ),
        ("name: x\nppo: {epochs: 2.5}", r"ppo\.epochs must be a whole number, got 2\.5"),
        ("name: x\nppo: {epochs: true}", r"ppo\.epochs must be a number, got True"),
        ("name: x\nppo: {hidden: 64}", r"ppo\.hidden must be tuple\[int, \.\.\.\], got 64"),
        ("name: x\nppo: {hidden: abc}", r"ppo\.hidden must be a list, got 'abc'"),
        ("name: x\nppo: {window: [1]}", r"ppo\.window must have 2 values, got 1"),
        ("name: x\nppo: {schedule: fast}", r"ppo\.schedule must be .*'adaptive'.* got 'fast'"),
        ("name: x\nppo: {epochs: 0}", r"ppo\.epochs must be at least 1, got 0"),
        ("name: x\nppo: 3", "ppo must be Ppo, got 3"),
        ("name: x\nweights: {a: heavy}", "weights must be .* got .*heavy"),
        ("extends: bad.yaml", "extends itself"),
        ("extends: nothing.yaml", r"nothing\.yaml does not exist; .* holds bad\.yaml"),
        ("extends: [a]", "extends must be the name of a config"),
    ],
)
def test_bad_files(text: str, message: str):
    write("bad.yaml", text)
    with pytest.raises(InputError, match=message) as caught:
        load_config(Run, "bad.yaml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("ppo.epochs", "not of the form"),
        ("=3", "not of the form"),
        ("ppo.rat=3", r"unknown key 'ppo\.rat', did you mean 'rate'"),
        ("ppo.rate.x=3", r"ppo\.rate holds a single value"),
        ("ppo=3", "ppo is a group of values"),
        ("ppo.epochs=[1", "has no readable value"),
        ("ppo.epochs=many", r"ppo\.epochs must be a whole number, got 'many'"),
    ],
)
def test_bad_overrides(override: str, message: str):
    with pytest.raises(InputError, match=message) as caught:
        build_config(Run, {"name": "x"}, [override])
    assert "\n" not in str(caught.value)


def test_missing_and_unreadable_files(tmp_path: Path):
    write("there.yaml", "")
    with pytest.raises(InputError, match=r"gone\.yaml does not exist; \. holds there\.yaml"):
        load_config(Run, "gone.yaml")
    with pytest.raises(InputError, match=r"there is no YAML file in nowhere"):
        load_config(Run, "nowhere/gone.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"binary\.yaml is not"):
        load_config(Run, "binary.yaml")
