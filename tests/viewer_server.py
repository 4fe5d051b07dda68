"""A server of the viewer in a thread of the test, and raw requests to it."""

import http.client
import json
import threading
from contextlib import contextmanager
from dataclasses import dataclass

import pytest

pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
pytest.importorskip("starlette", reason="the extra `viewer` is not installed")

import uvicorn

import corporeal as co
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline.run_pipeline import Settings, run
from corporeal.viewer.access import AccessPolicy
from corporeal.viewer.server import ListenAddress, open_listener


@dataclass
class Answer:
    status: int
    headers: dict
    body: bytes

    @property
    def json(self):
        return json.loads(self.body)


class Server:
    def __init__(self, port):
        self.port = port
        self.address = f"http://127.0.0.1:{port}"

    def ask(self, path, method="GET", body=None, **headers):
        """Send a request with these headers and no others that matter (``_`` stands for ``-``)."""
        link = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        try:
            link.request(method, path, body, named)
            got = link.getresponse()
            return Answer(got.status, {k.lower(): v for k, v in got.getheaders()}, got.read())
        finally:
            link.close()

    def order(self, path, **asked):
        return self.ask(path, "POST", json.dumps(asked).encode(), X_Corporeal="1")


@contextmanager
def serving(app):
    listener = open_listener(ListenAddress("127.0.0.1", 0))
    settings = uvicorn.Config(app, log_level="error", timeout_graceful_shutdown=1, ws_max_size=4096)
    server = uvicorn.Server(settings)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    try:
        while not server.started and thread.is_alive():
            thread.join(0.02)
        yield Server(listener.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join(20)
        listener.close()


def a_run(folder, name="drop", until="simulate", duration=0.2):
    """A foam ball and a rigid one that fall on the floor."""
    soft = co.ball("seat_foam", radius=0.05, at=(0, 0, 0.08), name="ball")
    stone = co.ball("granite", radius=0.04, at=(0.7, 0, 0.06), name="stone")
    path = folder / f"{name}.glb"
    write_glb(path, co.build_scene(soft, stone, duration=duration, fps=60))
    settings = Settings()
    return run([path], folder / "runs" / name, settings, until=until)


LOCAL = AccessPolicy()
