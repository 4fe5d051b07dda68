"""Requests of a page for runs: of uploads, or of edited runs."""

import secrets
from dataclasses import replace
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from corporeal.core.errors import UserError
from corporeal.materials.library import library
from corporeal.pipeline.run_pipeline import Settings, read_run_request
from corporeal.pipeline.settings import validate_assemble
from corporeal.viewer.run_edits import DETAIL_LEVELS, finite_number, free_run_name, prepare_changed_run
from corporeal.viewer.run_queue import QueuedRun, RunQueue
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.uploads import UploadInbox, upload_route
from corporeal.viewer.web_app import json_route

FIRST_LOOK_STAGE = "fill"
"""The last stage of a first look: then every part's material can be seen and changed."""


class RunRequests:
    """Uploads and jobs of one server."""

    def __init__(self, shelf: RunStore, runs: Path) -> None:
        self.shelf, self.runs = shelf, runs
        self.inbox, self.queue = UploadInbox(runs), RunQueue(runs)

    def routes(self) -> tuple[BaseRoute, ...]:
        """Return what a page may ask."""
        return (
            upload_route(self.inbox),
            Route("/jobs", self._jobs),
            Route("/materials", self._materials),
            Route("/asked/{name}", self._asked),
            Route("/jobs/start", json_route(self.start), methods=["POST"]),
            Route("/jobs/stop", json_route(self.stop), methods=["POST"]),
            Route("/jobs/go-on", json_route(self.go_on), methods=["POST"]),
            Route("/jobs/run", json_route(self.simulate), methods=["POST"]),
            Route("/jobs/change", json_route(self.change), methods=["POST"]),
        )

    def start(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Run an upload: ``upload``, ``name``, ``detail``, ``drop``, ``first``.

        ``drop`` is in sizes of the objects; ``first``: only as far as materials.
        """
        source = self.inbox.find(str(asked.get("upload", "")))
        detail = asked.get("detail", DETAIL_LEVELS[0])
        if detail not in DETAIL_LEVELS:
            raise UserError(f"Unknown detail. Choose one of: {', '.join(DETAIL_LEVELS)}.")
        usual = Settings()
        raised = replace(usual.assemble, drop=finite_number(asked.get("drop", 0.0), "The drop"))
        validate_assemble(raised)
        settings = replace(usual, assemble=raised, fill=replace(usual.fill, detail=detail))
        name = free_run_name(self.runs, str(asked.get("name", ""))[:80])
        (self.runs / name).mkdir()
        until = FIRST_LOOK_STAGE if asked.get("first") is True else "report"
        job = QueuedRun(secrets.token_hex(8), name, (str(source.resolve()),), until)
        return {"id": self.queue.add(job, settings).id, "name": name}

    def simulate(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Let a run that ended before its report go on to it: ``run`` names it."""
        name = str(asked.get("run", ""))
        before = read_run_request(self.shelf.path(name))
        inputs = tuple(str(path) for path in before.inputs)
        job = QueuedRun(secrets.token_hex(8), name, inputs)
        return {"id": self.queue.add(job, before.settings).id, "name": name}

    def change(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Run another run again with something changed: see ``edits.changed``; ``run`` names it."""
        name = str(asked.get("run", ""))
        made = self.shelf.made(name).results
        job, settings = prepare_changed_run(self.shelf.path(name), made, asked)
        return {"id": self.queue.add(job, settings).id, "name": job.name}

    def stop(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Stop a job: ``id``."""
        self.queue.stop(str(asked.get("id", "")))
        return {}

    def go_on(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Go on with a job that ended: ``id``."""
        self.queue.go_on(str(asked.get("id", "")))
        return {}

    async def _jobs(self, request: Request) -> Response:
        return JSONResponse({"jobs": await run_in_threadpool(self.queue.listed)})

    async def _materials(self, request: Request) -> Response:
        rows = [{"name": e.name, "group": e.group} for e in library().values()]
        return JSONResponse({"materials": rows})

    async def _asked(self, request: Request) -> Response:
        return JSONResponse(await run_in_threadpool(self.shelf.asked, request.path_params["name"]))

    def close(self) -> None:
        """End what runs; it goes on with the next server."""
        self.queue.close()
