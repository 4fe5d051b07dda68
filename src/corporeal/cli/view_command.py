"""`corporeal view`: the viewer in a browser."""

from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import tyro

from corporeal.cli.parse import parse
from corporeal.core.errors import UserError

REQUIRED_PACKAGES = ("starlette", "uvicorn", "websockets")
MAX_RUNS_PER_PAGE = 2
"""Maximum number of runs on one page."""


@dataclass(frozen=True)
class ViewOptions:
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


def command_view() -> None:
    """View a run in a browser: rotate, colour, inspect every part.

    Two runs are shown side by side with one timeline and camera; without a run, all are listed. Needs the extra
    `viewer`: pip install 'corporeal[viewer]'.
    """
    asked = parse(ViewOptions, "view", command_view.__doc__)
    absent = [name for name in REQUIRED_PACKAGES if find_spec(name) is None]
    if absent:
        raise UserError(
            f"The viewer needs {', '.join(absent)}: pip install 'corporeal[viewer]'. "
            "report.html of every run holds a 3D view without dependencies."
        )
    _show(asked)


def _show(asked: ViewOptions) -> None:
    from corporeal.viewer.asset_routes import asset_routes
    from corporeal.viewer.live_assets import LiveAssets
    from corporeal.viewer.live_simulation import LiveSession
    from corporeal.viewer.live_socket import live_route
    from corporeal.viewer.replay_jobs import ReplayJobs
    from corporeal.viewer.run_exports import RunExports
    from corporeal.viewer.run_requests import RunRequests
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.server import ListenAddress, access_policy_of, address_words, open_listener, serve
    from corporeal.viewer.web_app import SiteOptions, make_app

    names = _names(asked)
    address = ListenAddress(asked.host, asked.port)
    door, listener = access_policy_of(address), open_listener(address)
    addresses = address_words(address, listener.getsockname()[1], door)
    shelf = RunStore(asked.runs, None if asked.runs else asked.out)
    room = LiveSession(shelf.made, (things := LiveAssets(shelf)).find)
    work = None if asked.read_only or asked.runs else RunRequests(shelf, asked.out)
    replays = ReplayJobs(shelf, room)
    live = (live_route(room), *RunExports(shelf).routes(), *replays.routes(), *asset_routes(things, room))
    more = () if asked.read_only else (*live, *(work.routes() if work else ()))
    app = make_app(SiteOptions(shelf, names, asked.read_only, work is not None), door, more)
    try:
        ready = partial(print, *addresses, "Ctrl-C ends.", sep="\n", flush=True)
        serve(app, listener, ready, addresses[0] if asked.browser else "")
    finally:
        room.close()
        replays.close()
        if work is not None:
            work.close()


def _names(asked: ViewOptions) -> tuple[str, ...]:
    """Return the names of the runs asked for; raise if one is no run."""
    from corporeal.pipeline.run_pipeline import read_run_request

    if len(asked.runs) > MAX_RUNS_PER_PAGE:
        raise UserError(f"A page shows one run, or two beside each other, not {len(asked.runs)}.")
    for run in asked.runs:
        read_run_request(run)  # says what to do where it is no run
    names = tuple(run.resolve().name for run in asked.runs)
    if len(set(names)) < len(names):
        raise UserError("Two runs have the same name. Name two different ones.")
    if not asked.runs and not asked.out.is_dir():
        _begin(asked)
    return names


def _begin(asked: ViewOptions) -> None:
    """Create the folder of all runs.

    Raises:
        UserError: The folder is read-only or cannot be made.
    """
    if asked.read_only or asked.out.exists():
        raise UserError(f"{asked.out} is no folder. Name a run, or a folder of runs with --out.")
    try:
        asked.out.mkdir(parents=True)
    except OSError as error:
        raise UserError(f"{asked.out} cannot be made: {error.strerror}. Choose --out.") from error
