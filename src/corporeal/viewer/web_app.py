"""The pages and data of the viewer, as an ASGI application."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from corporeal.core.errors import UserError
from corporeal.pipeline.run_pipeline import STAGE_FOLDERS
from corporeal.render.viewer_page import VIEW_SCRIPTS, web_file
from corporeal.viewer.access import REPORT_CONTENT_POLICY, AccessGuard, AccessPolicy
from corporeal.viewer.run_store import THUMBNAIL_FILE, RunStore

MIME_TYPES = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}
PAGE_FILES = (*VIEW_SCRIPTS, "touch.js", "change.js", "export.js", "start.js", "home.js", "viewer.css", "home.css")
"""All that a page may load of the package."""


@dataclass(frozen=True)
class SiteOptions:
    """What a server shows, and whether it may change anything."""

    shelf: RunStore
    first: tuple[str, ...] = ()
    """Runs that the first page shows, one or two; none: the list of all."""
    read_only: bool = False
    works: bool = False
    """Whether files can be uploaded and runs be started."""


def make_app(shown: SiteOptions, door: AccessPolicy, more: tuple[BaseRoute, ...] = ()) -> Starlette:
    """Return the application."""
    pages = _Pages(shown)
    routes = [
        Route("/", pages.first),
        Route("/home", pages.home),
        Route("/view/{names:path}", pages.view),
        Route("/web/{name}", pages.file),
        Route("/runs", pages.runs),
        Route("/take/{name}", pages.take),
        Route("/picture/{name}", pages.picture),
        Route("/report/{name}", pages.report),
        *more,
    ]
    outer = [Middleware(AccessGuard, door=door), Middleware(GZipMiddleware, compresslevel=4)]
    return Starlette(routes=routes, middleware=outer, exception_handlers={UserError: _said})


async def _said(request: Request, error: Exception) -> Response:
    """Answer a person's mistake with its sentence."""
    return JSONResponse({"error": str(error)}, 404 if request.method == "GET" else 400)


class _Pages:
    """What a browser may read."""

    def __init__(self, shown: SiteOptions) -> None:
        self.shown, self.shelf = shown, shown.shelf

    async def first(self, request: Request) -> Response:
        if self.shown.first:
            return RedirectResponse("/view/" + "/".join(self.shown.first))
        return await self.home(request)

    async def home(self, request: Request) -> Response:
        return _html("home.html")

    async def view(self, request: Request) -> Response:
        names = request.path_params["names"].split("/")
        if not 1 <= len(names) <= 2:
            raise UserError("A page shows one run, or two beside each other.")
        for name in names:
            self.shelf.path(name)
        return _html("view.html")

    async def file(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in PAGE_FILES:
            raise UserError("There is no such file.")
        return Response(web_file(name), media_type=MIME_TYPES[Path(name).suffix])

    async def runs(self, request: Request) -> Response:
        listed = await run_in_threadpool(self.shelf.listed)
        return JSONResponse({"runs": listed, "read_only": self.shown.read_only, "works": self.shown.works})

    async def take(self, request: Request) -> Response:
        opened = await run_in_threadpool(self.shelf.open, request.path_params["name"])
        return Response(opened.take, media_type="application/octet-stream")

    async def picture(self, request: Request) -> Response:
        return self._file(request, Path(STAGE_FOLDERS["video"]) / THUMBNAIL_FILE)

    async def report(self, request: Request) -> Response:
        answer = self._file(request, Path("report.html"))
        answer.headers["Content-Security-Policy"] = REPORT_CONTENT_POLICY
        return answer

    def _file(self, request: Request, name: Path) -> Response:
        path = self.shelf.path(request.path_params["name"]) / name
        if not path.is_file():
            raise UserError(f"This run has no {name.name} yet.")
        return FileResponse(path)


def _html(name: str) -> Response:
    return Response(web_file(name), media_type="text/html")


def json_route(act: Callable[[Any], Any]) -> Callable[[Request], Any]:
    """Make a route of a function of JSON: what it is sent, a small object, to what it answers."""

    async def answer(request: Request) -> Response:
        body = b""
        async for block in request.stream():
            body += block
            if len(body) > MAX_JSON_BYTES:
                return JSONResponse({"error": "That is too much for one order."}, 413)
        try:
            asked = json.loads(body or b"{}")
        except ValueError:
            return JSONResponse({"error": "That is no JSON."}, 400)
        if not isinstance(asked, dict):
            return JSONResponse({"error": "That is no JSON object."}, 400)
        return JSONResponse(await run_in_threadpool(act, asked))

    return answer


MAX_JSON_BYTES = 64_000
"""Largest order [bytes]."""
