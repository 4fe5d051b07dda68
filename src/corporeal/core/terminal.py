"""Terminal output: progress bars, log lines and tables."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Event, Thread

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

console = Console(stderr=True)

ProgressOfStage = Callable[[str], Callable[[float, str], None]]
"""Returns the progress callback of a stage."""

LOG_INTERVAL_S = 30.0
"""Seconds between two lines of a log on one stage [s]."""
LOG_START_DELAY_S = 2.0
"""Seconds after which a log says that a stage began: what is over before then is not worth a line, and an error stands
alone [s].
"""
MIN_FRACTION_FOR_ESTIMATE = 0.05
"""Share of a stage after which the remaining time is shown [-]."""
MINUTE_S, HOUR_S, SHORT_DURATION_S = 60.0, 3600.0, 90.0
"""[s]; short times are shown in seconds."""


def show_table(heads: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None) -> None:
    """Print a table whose words are taken as they are."""
    print_table(heads, rows, Console(), title)


def print_table(heads: Sequence[str], rows: Sequence[Sequence[str]], where: Console, title: str | None = None) -> None:
    """Print a table whose words are taken as they are, to a certain console."""
    table = Table(*map(escape, heads), title=title and escape(title), box=None)
    for row in rows:
        table.add_row(*map(escape, row))
    where.print(table)


def print_line(line: str, where: Console = console) -> None:
    """Print a line whose words are taken as they are, however long it is."""
    where.print(line, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def progress_bars() -> Iterator[ProgressOfStage]:
    """Draw one bar per stage, with the time left; without a terminal, in lines of a log."""
    with _bars() if console.is_terminal else log_lines(console) as tell:
        yield tell


@contextmanager
def _bars() -> Iterator[ProgressOfStage]:
    columns = (
        TextColumn("[bold]{task.fields[verb]:>9}"),
        BarColumn(30),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("[dim]{task.description}"),
    )
    with Progress(*columns, console=console) as bars:

        def tell(verb: str) -> Callable[[float, str], None]:
            for task in bars.task_ids:
                bars.update(task, completed=1.0, description="")
            task = bars.add_task("", total=1.0, verb=verb)

            def progress(fraction: float, words: str) -> None:
                bars.update(task, completed=fraction, description=words)

            return progress

        yield tell
        for task in bars.task_ids:
            bars.update(task, completed=1.0, description="")


@dataclass
class StageProgress:
    """How far a stage is."""

    verb: str
    begun: float
    """When [s]."""
    fraction: float = 0.0
    words: str = ""
    first: tuple[float, float] | None = None
    """Time of the first report [s], and the fraction that was done then: what an interrupted run left counts for no
    speed.
    """

    def report(self, fraction: float, words: str, now: float) -> None:
        """Update by a report."""
        self.fraction, self.words = fraction, words
        self.first = self.first or (now, fraction)

    def line(self, now: float) -> str:
        """Return how far it is, and how long it will last if it goes on as it did."""
        left = f", about {duration_words(self._left(now))} left" if self._speed(now) > 0 else ""
        words = f": {self.words}" if self.words else ""
        return f"{self.verb} {self.fraction:.0%} after {duration_words(now - self.begun)}{left}{words}"

    def _speed(self, now: float) -> float:
        """Return the share that is done in a second; 0: unknown yet [1/s]."""
        since, begun = self.first or (now, 0.0)
        done = self.fraction - begun
        return done / (now - since) if done >= MIN_FRACTION_FOR_ESTIMATE and now > since else 0.0

    def _left(self, now: float) -> float:
        return (1 - self.fraction) / self._speed(now)


def duration_words(seconds: float) -> str:
    """Return how long something lasts, as people do."""
    if seconds < SHORT_DURATION_S:
        return f"{seconds:.0f} s"
    if seconds < SHORT_DURATION_S * MINUTE_S:
        return f"{seconds / MINUTE_S:.0f} min"
    return f"{seconds / HOUR_S:.1f} h"


@contextmanager
def log_lines(
    where: Console,
    every: float = LOG_INTERVAL_S,
    now: Callable[[], float] = time.monotonic,
    soon: float = LOG_START_DELAY_S,
) -> Iterator[ProgressOfStage]:
    """Say when a stage that lasts begins and ends, and every so often how far it is.

    Args:
        where: Gets the lines.
        every: Seconds between two lines on one stage [s].
        now: The clock [s].
        soon: Time after which the beginning of a stage is printed [s].
    """
    watched: list[_LoggedStage] = []  # the one that goes on

    def ended() -> None:
        for one in watched:
            one.leave()
            if one.lasts:
                lasted = duration_words(now() - one.doing.begun)
                print_line(f"{one.doing.verb} done in {lasted}", where)
        watched.clear()

    def tell(verb: str) -> Callable[[float, str], None]:
        ended()
        doing = StageProgress(verb, now())
        watched.append(_LoggedStage(doing, lambda line: print_line(line, where), now, soon, every))
        return lambda fraction, words: doing.report(fraction, words, now())

    try:
        yield tell
        ended()
    finally:
        for one in watched:
            one.leave()


class _LoggedStage:
    """A stage whose state is printed at intervals, whether or not it reports anything."""

    def __init__(
        self, doing: StageProgress, say: Callable[[str], None], now: Callable[[], float], soon: float, every: float
    ) -> None:
        self.doing, self._say, self._now = doing, say, now
        self._soon, self._every = soon, every
        self.lasts = False
        self._over = Event()
        self._watch = Thread(target=self._go_on, daemon=True)
        self._watch.start()

    def leave(self) -> None:
        """Say nothing any more."""
        self._over.set()
        self._watch.join()

    def _go_on(self) -> None:
        if self._over.wait(self._soon):
            return
        self.lasts = True
        self._say(f"{self.doing.verb} begins")
        while not self._over.wait(self._every):
            self._say(self.doing.line(self._now()))
