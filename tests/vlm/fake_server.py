"""A server on this machine that speaks the formats of OpenAI, Anthropic and Google, and can fail.

A script is a list of steps; each request takes the next, and the last one is repeated. A step is a
dict (content, more, status, headers, error, sleep), or a function that makes one from the request.
In OpenAI's format ``more`` are the choices beside the first.
"""

import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class Request:
    """One request as it came in."""

    def __init__(self, path, headers, body):
        self.path, self.headers, self.body, self.time = path, headers, body, time.monotonic()

    @property
    def text(self):
        """Everything that is said in it."""
        return json.dumps(self.body, ensure_ascii=False)

    @property
    def pictures(self):
        """How many pictures it carries."""
        return (
            self.text.count('"image_url": {')
            + self.text.count('"type": "image"')
            + (self.text.count("inlineData") + self.text.count("inline_data"))
        )


class FakeServer:
    """Use as a context; ``url`` is the base for OpenAI's format, ``root`` for the others."""

    def __init__(self, *script):
        self.script, self.requests, self._one = list(script), [], threading.Lock()

    def __enter__(self):
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()
        self.root = f"http://127.0.0.1:{self._server.server_port}"
        self.url = f"{self.root}/v1"
        return self

    def __exit__(self, *_):
        self._server.shutdown()
        self._server.server_close()

    def step(self, request):
        """Take the next step of the script."""
        with self._one:
            self.requests.append(request)
            step = self.script.pop(0) if len(self.script) > 1 else self.script[0]
        return step(request) if callable(step) else step


def _handler(server):
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_):
            pass

        def do_POST(self):
            body = json.loads(self.rfile.read(int(self.headers["content-length"])))
            step = server.step(Request(self.path, {k.lower(): v for k, v in self.headers.items()}, body))
            time.sleep(step.get("sleep", 0))
            status = step.get("status", 200)
            said = _answer(self.path, body, step) if status == 200 else _error(step)
            data = step["raw"].encode() if "raw" in step else json.dumps(said).encode()
            try:
                self.send_response(status)
                for name, value in step.get("headers", {}).items():
                    self.send_header(name, value)
                self.send_header("content-type", "application/json")
                self.send_header("content-length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)
            except (BrokenPipeError, ConnectionResetError):
                pass  # who asked did not want to wait

    return Handler


def _error(step):
    said = {"message": step.get("error", "no"), "type": "fake", "code": step.get("code", "fake")}
    return {"error": said}


def _answer(path, body, step):
    text = step.get("content", "")
    if path.endswith("/messages"):
        return _anthropic(body, text)
    if "generateContent" in path:
        return _google(text)
    return {
        "id": "c",
        "object": "chat.completion",
        "created": 1,
        "model": body["model"],
        "choices": [
            {"index": k, "finish_reason": "stop", "message": {"role": "assistant", "content": said}}
            for k, said in enumerate([text, *step.get("more", [])])
        ],
        "usage": {"prompt_tokens": 1200, "completion_tokens": 80, "total_tokens": 1280},
    }


def _anthropic(body, text):
    content = [{"type": "text", "text": text}]
    if body.get("tools"):
        call = {"type": "tool_use", "id": "t1", "name": body["tools"][0]["name"]}
        content = [call | {"input": json.loads(text)}]
    return {
        "id": "m",
        "type": "message",
        "role": "assistant",
        "model": body["model"],
        "content": content,
        "stop_reason": "tool_use" if body.get("tools") else "end_turn",
        "stop_sequence": None,
        "usage": {"input_tokens": 1200, "output_tokens": 80},
    }


def _google(text):
    return {
        "candidates": [{"content": {"role": "model", "parts": [{"text": text}]}, "finishReason": "STOP", "index": 0}],
        "usageMetadata": {"promptTokenCount": 1200, "candidatesTokenCount": 80, "totalTokenCount": 1280},
        "modelVersion": "fake",
    }
