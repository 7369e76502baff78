"""Feed damaged files to everything that reads files: ``python tests/fuzz/fuzz.py``, or ``make fuzz``.

A reader may answer or raise ``InputError`` in one line; any other exception, a warning, five seconds of work or two
gigabytes of memory are faults. The damage is drawn from a seed: the same seed finds the same faults. A faulty file is
kept under ``--keep``; once mended, it belongs into ``tests/fuzz/found/KIND/``, which ``test_fuzz.py`` reads.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType

import mutate as mutate
from corpus import Reader, make_readers

from vinl.config.errors import InputError

FILES = 2000
"""Damaged files of each kind."""

SECONDS = 5.0
"""Of work for one file."""

WAIT = 60.0
"""Seconds on the clock after which a reader that does no work either is killed."""

MEMORY = 2 * 2**30
"""That a reader may take for one file, beside what its process had before [bytes]."""


FOUND = Path(__file__).parent / "found"

_STATES = {"read": "read", "refused": "refused", "fault": "faults"}


class TooSlow(BaseException):
    """A file took more than ``SECONDS``."""


def make_results(folder: Path) -> Path:
    """A folder of ``vinl eval`` with two episodes that end at once."""
    command = [sys.executable, "-m", "vinl.cli.app", "eval", "--floorplans", "old_town", "--loco", "rough"]
    command += ["--nav", "oracle", "--obstacles", "none", "--episodes", "2", "--seeds", "1", "--workers", "1"]
    command += ["--out", str(folder), "--set", "time_limit=0.5"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return folder


def try_file(reader: Reader, name: str, content: bytes, folder: Path) -> tuple[str, str]:
    """How a reader answers: "read", "refused" or "fault", and what is to say about it."""
    path = reader.place(folder, name, content)
    try:
        with _limits(), warnings.catch_warnings():
            warnings.simplefilter("error")
            reader.read(path)
    except InputError as error:
        if "\n" in str(error) or not str(error):
            return "fault", f"an InputError of more than one line, or none: {error!r}"
        return "refused", str(error)
    except TooSlow:
        return "fault", f"more than {SECONDS:g} s of work\n{traceback.format_exc(limit=-4)}"
    except BaseException:
        return "fault", traceback.format_exc(limit=-4)
    return "read", ""


@contextmanager
def _limits() -> Iterator[None]:
    """Time of work and memory for one file."""
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    with Path("/proc/self/statm").open() as statm:
        data = int(statm.read().split()[5]) * resource.getpagesize()
    before = signal.signal(signal.SIGPROF, _too_slow)
    resource.setrlimit(resource.RLIMIT_DATA, (data + MEMORY, hard))
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _too_slow(number: int, frame: FrameType | None) -> None:
    raise TooSlow


def _feed(kind: str, numbers: range, seed: int, results: Path, pipe: Connection) -> None:
    """Work of one process: tells the number of each file before it is read, and then how it went."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        os.chdir(scratch)
        reader = make_readers(results)[kind]
        folder = Path(scratch) / "files"
        for number in numbers:
            pipe.send((number, "begun", ""))
            pipe.send((number, *try_file(reader, *reader.mutant(number, seed), folder)))
    pipe.send((-1, "done", str(time.process_time())))


class Recorder:
    """How the files of one kind were answered."""

    def __init__(self, kind: str) -> None:
        self.kind, self.seconds, self.next = kind, 0.0, 0
        self.counts: Counter[str] = Counter()
        self.faults: dict[int, str] = {}

    def count(self, number: int, state: str, said: str) -> None:
        """Note an answer."""
        self.counts[state] += 1
        self.next = number + 1
        if state == "fault":
            self.faults[number] = said

    def report(self, files: int) -> None:
        """Print a line."""
        fed = sum(self.counts.values())
        shown = "".join(f"{self.counts[state]:6} {name}" for state, name in _STATES.items())
        short = "" if fed == files else f"  only {fed} of {files}: the time was over"
        print(f"{self.kind:<12}{shown}  {self.seconds:5.1f} s of work{short}", flush=True)


class Feeder(Recorder):
    """A process that feeds files of one kind, started again behind a file that kills or stalls it."""

    def __init__(self, kind: str, files: int, seed: int, results: Path) -> None:
        super().__init__(kind)
        self._files, self._seed, self._results, self.done = files, seed, results, False
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, far = context.Pipe(duplex=False)
        work = (self.kind, range(self.next, self._files), self._seed, self._results, far)
        self._process = context.Process(target=_feed, args=work, daemon=True)
        self._process.start()
        far.close()
        self._heard = time.monotonic()

    def listen(self) -> None:
        """Take the messages that are there; replace a process that has died or stands still."""
        try:
            while self.pipe.poll():
                number, state, said = self.pipe.recv()
                self._heard = time.monotonic()
                if state == "done":
                    self.done, self.seconds = True, float(said)
                elif state == "begun":
                    self.next = number
                else:
                    self.count(number, state, said)
        except EOFError:
            self._process.join()
            if not self.done:
                self.count(self.next, "fault", f"the process died (exit code {self._process.exitcode})")
                self._start()
        if time.monotonic() - self._heard > WAIT:
            self.stop()
            self.count(self.next, "fault", f"no answer in {WAIT:g} s")
            self._start()

    def stop(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()


def feed_all(kinds: list[str], files: int, seed: int, seconds: float, results: Path, workers: int) -> list[Feeder]:
    """Feed all kinds, several at once, until all files are read or the time is over."""
    waiting, running, ended = list(kinds), [], []
    end = time.monotonic() + seconds
    while (waiting or running) and time.monotonic() < end:
        while waiting and len(running) < workers:
            running.append(Feeder(waiting.pop(0), files, seed, results))
        for feeder in list(running):
            feeder.listen()
            if feeder.done:
                running.remove(feeder)
                ended.append(feeder)
                feeder.report(files)
        time.sleep(0.05)
    for feeder in running:
        feeder.stop()
        feeder.report(files)
    for kind in waiting:
        print(f"{kind:<12} not fed: the time was over", flush=True)
    return ended + running


def feed_here(reader: Reader, files: int, seed: int, folder: Path) -> Recorder:
    """Feed files of one kind in this process, which a bad fault may end."""
    tally, begun = Recorder(reader.name), time.process_time()
    for number in range(files):
        tally.count(number, *try_file(reader, *reader.mutant(number, seed), folder))
    tally.seconds = time.process_time() - begun
    tally.report(files)
    return tally


def feed_found(readers: dict[str, Reader], found: Path, folder: Path) -> int:
    """Feed the sound files, and those that once broke a reader: ``KIND/NUMBER-NAME``. The number of faults."""
    faults = fed = 0
    for kind, reader in readers.items():
        files = [(name, content, ("read",)) for name, content in reader.seeds.items()]
        files += [
            (f.name.split("-", 1)[1], f.read_bytes(), tuple(_STATES)[:2]) for f in sorted(found.glob(f"{kind}/*"))
        ]
        for name, content, wanted in files:
            state, said = try_file(reader, name, content, folder / kind)
            fed += 1
            if state not in wanted:
                faults += 1
                print(f"{kind}: {name} is a {state}: {said}", flush=True)
    print(f"{fed} files that are sound or were found before, {faults} faults", flush=True)
    return faults


def main() -> int:
    """Feed, report, keep what was found; 1 if there is a fault or a kind was not fed whole."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=FILES, help="damaged files of each kind (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=180.0, help="in all (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the damage (default: %(default)s)")
    parser.add_argument("--only", nargs="*", default=[], help="kinds (default: all)")
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count() or 1, help="processes; 0: this one (default: %(default)s)"
    )
    parser.add_argument("--found", type=Path, default=FOUND, help="files that once broke a reader (default: beside)")
    parser.add_argument("--keep", type=Path, default=Path("runs/fuzz"), help="for faulty files (default: %(default)s)")
    options = parser.parse_args()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="fuzz-results-") as scratch:
        results = make_results(Path(scratch) / "run")
        here, keep = Path.cwd(), options.keep.resolve()
        os.chdir(scratch)
        readers = make_readers(results)
        os.chdir(here)
        kinds = options.only or list(readers)
        again = feed_found({kind: readers[kind] for kind in kinds}, options.found, Path(scratch) / "again")
        left = options.seconds - (time.monotonic() - begun)
        if options.workers:
            feeders = feed_all(kinds, options.files, options.seed, left, results, options.workers)
        else:
            feeders = [feed_here(readers[kind], options.files, options.seed, Path(scratch) / "here") for kind in kinds]
    for feeder in feeders:
        for number, said in sorted(feeder.faults.items()):
            name, content = readers[feeder.kind].mutant(number, options.seed)
            file = keep / feeder.kind / f"{number:05d}-{name}"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
            file.with_name(file.name + ".txt").write_text(said)
        causes = Counter(said.strip().splitlines()[-1] for said in feeder.faults.values())
        for cause, count in causes.most_common(12):
            print(f"{feeder.kind}: {count} x {cause}")
    fed = sum(sum(feeder.counts.values()) for feeder in feeders)
    faults = sum(len(feeder.faults) for feeder in feeders)
    print(f"{fed} files in {time.monotonic() - begun:.0f} s, {faults} faults" + (f", kept in {keep}" if faults else ""))
    return int(again > 0 or faults > 0 or fed < options.files * len(kinds))


if __name__ == "__main__":
    sys.exit(main())
