"""Workers start side by side, whatever is handed to them."""

from __future__ import annotations

import multiprocessing
import threading
import time

from vinl.chain.workers import Context, WorkerPool


def tell_size(context: Context, job: int) -> int:
    context.report(job, len(context.shared))
    return job


def test_no_worker_waits_until_the_one_before_has_started() -> None:
    workers, seen, told, over = 4, {}, [], threading.Event()

    def count() -> None:
        while not over.wait(0.005):
            seen.setdefault(len(multiprocessing.active_children()), time.perf_counter())

    watch = threading.Thread(target=count)
    watch.start()
    try:
        with WorkerPool(workers, bytes(4_000_000)) as pool:  # more than a pipe holds, as floor plans and policies are
            began = time.perf_counter()
            answers = pool.run(tell_size, list(range(8)), lambda *piece: told.append((time.perf_counter(), piece)))
    finally:
        over.set()
        watch.join()
    assert answers == list(range(8)) and sorted(piece for _, piece in told) == [(k, 4_000_000) for k in range(8)]
    assert seen.get(workers, float("inf")) - began < 0.5 * (told[0][0] - began)
