"""How long to wait for a server that is busy, and not to press it."""

import asyncio
import time
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Patience:
    """Limits of waiting and trying."""

    tries: int = 6
    """Requests for one question that may fail on the way, the first included."""
    corrections: int = 3
    """Answers that do not fit which a model may correct."""
    timeout: float = 120.0
    """For one answer [s]."""
    first_wait: float = 1.0
    """After the first failure, where the server names no time; doubled each time [s]."""
    longest_wait: float = 60.0
    """Nobody waits longer at once; a server that asks for more ends the run [s]."""
    at_once: int = 8
    """Requests under way at the same time."""

    def wait(self, failures: int, dice: np.random.Generator) -> float:
        """Return how long to wait after so many failures [s], spread so that not all come back."""
        return min(self.first_wait * 2 ** (failures - 1), self.longest_wait) * dice.uniform(0.5, 1)


class Gate:
    """Lets so many through at a time, and nobody while the server asks for a pause."""

    def __init__(self, at_once: int) -> None:
        self._places = asyncio.Semaphore(at_once)
        self._closed_until = 0.0

    def close(self, seconds: float) -> None:
        """Let nobody through for a while [s]."""
        self._closed_until = max(self._closed_until, time.monotonic() + seconds)

    async def __aenter__(self) -> None:
        await self._places.acquire()
        while (left := self._closed_until - time.monotonic()) > 0:
            await asyncio.sleep(left)

    async def __aexit__(self, *_: object) -> None:
        self._places.release()
