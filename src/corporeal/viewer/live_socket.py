"""WebSocket of a live simulation: frames out, commands in."""

import asyncio
import time
from collections import deque
from contextlib import suppress

from starlette.concurrency import run_in_threadpool
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from corporeal.core.errors import UserError
from corporeal.viewer.commands import MAX_COMMANDS_PER_SECOND, parse_command
from corporeal.viewer.live_simulation import LiveSession, LiveSimulation

FRAME_WAIT_S = 1.0
"""How long to wait for a picture before looking whether the visitor is still there [s]."""


def live_route(room: LiveSession) -> WebSocketRoute:
    """Return the route of the room's live simulation."""

    async def visit(socket: WebSocket) -> None:
        await socket.accept()
        try:
            live = await run_in_threadpool(room.enter, socket.path_params["name"])
        except UserError as error:
            await socket.send_json({"said": str(error), "over": True})
            return await socket.close()
        try:
            await socket.send_json(live.hello())
            await _both(_hear(socket, room, live), _show(socket, live))
        finally:
            room.leave(live, socket)

    return WebSocketRoute("/live/{name}", visit)


async def _both(*ways) -> None:
    """Do both until one ends; a page that went away is no mistake."""
    tasks = [asyncio.create_task(way) for way in ways]
    _, rest = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in rest:
        task.cancel()
    for task in tasks:
        with suppress(WebSocketDisconnect, RuntimeError, asyncio.CancelledError):
            await task


async def _hear(socket: WebSocket, room: LiveSession, live: LiveSimulation) -> None:
    recent: deque[float] = deque(maxlen=MAX_COMMANDS_PER_SECOND)
    async for text in socket.iter_text():
        now = time.monotonic()
        if len(recent) == MAX_COMMANDS_PER_SECOND and now - recent[0] < 1.0:
            continue  # too many: this one is not heard
        recent.append(now)
        try:
            order = parse_command(text)
            if not room.takes(socket):
                raise UserError("Another page has the hand: this one watches.")
            live.ask(order)
        except UserError as error:
            await socket.send_json({"said": str(error)})


async def _show(socket: WebSocket, live: LiveSimulation) -> None:
    """Send the newest picture, never a queue of old ones: a slow line misses some."""
    seen, message, face = 0, "", live.face
    while not live.closed:
        seen, before = await run_in_threadpool(live.wait, seen, FRAME_WAIT_S), seen
        if live.message != message:
            message = live.message
            await socket.send_json({"said": message})
        if live.face is not face:
            face = live.face
            await socket.send_json(face.hello())
        if seen > before:
            await socket.send_bytes(live.latest)
    await socket.send_json({"said": "Another run is simulated now.", "over": True})
