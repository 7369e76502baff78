"""What a new user meets first: help, lists, mistakes, and where results go."""

import errno
import io
import json
import re
import resource
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from vinl.cli.app import COMMANDS, main
from vinl.cli.options import check_config, default_out
from vinl.cli.training import TrainingOptions
from vinl.config.errors import InputError
from vinl.config.paths import configs_dir
from vinl.courses.evaluate import TrialResults
from vinl.courses.report import _COLUMNS, print_comparison
from vinl.nav.training import describe_figures
from vinl.render.panels import write_film
from vinl.rl.loop import TrainingProgress
from vinl.rl.machine import explain_out_of_memory
from vinl.rl.run_folder import RunFolder

HELPS = [
    *([name] for name in COMMANDS if name not in ("plans", "bench")),
    *(["plans", what] for what in ("list", "show", "generate")),
    *(["bench", what] for what in ("loco", "nav", "depth")),
]


@pytest.mark.parametrize("command", HELPS, ids=" ".join)
def test_help_uses_plain_words(command: list[str], capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as end:
        main([*command, "--help"])
    said = capsys.readouterr().out
    assert not end.value.code and "usage: vinl" in said
    for jargon in ("{None}", "STR", "(default: )", "(default: None)", "``", "(default: False)", "(default: True)"):
        assert jargon not in said


def test_no_help_imports_what_is_slow() -> None:
    """Seconds are mostly torch: a command's options may not need it."""
    code = f"""
import sys, time
from vinl.cli.app import main
spent = {{}}
for command in {HELPS!r}:
    begun = time.process_time()
    try:
        main([*command, "--help"])
    except SystemExit:
        pass
    spent[" ".join(command)] = time.process_time() - begun
assert not {{"torch", "jax", "warp", "mujoco", "scipy"}} & set(sys.modules), sys.modules.keys()
assert max(spent.values()) < 0.5, spent
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


MISTAKES = {
    "eval --episodes x": "--episodes must be a whole number, got 'x'",
    "train-nav --iterations x": "--iterations must be a whole number, got 'x'",
    "bench nav --seconds x": "--seconds must be a number, got 'x'",
    "eval time_limit=abc": "time_limit=abc: time_limit must be a number, got 'abc'",
    "eval time_limit=-1": "time_limit=-1: time_limit must lie between",
    "eval tim_limit=1": "did you mean 'time_limit'",
    "eval --config loco/rough": "a config of locomotion, not of evaluation: use vinl train-loco",
    "eval harbour_flat": "'harbour_flat' is no setting (key=value), and a name stands behind its option",
    "eval-loco --terrain bar": "did you mean 'bars'?; known: flat, rough, blocks, litter, rooms, bars",
    "eval --floorplans harbor_flat": "did you mean 'harbour_flat'",
    "eval --floorplans=": "the name of a floor plan is empty; give a file or a shipped plan",
    "eval --out=": "--out is empty",
    "export loco --out=": "--out is empty; give the name of a file",
    "export --scene harbour_flat --out=": "--out is empty; give the name of a folder",
    "plans generate --count 1 --out=": "--out is empty; give the name of a folder",
    "plans show harbour_flat --out=": "--out is empty; give the name of a file",
    "report . --out=": "--out is empty",
    "train-loco --device cpu --num-envs 8 --iterations 1 --out=": "--out is empty",
    "train-nav --device cpu --num-envs 8 --iterations 1 --out=": "--out is empty",
    "train-nav --resume runs/mine --seed 0": "--resume goes on with the run's own config",
    "eval --out /proc/foo": "nothing can be written there",
    "bench memory --config loco/rough": "--config loco/rough is a config of locomotion, not of navigation",
    "train-loco --config nav/default": "use vinl train-nav --config nav/default",
    "train-nav --config loco/rough": "use vinl train-loco --config loco/rough",
    "train-loco --stage 2 --from vinl/nav": "nav is a navigation policy: use vinl train-nav",
    "train-loco --stage 2 --resume runs/rough": "--resume goes on with the run's own stage",
    "train-nav --from loco": "loco is a locomotion policy: use vinl train-loco",
    "train-loco --out /proc/foo": "nothing can be written there",
    "train-nav --out /proc/foo": "nothing can be written there",
    "train-nav --logger x": "'tensorboard', 'wandb'",
}


@pytest.mark.parametrize("words", MISTAKES, ids=lambda words: words.replace("/", "_"))
def test_mistakes_are_one_line(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split(" ")) == 2
    said = capsys.readouterr().err
    assert MISTAKES[words] in said and said.count("\n") == 1


def test_config_files_of_another_kind(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their keys tell, whatever they are called: a file may also be the config.yaml of a run."""
    loco, nav, noise = tmp_path / "loco.yaml", tmp_path / "config.yaml", tmp_path / "noise.yaml"
    shutil.copy(configs_dir() / "loco" / "rough.yaml", loco)
    nav.write_text("extends: nav/default\nseed: 2\n")
    noise.write_text("noise: 0.0\n")
    for words, said in (
        (f"train-nav --config {loco}", f"{loco} is a config of locomotion, not of navigation: use vinl train-loco"),
        (f"train-loco --config {nav}", f"{nav} is a config of navigation, not of locomotion: use vinl train-nav"),
        (f"eval --config {loco}", "is a config of locomotion, not of evaluation"),
        (f"eval --config {noise}", "is a config of depth cameras, not of evaluation"),
        (f"eval --config {tmp_path / 'none.yaml'}", "does not exist"),
    ):
        assert main(words.split()) == 2
        assert said in capsys.readouterr().err
    for text in ("time_limt: 3", "seed: 2", ""):  # a slip, a key that many have, none: its own errors are better
        nav.write_text(text)
        check_config(str(nav), "navigation")


def test_runs_of_the_other_kind_and_runs_that_are_done(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nav, loco = RunFolder(tmp_path / "nav"), RunFolder(tmp_path / "loco")
    nav.create({"homes": {}, "num_envs": 8})
    loco.create({"commands": {}, "num_envs": 8})
    loco.append_metrics({"iteration": 5})
    for words, said in (
        (f"train-loco --resume {nav.path}", f"is a navigation run: use vinl train-nav --resume {nav.path}"),
        (f"train-nav --resume {loco.path}", f"is a locomotion run: use vinl train-loco --resume {loco.path}"),
        (f"train-loco --resume {loco.path} --iterations 2", "already has 5 iterations"),
    ):
        assert main(words.split()) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize("name", ["picture.png", "plan.png"])
def test_a_huge_picture_is_too_large_not_damaged(name: str, tmp_path: Path, capsys) -> None:
    from PIL import Image

    size = (20_000, 20_000) if name == "picture.png" else (12_000, 9_000)
    Image.new("1", size).save(tmp_path / name)
    assert main(["plans", "show", str(tmp_path / name)]) == 2
    said = capsys.readouterr().err
    assert "too large: up to 49 million pixels" in said and "--resolution" in said


def test_where_results_go() -> None:
    assert default_out("eval", "loco", "nav") == Path("runs/eval-loco-nav")
    assert default_out("eval", "runs/mine/", "runs/other/policy") == Path("runs/eval-mine-other")


def test_policies_fit_a_screen(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["policies"]) == 0
    said = capsys.readouterr().out
    assert len(said.splitlines()) <= 40 and max(map(len, said.splitlines())) <= 90
    assert "depth 96 x 56" in said and "deg" in said and "success" in said
    for name in ("loco", "nav"):
        assert main(["policies", name]) == 0
        said = capsys.readouterr().out
        assert len(said.splitlines()) <= 45 and "deg down" in said
    assert "[m/s]" in said
    assert main(["policies", "loco", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "loco"


def test_training_bar_fits_80_columns() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=80, color_system=None, legacy_windows=False)
    figures = {"samples/s": "245,000", "level": "3.10", "reward": "12.30", "tracking": "0.93/0.88"}
    with TrainingProgress(1500, 0, console) as progress:
        time.sleep(0.12)
        progress.show(12, figures)
        time.sleep(0.12)
        progress.show(1234, figures)
    said = screen.getvalue()
    assert "compiling" in said
    last = [line for line in re.sub(r"\x1b\[[\d;?]*\w|\r", "\n", said).splitlines() if "1234/1500" in line][-1]
    assert len(last) <= 80 and "left" in last and "level 3.10" in last and "reward 12.30" in last
    assert "tracking" not in said


def test_piped_training_says_a_line_a_minute(monkeypatch) -> None:
    lines, clock = io.StringIO(), [1000.0]
    monkeypatch.setattr("vinl.rl.loop.time.monotonic", lambda: clock[0])
    with TrainingProgress(100, 0, Console(file=lines, width=80)) as progress:
        for k in range(1, 101):
            clock[0] += 10.0
            progress.show(k, {"level": f"{k}"})
    said = lines.getvalue().splitlines()
    assert said[0].startswith("compiling") and said[1].startswith("iteration 1/100")
    assert said[-1].startswith("iteration 100/100") and 17 <= len(said) <= 19


@pytest.mark.parametrize(
    "error",
    [
        RuntimeError("CUDA out of memory. Tried to allocate 20.00 GiB"),
        RuntimeError("RESOURCE_EXHAUSTED: Out of memory while trying to allocate"),
        MemoryError(),
    ],
)
def test_full_memory_names_the_setting(error: Exception) -> None:
    with pytest.raises(InputError, match=r"4096 robots do not fit .* --num-envs 2048"), explain_out_of_memory(4096):
        raise error
    with pytest.raises(RuntimeError, match="shapes"), explain_out_of_memory(4096):
        raise RuntimeError("shapes differ")


def test_a_checkpoint_that_does_not_fit_leaves_the_old_one(tmp_path: Path) -> None:
    import torch

    run = RunFolder(tmp_path)
    run.save_checkpoint({"iteration": 1})
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(OSError, match=r"checkpoint\.pt"):
            run.save_checkpoint({"iteration": 2, "weights": torch.zeros(100_000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [file.name for file in tmp_path.iterdir()] == ["checkpoint.pt"]
    assert run.load_checkpoint() == {"iteration": 1}


def test_wandb_reads_along(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[dict] = []
    monkeypatch.setitem(sys.modules, "wandb", SimpleNamespace(init=lambda **how: begun.append(how)))
    TrainingOptions(logger="wandb").start_logger("runs/mine")
    assert begun == [{"project": "vinl", "name": "mine", "dir": "runs/mine", "sync_tensorboard": True}]
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(InputError, match=r'pip install "vinl\[wandb\]"'):
        TrainingOptions(logger="wandb").start_logger("runs/mine")


def test_a_film_on_a_full_disk_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ffmpeg dies, of which Python hears that a pipe is broken."""

    def die(*_, **__):
        yield
        raise OSError("Broken pipe\n\nFFMPEG COMMAND ...")

    monkeypatch.setattr("imageio_ffmpeg.write_frames", die)
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=4096))
    with pytest.raises(OSError, match=r"No space left on device: .*film\.mp4") as full:
        write_film([np.zeros((16, 16, 3), np.uint8)], tmp_path / "film.mp4", 10.0)
    assert full.value.errno == errno.ENOSPC
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=2**30))
    with pytest.raises(OSError, match="Broken pipe"):
        write_film([np.zeros((16, 16, 3), np.uint8)], tmp_path / "film.mp4", 10.0)


def test_the_thread_that_writes_curves_prints_no_traceback_of_a_full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[object] = []
    monkeypatch.setattr(threading, "excepthook", lambda what: heard.append(what.exc_value))
    TrainingOptions().start_logger("run")

    def fail(error: Exception) -> None:
        raise error

    for error in (OSError(errno.ENOSPC, "No space left on device"), ValueError("another")):
        thread = threading.Thread(target=fail, args=[error])
        thread.start()
        thread.join()
    assert [type(error) for error in heard] == [ValueError]


@pytest.mark.slow
def test_full_disk_is_one_line(tmp_path: Path) -> None:
    """Files may not grow beyond 8 KB: the same error as on a full disk."""
    words = "eval --floorplans old_town --loco rough --nav oracle --episodes 1 --seeds 1 --workers 1 time_limit=0.5"
    code = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))\n"
    code += f"from vinl.cli.app import main; sys.exit(main({[*words.split(), '--out', str(tmp_path / 'run')]!r}))"
    done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True)
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    assert done.stderr.startswith("error: ") and "make room" in done.stderr


def test_progress_of_a_navigation_training_is_read_by_people() -> None:
    row = {"samples_per_second": 12.3, "samples": 32.0, "learning_rate": 0.00055, "success": 0.5}
    assert describe_figures(row) == {"samples/s": "12", "samples": "32", "success": "0.500", "rate": "0.00055"}
    assert describe_figures({**row, "samples": 2.5e6})["samples"] == "2.5 M"


def test_names_of_compared_policies_stay_whole_at_80_columns() -> None:
    names, figures = ("rough", "no_pretraining"), {key: 10.0 for key, _, _ in _COLUMNS}
    aggregate = {**figures, "falls": 0.1, "ci95": dict.fromkeys(figures, (0.0, 20.0))}
    results = TrialResults([], aggregate, {}, {"ground": {"terrain": "blocks"}}, 0.0)
    said = io.StringIO()
    print_comparison(Console(width=80, file=said), dict.fromkeys(names, results))
    assert " no_pretraining " in said.getvalue() and "CoT: cost of transport" in said.getvalue()
