"""Replay jobs: one at a time, each in its own process."""

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
from corporeal.core.process_resources import usable_cores
from corporeal.jobs.job import Job, JobEvent
from corporeal.jobs.local_workers import LocalWorkerPool
from corporeal.render.viewer_page import web_file
from corporeal.viewer.live_assets import SHOWCASE_PREFIX, AssetKey
from corporeal.viewer.live_simulation import LiveSession
from corporeal.viewer.replay import (
    CONTACT_MODES,
    MAX_REPLAY_THREADS,
    InteractionRecord,
    drop_events,
    write_record,
    write_replays,
)
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.web_app import json_route

REPLAYS_FOLDER = ".touches"
"""Of records and replays, among the runs."""
POLL_INTERVAL_S = 0.2
"""[s]"""
STOPPED_MESSAGE = "The replay was stopped."


@dataclass(frozen=True)
class ReplayJob:
    """How far one is."""

    id: str
    place: Path
    state: Literal["running", "finished", "failed"] = "running"
    fraction: float = 0.0
    words: str = ""


class ReplayJobs:
    """The replays of one server. ``close`` ends what runs."""

    def __init__(self, shelf: RunStore, room: LiveSession) -> None:
        self.shelf, self.room, self.lock = shelf, room, threading.RLock()
        self.replays: dict[str, ReplayJob] = {}
        self.workers: LocalWorkerPool | None = None
        self.stopped: set[str] = set()

    def routes(self) -> tuple[BaseRoute, ...]:
        """Return what a page may ask."""
        return (
            Route("/replay", json_route(self.start), methods=["POST"]),
            Route("/replay/stop", json_route(self.stop), methods=["POST"]),
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
            folder = run.resolve().parent / REPLAYS_FOLDER
            folder.mkdir(exist_ok=True)
            kept = folder / f"{number}.json"
            write_record(kept, done)
            given = {"run": run, "kept": kept, "beside": beside}
            job = Job(number, write_replays, folder / number, number, given)
            self.replays[number] = ReplayJob(number, folder / number, words="starting")
            self.workers = LocalWorkerPool(1, min(MAX_REPLAY_THREADS, usable_cores()), folder)
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

    def _record(self, name: str) -> InteractionRecord:
        live = self.room.live
        if live is None or self.room.name != name:
            raise UserError(f"{name} is not simulated now: there is nothing to replay.")
        if not live.whole:
            raise UserError("This has gone on for too long to be replayed. Begin again.")
        done = InteractionRecord(name, tuple(live.hands.touches))
        if done.seconds == 0.0:
            raise UserError("Nothing has happened yet that could be replayed.")
        return done

    def _beside(self, done: InteractionRecord) -> list[Path]:
        """Find the runs whose objects were dropped."""
        places = {AssetKey.of(one.thing).place for _, one in drop_events(done)} - {SHOWCASE_PREFIX}
        return [self.shelf.path(place) for place in sorted(places)]

    def _follow(self, workers: LocalWorkerPool) -> None:
        while workers.process:
            for event in workers.wait(POLL_INTERVAL_S):
                with self.lock:
                    self._hear(event)
        workers.ready.close()

    def _hear(self, event: JobEvent) -> None:
        old = self.replays[event.job.name]
        if event.kind == "progress":
            new = replace(old, fraction=event.fraction, words=event.words)
        elif event.kind == "finished":
            new = replace(old, state="finished", fraction=1.0, words="")
        else:
            words = STOPPED_MESSAGE if old.id in self.stopped else event.words
            new = replace(old, state="failed", words=words)
        self.replays[old.id] = new

    def _find(self, number: str) -> ReplayJob:
        if number not in self.replays:
            raise UserError("There is no such replay.")
        return self.replays[number]

    async def _state(self, request: Request) -> Response:
        found = self._find(request.path_params["id"])
        return JSONResponse({"state": found.state, "fraction": found.fraction, "words": found.words})

    async def _page(self, request: Request) -> Response:
        self._find(request.path_params["id"])
        return Response(web_file("view.html"), media_type="text/html")

    async def _take(self, request: Request) -> Response:
        found, contact = self._find(request.path_params["id"]), request.path_params["contact"]
        path = found.place / f"{contact}.take"
        if contact not in CONTACT_MODES or not await run_in_threadpool(path.is_file):
            raise UserError("There is no such replay.")
        return FileResponse(path, media_type="application/octet-stream")
