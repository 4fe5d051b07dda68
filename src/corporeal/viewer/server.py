"""Listen, print the address, and serve until interrupted."""

import secrets
import socket
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import ip_address

import uvicorn
from starlette.applications import Starlette

from corporeal.core.errors import UserError
from corporeal.viewer.access import LOCAL_HOSTS, AccessPolicy

WILDCARD_HOSTS = ("0.0.0.0", "::")
"""Addresses that mean all of this machine's."""


@dataclass(frozen=True)
class ListenAddress:
    """Where to listen."""

    host: str = "127.0.0.1"
    port: int = 8321


def is_local(host: str) -> bool:
    """Whether only this machine can reach an address."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def access_policy_of(address: ListenAddress) -> AccessPolicy:
    """Return who may come in: only this machine, or who has a new token."""
    if is_local(address.host):
        return AccessPolicy((*LOCAL_HOSTS, address.host.lower()))
    names = (address.host, socket.gethostname().lower(), socket.getfqdn().lower())
    return AccessPolicy((*LOCAL_HOSTS, *names), secrets.token_urlsafe(24))


def open_listener(address: ListenAddress) -> socket.socket:
    """Return a socket that listens.

    Raises:
        UserError: The port is taken, or there is no such address.
    """
    try:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        listener = socket.socket(family, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((address.host, address.port))
    except (OSError, OverflowError) as error:
        raise UserError(
            f"Cannot listen on {address.host} port {address.port} ({error}). "
            "Choose another with --port, or --port 0 for any that is free."
        ) from error
    return listener


def address_words(address: ListenAddress, port: int, door: AccessPolicy) -> list[str]:
    """Return how to open the page, here and from elsewhere."""
    if not door.token:
        return [
            f"http://{address.host}:{port}/",
            f"From another machine: ssh -L {port}:127.0.0.1:{port} HOST, then the same address.",
        ]
    host = socket.gethostname() if address.host in WILDCARD_HOSTS else address.host
    return [
        f"http://{host}:{port}/?token={door.token}",
        "Whoever has this address can look, and change runs unless --read-only is given.",
    ]


def serve(app: Starlette, listener: socket.socket, ready: Callable[[], None], browse: str = "") -> None:
    """Serve until Ctrl-C.

    Args:
        app: From ``site``.
        listener: From ``open_listener``.
        ready: Called as soon as visitors can come.
        browse: An address to open in the user's browser; "": none.
    """
    settings = uvicorn.Config(
        app,
        log_level="warning",
        timeout_graceful_shutdown=2,
        ws_max_size=4096,
        ws_per_message_deflate=False,
        server_header=False,
    )
    ready()
    if browse:
        threading.Timer(0.5, webbrowser.open, (browse,)).start()
    uvicorn.Server(settings).run(sockets=[listener])
