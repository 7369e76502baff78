"""The pages of the documentation."""

from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")])
LONG = 80
"""Shorter lines, and rows of tables, may well occur twice."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_page_says_a_long_line_twice(page: Path) -> None:
    """A page once had an older copy of half of itself at its end."""
    lines = Counter(line for line in page.read_text().splitlines() if len(line) > LONG and not line.startswith("|"))
    assert [line for line, count in lines.items() if count > 1] == []
