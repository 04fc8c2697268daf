"""Rows of a batch, divided among threads where that is worth it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

# Least work of a thread; handing over work costs about 0.05 ms.
LEAST_THREAD_TIME_S = 3e-4


class RowThreads:
    """Divides batches among threads, by the time that a row took in the last batch."""

    def __init__(self, threads: int) -> None:
        """Use at most this number of threads."""
        self._threads = threads
        self._time_per_row_s = 0.0
        self._pool: tuple[int, ThreadPoolExecutor] | None = None

    def run(self, rows: int, evaluate: Callable[[slice], None]) -> None:
        """Call ``evaluate`` with slices that together are all rows, from several threads at once."""
        parts = max(1, min(self._threads, int(rows * self._time_per_row_s / LEAST_THREAD_TIME_S)))
        started = time.perf_counter()
        cuts = [slice(rows * i // parts, rows * (i + 1) // parts) for i in range(parts)]
        jobs = [self._get_pool().submit(evaluate, cut) for cut in cuts[1:]]
        evaluate(cuts[0])
        if jobs:
            wait(jobs)
        for job in jobs:
            job.result()
        if rows:
            self._time_per_row_s = (time.perf_counter() - started) * parts / rows

    def _get_pool(self) -> ThreadPoolExecutor:
        process = os.getpid()  # a forked process has no threads of its parent, and starts its own
        if self._pool is None or self._pool[0] != process:
            # Two threads at once may start two pools; the one that is overwritten ends with its work.
            self._pool = process, ThreadPoolExecutor(self._threads - 1, thread_name_prefix="nlp-gait")
        return self._pool[1]
