"""How long to wait for a server that is busy, and not to press it."""

import asyncio
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RetryPolicy:
    """Limits of waiting and trying."""

    tries: int = 6
    """Requests for one question that may fail on the way, the first included."""
    corrections: int = 3
    """Answers that do not fit which a model may correct."""
    timeout: float = 180.0
    """For one answer [s]."""
    first_wait: float = 1.0
    """After the first failure, where the server names no time; doubled each time [s]."""
    longest_wait: float = 60.0
    """Maximum wait; a server that asks for more ends the run [s]."""
    at_once: int = 8
    """Requests under way at the same time."""

    def wait(self, failures: int, dice: np.random.Generator) -> float:
        """Return how long to wait after so many failures [s], spread so that not all come back."""
        return min(self.first_wait * 2 ** (failures - 1), self.longest_wait) * dice.uniform(0.5, 1)


class RequestGate:
    """Lets so many questions be under way, and no request out while the server asks for a pause."""

    def __init__(self, at_once: int) -> None:
        self.places = asyncio.Semaphore(at_once)
        self._closed_until = 0.0

    def close(self, seconds: float) -> None:
        """Let nothing out for a while [s]."""
        self._closed_until = max(self._closed_until, time.monotonic() + seconds)

    async def opens(self) -> None:
        """Wait as long as the gate is closed."""
        while (left := self._closed_until - time.monotonic()) > 0:
            await asyncio.sleep(left)


def retry_after_seconds(headers: Mapping[str, str]) -> float | None:
    """Return the pause that a response's headers ask for [s], where they say it in figures."""
    for name, unit in (("retry-after-ms", 1e-3), ("retry-after", 1.0)):
        try:
            return max(float(headers[name]) * unit, 0.0)
        except (KeyError, ValueError):
            continue
    return None
