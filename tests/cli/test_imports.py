"""The garbage collector and large libraries."""

import gc
import sys

import pytest

from vinl.cli.imports import kept_imports


def test_what_is_imported_is_kept_from_the_collector_and_nothing_else_is(monkeypatch: pytest.MonkeyPatch) -> None:
    before = gc.get_freeze_count()
    with kept_imports():
        mine = [[0]]
    assert gc.isenabled() and gc.get_freeze_count() == before
    with pytest.raises(ImportError, match="broken"), kept_imports():
        assert not gc.isenabled()
        monkeypatch.setitem(sys.modules, "large", object())
        raise ImportError("broken")
    assert gc.isenabled() and gc.get_freeze_count() > before and mine


def test_a_collector_that_was_off_stays_off() -> None:
    gc.disable()
    try:
        with kept_imports():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
