"""Routes on droppable objects, and on live scenes with added objects."""

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from corporeal.core.errors import UserError
from corporeal.viewer.live_assets import LiveAssets
from corporeal.viewer.live_simulation import LiveSession

GENERATION_HEADER = "X-Generation"
"""Header that says which of the scenes that a simulation has been this is."""


def asset_routes(things: LiveAssets, room: LiveSession) -> tuple[BaseRoute, ...]:
    """Return the routes."""

    async def listed(request: Request) -> Response:
        return JSONResponse(await run_in_threadpool(things.listed))

    async def scene(request: Request) -> Response:
        live = room.live
        if live is None or room.name != request.path_params["name"]:
            raise UserError("This run is not simulated now.")
        face = live.face
        take = await run_in_threadpool(face.take)
        named = {GENERATION_HEADER: str(face.generation)}
        return Response(take, headers=named, media_type="application/octet-stream")

    return (Route("/things", listed), Route("/lively/{name}", scene))
