"""Replays of what was touched, which a page asks for: one at a time, in a process of its own."""

import secrets
import signal
import threading
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import BaseRoute, Route

from corporeal.core.errors import UserError
from corporeal.core.machine import cores
from corporeal.jobs.jobs import Event, Job
from corporeal.jobs.local import LocalWorkers
from corporeal.render.viewer_page import web_file
from corporeal.viewer.live import Room
from corporeal.viewer.shelf import Shelf
from corporeal.viewer.site import answered
from corporeal.viewer.things import OURS, Key
from corporeal.viewer.touches import CONTACTS, MOST_THREADS, Record, dropped, takes, write_record

FOLDER = ".touches"
"""Of records and replays, among the runs."""
PAUSE = 0.2
"""[s]"""
STOPPED = "The replay was stopped."


@dataclass(frozen=True)
class Replay:
    """How far one is."""

    id: str
    place: Path
    state: Literal["running", "finished", "failed"] = "running"
    fraction: float = 0.0
    words: str = ""


class Replays:
    """The replays of one server. ``close`` ends what runs."""

    def __init__(self, shelf: Shelf, room: Room) -> None:
        self.shelf, self.room, self.lock = shelf, room, threading.RLock()
        self.replays: dict[str, Replay] = {}
        self.workers: LocalWorkers | None = None
        self.stopped: set[str] = set()

    def routes(self) -> tuple[BaseRoute, ...]:
        """Return what a page may ask."""
        return (
            Route("/replay", answered(self.start), methods=["POST"]),
            Route("/replay/stop", answered(self.stop), methods=["POST"]),
            Route("/replays/{id}", self._state),
            Route("/replayed/{id}", self._page),
            Route("/replayed/{id}/{contact}", self._take),
        )

    def start(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Replay at draft what has been done to ``run`` since it began."""
        name = str(asked.get("run", ""))
        run = self.shelf.path(name)
        done = self._record(name)
        beside = self._beside(done)
        with self.lock:
            if any(replay.state == "running" for replay in self.replays.values()):
                raise UserError("A replay is running already. Wait for it, or stop it.")
            number = secrets.token_hex(8)
            folder = run.resolve().parent / FOLDER
            folder.mkdir(exist_ok=True)
            kept = folder / f"{number}.json"
            write_record(kept, done)
            given = {"run": run, "kept": kept, "beside": beside}
            job = Job(number, takes, folder / number, number, given)
            self.replays[number] = Replay(number, folder / number, words="starting")
            self.workers = LocalWorkers(1, min(MOST_THREADS, cores()), folder)
            self.workers.start(job)
            threading.Thread(target=self._follow, args=(self.workers,), daemon=True).start()
        return {"id": number}

    def stop(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Stop a replay: ``id``."""
        number = str(asked.get("id", ""))
        self._find(number)
        with self.lock:
            process = self.workers.process.get(number) if self.workers else None
            if process is not None:
                self.stopped.add(number)
                process.send_signal(signal.SIGINT)
        return {}

    def close(self) -> None:
        """End what runs."""
        with self.lock:
            for number in self.replays:
                self.stop({"id": number})

    # ---------------------------------------------------------------- what becomes of it

    def _record(self, name: str) -> Record:
        live = self.room.live
        if live is None or self.room.name != name:
            raise UserError(f"{name} is not simulated now: there is nothing to replay.")
        if not live.whole:
            raise UserError("This has gone on for too long to be replayed. Begin again.")
        done = Record(name, tuple(live.hands.touches))
        if done.seconds == 0.0:
            raise UserError("Nothing has happened yet that could be replayed.")
        return done

    def _beside(self, done: Record) -> list[Path]:
        """Find the runs whose objects were dropped."""
        places = {Key.of(one.thing).place for _, one in dropped(done)} - {OURS}
        return [self.shelf.path(place) for place in sorted(places)]

    def _follow(self, workers: LocalWorkers) -> None:
        while workers.process:
            for event in workers.wait(PAUSE):
                with self.lock:
                    self._hear(event)
        workers.ready.close()

    def _hear(self, event: Event) -> None:
        old = self.replays[event.job.name]
        if event.kind == "progress":
            new = replace(old, fraction=event.fraction, words=event.words)
        elif event.kind == "finished":
            new = replace(old, state="finished", fraction=1.0, words="")
        else:
            words = STOPPED if old.id in self.stopped else event.words
            new = replace(old, state="failed", words=words)
        self.replays[old.id] = new

    def _find(self, number: str) -> Replay:
        if number not in self.replays:
            raise UserError("There is no such replay.")
        return self.replays[number]

    # ---------------------------------------------------------------- what a page reads

    async def _state(self, request: Request) -> Response:
        found = self._find(request.path_params["id"])
        return JSONResponse(
            {"state": found.state, "fraction": found.fraction, "words": found.words}
        )

    async def _page(self, request: Request) -> Response:
        self._find(request.path_params["id"])
        return Response(web_file("view.html"), media_type="text/html")

    async def _take(self, request: Request) -> Response:
        found, contact = self._find(request.path_params["id"]), request.path_params["contact"]
        path = found.place / f"{contact}.take"
        if contact not in CONTACTS or not await run_in_threadpool(path.is_file):
            raise UserError("There is no such replay.")
        return FileResponse(path, media_type="application/octet-stream")
