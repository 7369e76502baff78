"""What reports are made of: pages from templates, tables in the terminal, numbers as text."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rich import box
from rich.table import Table


def render_page(template: str, filters: Mapping[str, Callable[..., Any]], **values: Any) -> str:
    """A page of ``vinl/render/templates`` as text.

    Raises:
        ModuleNotFoundError: jinja2 is not there.
    """
    import jinja2  # figures without a page can be had without it

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vinl.render"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"number": format_number, **filters}
    return environment.get_template(template).render(**values)


def open_table(first: str, columns: Iterable[str], **options: Any) -> Table:
    """A table for the terminal: names on the left, then columns of numbers."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, **options)
    table.add_column(first, overflow="fold", min_width=9)
    for title in columns:
        table.add_column(title, justify="right", no_wrap=True)
    return table


def format_number(value: float | None, digits: int = 2, factor: float = 1.0, sign: str = "", unit: str = "") -> str:
    """A number times a factor, or a dash where there is none."""
    return "-" if value is None else f"{factor * value:{sign}.{digits}f}{unit}"
