import pytest

from vinl.cli.plans import main
from vinl.config.errors import InputError
from vinl.world.readers import load_floorplan


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


def test_generate_writes_homes_that_are_read_again(tmp_path, capsys):
    out = tmp_path / "homes"
    assert main(["generate", "--count", "3", "--seed", "7", "--out", str(out), "--set", "area=[45,70]"]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["contact.png", *(f"home-{k}.json" for k in (7, 8, 9))]
    assert "3 homes" in capsys.readouterr().out
    assert main(["show", str(out / "home-8.json")]) == 0
    assert "home-8" in capsys.readouterr().out
    (out / "c.yaml").write_text("furniture_density: [0.0, 0.0]\n")
    argv = [
        "generate",
        "--count",
        "1",
        "--seed",
        "7",
        "--out",
        str(out),
        "--config",
        str(out / "c.yaml"),
        "--no-picture",
    ]
    assert main(argv) == 0
    assert '"furniture": []' in (out / "home-7.json").read_text()


def test_a_layout_has_sizes_of_its_own(tmp_path, capsys):
    assert main(["generate", "--layout", "office", "--count", "1", "--out", str(tmp_path), "--no-picture"]) == 0
    assert capsys.readouterr().out.startswith("1 home in ")
    assert load_floorplan(str(tmp_path / "home-0.json")).inside.sum() * 0.05**2 > 0.8 * 150.0


@pytest.mark.parametrize(
    "more",
    [
        ["--count", "0"],
        ["--seed", "-1"],
        ["--set", "aera=[45,70]"],
        ["--set", "area=[5,6]"],
        ["--layout", "castle"],
        ["--set", "layout=office"],
        ["--layout", "office", "--config", "homes.yaml"],
    ],
)
def test_bad_options_of_generate_are_explained(tmp_path, more):
    with pytest.raises(InputError):
        main(["generate", "--out", str(tmp_path), *more])
