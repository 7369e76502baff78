"""Settings of a config may stand anywhere among the flags of a command."""

import pytest

from vinl.cli.options import parse_options, settings_first
from vinl.cli.train_nav import Options


@pytest.mark.parametrize(
    "argv",
    [
        ["ppo.epochs=3", "seed=2", "--out", "a=b", "--profile"],
        ["--out", "a=b", "ppo.epochs=3", "--profile", "seed=2"],
        ["ppo.epochs=3", "--profile", "seed=2", "--out=a=b"],
    ],
)
def test_settings_may_stand_anywhere(argv: list[str]):
    options = parse_options(Options, settings_first(Options, argv), "train-nav")
    assert options.overrides == ("ppo.epochs=3", "seed=2")
    assert options.out == "a=b" and options.profile
