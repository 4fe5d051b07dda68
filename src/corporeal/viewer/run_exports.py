"""Export of a run as a zip for download."""

import io
import zipfile
from pathlib import Path
from threading import Lock
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from corporeal.core.errors import UserError
from corporeal.export.export_scene import EXPORT_FOLDER, export_scene
from corporeal.export.export_target import EXPORT_WRITERS, ExportRecord
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.web_app import json_route


class RunExports:
    """Writes exports of the runs of a server, one at a time, into their folder ``export_scene``."""

    def __init__(self, shelf: RunStore) -> None:
        self.shelf, self.lock = shelf, Lock()

    def routes(self) -> tuple[BaseRoute, ...]:
        """Return what a page may ask."""
        return (
            Route("/export", json_route(self.write), methods=["POST"]),
            Route("/exported/{name}/{target}", self._zip),
        )

    def write(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Export ``run`` ``to`` a target; say what was written, and what the format cannot say."""
        name, target = str(asked.get("run", "")), asked.get("to")
        chosen = next((known for known in EXPORT_WRITERS if known == target), None)
        if chosen is None:
            raise UserError(f"Unknown format. Choose one of: {', '.join(EXPORT_WRITERS)}.")
        run = self.shelf.path(name)
        with self.lock:
            record: ExportRecord = export_scene(run, (chosen,))  # type: ignore[arg-type]
        row = record.targets[chosen]
        return {"files": list(row.files), "unsaid": list(row.unsaid)}

    async def _zip(self, request: Request) -> Response:
        name, target = request.path_params["name"], request.path_params["target"]
        folder = self.shelf.path(name) / EXPORT_FOLDER / target
        if target not in EXPORT_WRITERS or not folder.is_dir():
            raise UserError(f"{name} has not been exported to {target}.")
        body = await run_in_threadpool(_packed, folder)
        headers = {"Content-Disposition": f'attachment; filename="{target}.zip"'}
        return Response(body, media_type="application/zip", headers=headers)


def _packed(folder: Path) -> bytes:
    """Return a folder as a zip."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                archive.write(path, Path(folder.name) / path.relative_to(folder))
    return out.getvalue()
