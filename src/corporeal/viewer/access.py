"""Access control of the server, and content security policy of its pages.

Programs on this machine and pages of other sites can reach a server on 127.0.0.1 as well as its user does. So: only
known names in ``Host`` (a foreign name is DNS rebinding), only the page's own origin for WebSockets, a header that
foreign pages cannot send for everything that changes something, and a token wherever the server listens beyond this
machine.
"""

import hmac
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE_NAME = "corporeal"
REQUEST_HEADER = "x-corporeal"
"""Header of every request that changes something; a foreign page needs our leave to send it."""
SAFE_METHODS = ("GET", "HEAD")
LOCAL_HOSTS = ("127.0.0.1", "localhost", "::1")
CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "media-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""Of the server's own pages."""
REPORT_CONTENT_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline' blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; media-src data:; frame-ancestors 'none'"
)
"""Of a report, which holds its scripts: it may not talk to the server."""


@dataclass(frozen=True)
class AccessPolicy:
    """Who may come in."""

    hosts: tuple[str, ...] = LOCAL_HOSTS
    """Names that the server is called by, without the port."""
    token: str = ""
    """What a visitor must know; "": nothing."""


class AccessGuard:
    """Stands before the application."""

    def __init__(self, app: ASGIApp, door: AccessPolicy) -> None:
        self.app, self.door = app, door

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if refusal is None:
            await self.app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 4403})  # before it is accepted: 403
        else:
            await refusal(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if not self._ours(host_name(host)):
            return PlainTextResponse("This server is not called so. Use its own address.\n", 400)
        origin = headers.get("origin")
        foreign = origin is not None and urlsplit(origin).netloc != host
        if foreign or (scope["type"] == "websocket" and origin is None):
            return PlainTextResponse("Not from another page.\n", 403)
        if self.door.token and not self._known(headers):
            return self._ask(scope)
        if scope["type"] == "http" and scope["method"] not in SAFE_METHODS and REQUEST_HEADER not in headers:
            return PlainTextResponse(f"Changes need the header {REQUEST_HEADER}: 1.\n", 403)
        return None

    def _ours(self, name: str) -> bool:
        """Whether the server may be called so; no foreign name leads to a bare address."""
        return name in self.door.hosts or (bool(self.door.token) and _is_address(name))

    def _known(self, headers: Headers) -> bool:
        try:
            jar = SimpleCookie(headers.get("cookie", ""))
        except CookieError:
            return False
        return COOKIE_NAME in jar and self._right(jar[COOKIE_NAME].value)

    def _right(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.door.token.encode())

    def _ask(self, scope: Scope) -> Response:
        """Take the token from the address once, and keep it in a cookie from then on."""
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
        if scope["type"] == "http" and scope["method"] == "GET" and self._right(given):
            answer = RedirectResponse("/" + scope["path"].lstrip("/\\"), 303)
            answer.set_cookie(COOKIE_NAME, self.door.token, httponly=True, samesite="strict")
            return answer
        return PlainTextResponse("Open the address that the server printed: it has a token.\n", 401)


def host_name(host: str) -> str:
    """Return a ``Host`` header without its port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _is_address(name: str) -> bool:
    try:
        return bool(ip_address(name))
    except ValueError:
        return False


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("Content-Security-Policy", CONTENT_POLICY)
            headers["X-Content-Type-Options"] = "nosniff"
            headers["Referrer-Policy"] = "no-referrer"
            headers["Cross-Origin-Resource-Policy"] = "same-origin"
        await send(message)

    return sending
