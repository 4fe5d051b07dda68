"""Uploaded files, validated by their first bytes."""

import asyncio
import re
import secrets
import shutil
from dataclasses import dataclass
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from corporeal.core.errors import UserError
from corporeal.viewer.run_store import INBOX_FOLDER
from corporeal.viewer.zip_unpack import unpack_zip

FILE_SIGNATURES = ((b"glTF", "scene.glb"), (b"ply", "splat.ply"), (b"PK\x03\x04", "photos.zip"))
"""First bytes, and what such a file is called here."""
TOKEN_PATTERN = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True)
class UploadLimits:
    """How much may come through the page."""

    file_bytes: int = 1 << 30
    """Most of one file [bytes]."""
    inbox_bytes: int = 4 << 30
    """Most of all files in the inbox [bytes]."""
    free_disk_bytes: int = 5 << 30
    """Least that stays free on the disk [bytes]."""


DEFAULT_UPLOAD_LIMITS = UploadLimits()


@dataclass(frozen=True)
class Upload:
    """A file that came."""

    id: str
    input: Path
    """What a run is made of: the file, or the folder it was unpacked to."""
    kind: str
    size: int
    """[bytes]"""


class UploadInbox:
    """Where uploads lie: one folder each, under names of ours."""

    def __init__(self, runs: Path, limits: UploadLimits = DEFAULT_UPLOAD_LIMITS) -> None:
        self.folder, self.limits = runs / INBOX_FOLDER, limits

    def find(self, name: str) -> Path:
        """Return what an upload is made of.

        Raises:
            UserError: There is none of that name.
        """
        if TOKEN_PATTERN.fullmatch(name):
            for known in ("scene.glb", "splat.ply", "photos"):
                path = self.folder / name / known
                if path.exists():
                    return path
        raise UserError("There is no such upload.")

    def room(self) -> tuple[int, str]:
        """Return how much may still come [bytes], at least 0, and what to say if more does."""
        self.folder.mkdir(parents=True, exist_ok=True)
        held = sum(p.stat().st_size for p in self.folder.rglob("*") if p.is_file())
        free = shutil.disk_usage(self.folder).free
        limits = self.limits
        spare, most = in_gib(limits.free_disk_bytes), in_gib(limits.inbox_bytes)
        room, reason = min(
            (
                limits.file_bytes,
                f"More than {in_gib(limits.file_bytes)}, the most that a page takes: corporeal run FILE.",
            ),
            (
                limits.inbox_bytes - held,
                f"Uploads may have {most} together: delete what is not needed in {INBOX_FOLDER}.",
            ),
            (free - limits.free_disk_bytes, f"The disk is nearly full: {in_gib(free)} are free, and {spare} stay so."),
        )
        return max(room, 0), reason

    def sorted_in(self, folder: Path) -> Upload:
        """Look what a file is, by its first bytes, and unpack photographs.

        Raises:
            UserError: It is nothing that is understood.
        """
        raw = folder / "upload"
        with raw.open("rb") as file:
            head = file.read(4)
        known = next((name for magic, name in FILE_SIGNATURES if head.startswith(magic)), None)
        if known is None:
            raise UserError(
                "Neither a GLB, nor a splat (PLY), nor a zip of photographs. Other files: corporeal run FILE."
            )
        path, size = folder / known, raw.stat().st_size
        raw.rename(path)
        if known.endswith(".zip"):
            unpack_zip(path, folder / "photos", self.room()[0] * 4 or 1)
            path.unlink()
            path = folder / "photos"
        return Upload(folder.name, path, known.rpartition(".")[2], size)


def in_gib(size: int) -> str:
    """Return a size [bytes] as a person reads it."""
    return f"{size / (1 << 30):.3g} GiB"


def upload_route(inbox: UploadInbox) -> Route:
    """Return the route that takes files: ``PUT /files``."""
    one_at_a_time = asyncio.Lock()

    async def put(request: Request) -> Response:
        if one_at_a_time.locked():
            return JSONResponse({"error": "Another file is on its way."}, 409)
        async with one_at_a_time:
            return await _taken(request, inbox)

    return Route("/files", put, methods=["PUT"])


async def _taken(request: Request, inbox: UploadInbox) -> Response:
    """Take a file in, counting; whatever is refused leaves nothing behind."""
    room, reason = await run_in_threadpool(inbox.room)
    folder = inbox.folder / secrets.token_hex(8)
    folder.mkdir()
    try:
        size = 0
        with (folder / "upload").open("xb") as file:
            async for block in request.stream():
                size += len(block)
                if size > room:
                    raise UserError(reason)
                await run_in_threadpool(file.write, block)
        found = await run_in_threadpool(inbox.sorted_in, folder)
    except (UserError, ClientDisconnect) as error:
        await run_in_threadpool(shutil.rmtree, folder, True)
        return JSONResponse({"error": str(error) or "The file did not come whole."}, 400)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return JSONResponse({"id": found.id, "kind": found.kind, "size": found.size})
