"""What a person sees in the terminal while verbs work: bars with the time left, and tables."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

console = Console(stderr=True)


def show_table(
    heads: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None
) -> None:
    """Print a table whose words are taken as they are."""
    print_table(heads, rows, Console(), title)


def print_table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    where: Console,
    title: str | None = None,
) -> None:
    """Print a table whose words are taken as they are, to a certain console."""
    table = Table(*map(escape, heads), title=title and escape(title), box=None)
    for row in rows:
        table.add_row(*map(escape, row))
    where.print(table)


@contextmanager
def progress_bars() -> Iterator[Callable[[str], Callable[[float, str], None]]]:
    """Draw one bar per verb, with the time left; in a log, one line per verb."""
    columns = (
        TextColumn("[bold]{task.fields[verb]:>9}"),
        BarColumn(30),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("[dim]{task.description}"),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:

        def tell(verb: str) -> Callable[[float, str], None]:
            for task in bars.task_ids:
                bars.update(task, completed=1.0, description="")
            task = bars.add_task("", total=1.0, verb=verb)
            if not console.is_terminal:
                console.print(verb)

            def progress(fraction: float, words: str) -> None:
                bars.update(task, completed=fraction, description=words)

            return progress

        yield tell
        for task in bars.task_ids:
            bars.update(task, completed=1.0, description="")
