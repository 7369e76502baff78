"""Tables in the terminal: what is left out of them where it is narrow."""

import io

from rich.console import Console

from vinl.render.drawing import open_table, print_fitting


def draw(width: int) -> str:
    table = open_table("plan", ("success", "SPL", "s", "n"))
    table.add_row("garden_bungalow", "100.0 %", "0.973", "10.0", "250")
    console = Console(file=io.StringIO(), width=width)
    print_fitting(console, table, ("s", "SPL"))
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_no_cell_is_cut_where_columns_are_left_out() -> None:
    for width, titles in (
        (80, "plan success SPL metres s foot/m leg/m falls n"),
        (65, "plan success SPL metres foot/m leg/m falls n"),
        (60, "plan success SPL metres foot/m leg/m falls n"),
        (59, "plan success SPL metres foot/m falls n"),
    ):
        table = open_table("plan", ("success", "SPL", "metres", "s", "foot/m", "leg/m", "falls", "n"))
        table.add_row("tiny", "100.0 %", "0.973", "10.00", "10.0", "0.00", "0.00", "0.0 %", "1")
        console = Console(file=io.StringIO(), width=width)
        print_fitting(console, table, ("s", "leg/m", "metres"))
        said = console.file.getvalue()  # type: ignore[attr-defined]
        assert said.split("\n")[1].split() == titles.split()
        assert "…" not in said and "0.0 %" in said


def test_a_narrow_terminal_shows_whole_names_and_the_figures_that_matter() -> None:
    for width, titles in ((60, "plan success SPL s n"), (40, "plan success SPL n"), (34, "plan success n")):
        said = draw(width)
        assert said.split("\n")[1].split() == titles.split()
        assert "garden_bungalow" in said and "250" in said
