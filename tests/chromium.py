"""A headless Chromium, driven over its own protocol (Chrome DevTools Protocol, stable subset)."""

import base64
import json
import shutil
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
ARGUMENTS = (
    *("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--mute-audio", "--remote-debugging-port=0", "--remote-allow-origins=*"),
)
"""WebGL in software, no request of the browser's own."""
PATIENCE = 60.0
"""[s]"""


def found():
    """Where a Chromium is; skips the test where there is none."""
    pytest.importorskip("websockets", reason="the extra `viewer` is not installed")
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip(f"no Chromium on this machine: none of {', '.join(NAMES)}")
    return path


@contextmanager
def browser(folder: Path, size=(1280, 800)):
    """Open a browser with an empty profile in ``folder``; yields its page."""
    from websockets.sync.client import connect

    said = (folder / "chromium.log").open("w")
    process = subprocess.Popen(
        [found(), *ARGUMENTS, f"--user-data-dir={folder / 'profile'}",
         f"--window-size={size[0]},{size[1]}", "about:blank"],
        stdout=said, stderr=subprocess.STDOUT,
    )  # fmt: skip
    try:
        port_file = folder / "profile" / "DevToolsActivePort"
        wait(lambda: port_file.exists() and len(port_file.read_text().split()) == 2)
        port = port_file.read_text().split()[0]
        import urllib.request

        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
            target = next(t for t in json.load(answer) if t["type"] == "page")
        with connect(target["webSocketDebuggerUrl"], max_size=None, ping_interval=None) as socket:
            yield Page(socket, size)
    finally:
        process.terminate()
        process.wait(20)
        said.close()


def wait(done, patience=PATIENCE):
    """Wait until something holds; returns it."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if value := done():
            return value
        time.sleep(0.05)
    raise AssertionError("waited too long")


class RefusedError(AssertionError):
    """A command that the browser answered with an error."""


# What the browser answers to a question about a page that it is just leaving.
LEAVING = (
    "Inspected target navigated or closed",
    "Cannot find context with specified id",
    "Execution context was destroyed",
)


class Page:
    """One tab."""

    def __init__(self, socket, size):
        self.socket, self.number = socket, 0
        self.requests, self.errors = [], []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.ask(f"{domain}.enable")
        self.resize(*size)

    def ask(self, method, **params):
        """Send a command; return its result. Events on the way are noted."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.recv(PATIENCE))
            if message.get("id") == self.number:
                if "error" in message:
                    raise RefusedError(message["error"]["message"])
                return message["result"]
            self._note(message)

    def _note(self, message):
        method, params = message.get("method"), message.get("params", {})
        if method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(params["entry"]["text"] + " " + params["entry"].get("url", ""))
        elif method == "Runtime.consoleAPICalled" and params["type"] == "error":
            self.errors.append(" ".join(str(a.get("value")) for a in params["args"]))

    def open(self, url):
        self.ask("Page.navigate", url=url)

    def resize(self, width, height, mobile=False):
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=mobile,
        )  # fmt: skip

    def run(self, script):
        """Evaluate an expression, awaited; return its value."""
        answer = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, script, patience=PATIENCE):
        """Wait until an expression holds, also across a change of page."""

        def holds():
            try:
                return self.run(script)
            except RefusedError as refusal:
                if not any(words in str(refusal) for words in LEAVING):
                    raise
                return None

        return wait(holds, patience)

    def mouse(self, kind, x, y, **more):
        """Move, press or release: kind is mouseMoved, mousePressed, mouseReleased."""
        button = {"button": "left", "buttons": 1, "clickCount": 1}
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **(button | more))

    def click(self, x, y):
        self.mouse("mouseMoved", x, y, button="none", buttons=0)
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def press(self, key, code=None):
        text = {"text": key} if len(key) == 1 else {}
        self.ask("Input.dispatchKeyEvent", type="keyDown", key=key, code=code or key, **text)
        self.ask("Input.dispatchKeyEvent", type="keyUp", key=key, code=code or key)

    def picture(self, path=None):
        """Take a screenshot as PNG bytes; also written to ``path``."""
        data = base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            Path(path).write_bytes(data)
        return data
