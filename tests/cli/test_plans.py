import pytest

from vinl.cli.plans import main
from vinl.config.errors import InputError


def test_list_names_the_shipped_plans(capsys):
    assert main(["list"]) == 0
    assert "harbour_flat" in capsys.readouterr().out


def test_show_draws_a_plan(tmp_path, capsys):
    out = tmp_path / "loft.png"
    assert main(["show", "mill_loft", "--out", str(out), "--episodes", "1", "--obstacles", "paper"]) == 0
    text = capsys.readouterr().out
    assert out.exists() and "on foot" in text and str(out) in text


@pytest.mark.parametrize(
    "argv",
    [["show", "nowhere.png"], ["show", "mill_loft", "--obstacles", "most"], ["show", "mill_loft", "--seed", "-1"]],
)
def test_bad_options_are_explained(argv):
    with pytest.raises(InputError):
        main(argv)
