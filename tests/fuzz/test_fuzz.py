"""Sound files, files that once broke a reader, and a few damaged ones of every kind. ``make fuzz`` feeds thousands."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import fuzz
from corpus import Reader

from vinl.config.errors import InputError

KINDS = (
    *("png", "pgm", "ros map", "procthor", "houseexpo", "raster2vec", "mesh", "own json"),
    *("card", "config", "results"),
)
FILES = 30


def test_damaged_files_are_read_or_refused(tmp_path):
    """In a process of its own: here every argument's type is checked, which a user's process does not do."""
    command = [sys.executable, fuzz.__file__, "--files", str(FILES), "--workers", "0", "--seed", "1"]
    done = subprocess.run([*command, "--keep", str(tmp_path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = re.findall(r"^(\S.*?) +(\d+) read +(\d+) refused +(\d+) faults", done.stdout, re.MULTILINE)
    assert tuple(row[0] for row in rows) == KINDS
    for kind, read, refused, faults in rows:
        assert int(read) + int(refused) == FILES and faults == "0"
        assert int(refused) > 0, f"{kind}: the damage is felt"
    assert {folder.name for folder in fuzz.FOUND.iterdir()} <= set(KINDS)


def test_faults_are_found_out(tmp_path, monkeypatch):
    """A reader that fails, warns, dawdles, takes all memory or says nothing."""
    monkeypatch.setattr(fuzz, "SECONDS", 0.2)

    def refuse(*lines):
        raise InputError("\n".join(lines))

    def dawdle():
        while True:
            pass

    def try_reader(work):
        return fuzz.try_file(Reader("x", {}, lambda data, rng: data, lambda _: work(), {}), "x", b"", tmp_path)

    wrong = [lambda: 1 / 0, lambda: bytearray(2**32), lambda: refuse("one", "two"), lambda: refuse(""), dawdle]
    for work in (*wrong, lambda: warnings.warn("overflow", RuntimeWarning, stacklevel=1)):
        assert try_reader(work)[0] == "fault"
    assert try_reader(lambda: refuse("no")) == ("refused", "no")
    assert try_reader(lambda: None) == ("read", "")


def test_damage_is_drawn_from_the_seed():
    reader = Reader("x", {"x": Path(fuzz.__file__).read_bytes()}, fuzz.mutate.mutate_bytes, print, {})
    assert reader.mutant(7, 1) == reader.mutant(7, 1) != reader.mutant(7, 2)
