"""A pool of threads. Compiled loops release Python's lock, so that plain threads do.

Results never depend on how many there are: no two shares write to the same place.
"""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

from corporeal.core.process_resources import usable_cores


class ThreadPool:
    """Threads that wait for work; to be used in a ``with`` statement."""

    def __init__(self, threads: int | None = None) -> None:
        """None: one thread per core that this process may use."""
        self.threads = threads or usable_cores()
        self.others = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None

    def __enter__(self) -> "ThreadPool":
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the threads."""
        if self.others is not None:
            self.others.shutdown()

    def each(self, work: Callable[..., None], shares: Iterable[tuple]) -> None:
        """Call work(*share) for every share, as many at once as there are threads."""
        first, *rest = shares
        later = [self.others.submit(work, *share) for share in rest] if self.others else []
        work(*first)
        for share in rest if not later else ():
            work(*share)
        for one in later:
            one.result()

    def spans(self, count: int) -> list[tuple[int, int]]:
        """Cut 0 … count into as many spans as there are threads."""
        cuts = [count * k // self.threads for k in range(self.threads + 1)]
        return list(pairwise(cuts))
