"""`corporeal view`: look at runs in a browser."""

from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import tyro

from corporeal.cli.parse import parse
from corporeal.core.errors import UserError

NEEDED = ("starlette", "uvicorn", "websockets")
MOST = 2
"""Runs that one page shows."""


@dataclass(frozen=True)
class View:
    """What to show, and where to listen."""

    runs: Annotated[
        tuple[Path, ...],
        tyro.conf.Positional,
        tyro.conf.arg(metavar="[RUN [RUN]]", help="One run, or two to compare; none: all."),
    ] = ()
    out: Path = Path("runs")
    """Folder of all runs, where none is named."""
    port: int = 8321
    """Port to listen on; 0: any that is free."""
    host: str = "127.0.0.1"
    """Address to listen on; any but this machine's own demands a token."""
    browser: bool = True
    """Open the page in a browser."""
    read_only: bool = False
    """Show runs only: no uploads, no jobs, no live simulation."""


def verb_view() -> None:
    """Look at a run in a browser: turn it, colour it, ask what every part is and why.

    With two runs: side by side, one timeline, one camera. Without any: a list of all runs.
    Needs the extra `viewer`: pip install 'corporeal[viewer]'.
    """
    asked = parse(View, "view", verb_view.__doc__)
    absent = [name for name in NEEDED if find_spec(name) is None]
    if absent:
        raise UserError(
            f"The viewer needs {', '.join(absent)}: pip install 'corporeal[viewer]'. "
            "report.html of every run holds a 3D view that needs nothing."
        )
    _show(asked)


def _show(asked: View) -> None:
    from corporeal.viewer.exports import Exports
    from corporeal.viewer.live import Room
    from corporeal.viewer.pool import pool_routes
    from corporeal.viewer.replays import Replays
    from corporeal.viewer.serve import Address, door_of, listening, serve, where
    from corporeal.viewer.shelf import Shelf
    from corporeal.viewer.site import Shown, site
    from corporeal.viewer.socket import live_route
    from corporeal.viewer.things import Things
    from corporeal.viewer.work import Work

    names = _names(asked)
    address = Address(asked.host, asked.port)
    door, listener = door_of(address), listening(address)
    addresses = where(address, listener.getsockname()[1], door)
    shelf = Shelf(asked.runs, None if asked.runs else asked.out)
    room = Room(shelf.made, (things := Things(shelf)).find)
    work = None if asked.read_only or asked.runs else Work(shelf, asked.out)
    replays = Replays(shelf, room)
    live = (
        live_route(room),
        *Exports(shelf).routes(),
        *replays.routes(),
        *pool_routes(things, room),
    )
    more = () if asked.read_only else (*live, *(work.routes() if work else ()))
    app = site(Shown(shelf, names, asked.read_only, work is not None), door, more)
    try:
        ready = partial(print, *addresses, "Ctrl-C ends.", sep="\n", flush=True)
        serve(app, listener, ready, addresses[0] if asked.browser else "")
    finally:
        room.close()
        replays.close()
        if work is not None:
            work.close()


def _names(asked: View) -> tuple[str, ...]:
    """Return the names of the runs that were asked for; refuse what is none."""
    from corporeal.pipeline.runner import reopen

    if len(asked.runs) > MOST:
        raise UserError(f"A page shows one run, or two beside each other, not {len(asked.runs)}.")
    for run in asked.runs:
        reopen(run)  # says what to do where it is no run
    names = tuple(run.resolve().name for run in asked.runs)
    if len(set(names)) < len(names):
        raise UserError("Two runs have the same name. Name two different ones.")
    if not asked.runs and not asked.out.is_dir():
        _begin(asked)
    return names


def _begin(asked: View) -> None:
    """Make the folder of all runs: the first upload will be the first run.

    Raises:
        UserError: Nothing may be changed, or the folder cannot be made.

    """
    if asked.read_only or asked.out.exists():
        raise UserError(f"{asked.out} is no folder. Name a run, or a folder of runs with --out.")
    try:
        asked.out.mkdir(parents=True)
    except OSError as error:
        raise UserError(f"{asked.out} cannot be made: {error.strerror}. Choose --out.") from error
