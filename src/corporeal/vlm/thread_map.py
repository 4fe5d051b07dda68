"""Concurrent execution of jobs that mostly wait for the network."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, TypeVar

JobResult = TypeVar("JobResult")


@dataclass(frozen=True)
class _FinishedJob:
    """A job that ended."""

    number: int
    result: Any
    """What it returned, or the exception that it raised."""


def thread_map(
    jobs: Sequence[Callable[[], JobResult]],
    at_once: int,
    done: Callable[[int], None] = lambda count: None,
    fatal: Callable[[Exception], bool] = lambda error: False,
) -> list[JobResult | Exception]:
    """Do every job, ``at_once`` of them at a time; return results, or what they raised, in order.

    The threads are daemons: Ctrl-C ends the program at once, however long an answer takes.

    Args:
        jobs: What is to be done.
        at_once: How many threads.
        done: Called after each job how many are finished.
        fatal: Tells which errors make the rest not worth waiting for.

    Raises:
        Exception: The first fatal error; jobs that wait are dropped.
    """
    waiting: SimpleQueue[int] = SimpleQueue()
    finished: SimpleQueue[_FinishedJob] = SimpleQueue()
    for number in range(len(jobs)):
        waiting.put(number)
    for _ in range(min(max(at_once, 1), len(jobs))):
        Thread(target=_work, args=(jobs, waiting, finished), daemon=True).start()
    results = {}
    for count in range(1, len(jobs) + 1):
        ended = finished.get()
        result = ended.result
        if isinstance(result, Exception) and fatal(result):
            _drop(waiting)
            raise result
        results[ended.number] = result
        done(count)
    return [results[number] for number in range(len(jobs))]


def _drop(waiting: SimpleQueue[int]) -> None:
    try:
        while True:
            waiting.get_nowait()
    except Empty:
        return


def _work(
    jobs: Sequence[Callable[[], JobResult]], waiting: SimpleQueue[int], finished: SimpleQueue[_FinishedJob]
) -> None:
    while True:
        try:
            number = waiting.get_nowait()
        except Empty:
            return
        try:
            finished.put(_FinishedJob(number, jobs[number]()))
        except Exception as error:  # whoever asked for the result decides
            finished.put(_FinishedJob(number, error))
