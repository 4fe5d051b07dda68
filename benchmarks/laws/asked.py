"""Which engine the laws are asked of: the production engine, or one on a graphics card.

Where the environment names a card, as in ``CORPOREAL_CARD=cuda``, the engine `cuda` runs there in
all tests and experiments; else on the processor.
"""

import os
from typing import Any

from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.problem import Problem

CARD = os.environ.get("CORPOREAL_CARD", "")
"""Device that the engine `cuda` is built on; empty: the processor."""


def on_device(given: Problem) -> Any:
    """Build the engine `cuda` on the card that is named, or on the processor."""
    from corporeal.mpm.cuda.engine import CudaEngine

    return CudaEngine(given, device=CARD or "cpu")


def production(given: Problem) -> Any:
    """Build the production engine on one thread, or the one on the card that is named."""
    return on_device(given) if CARD else CpuEngine(given, threads=1)


def in_fixed_order() -> bool:
    """Whether what is asked adds in a fixed order, so that runs agree bit for bit; no card does."""
    return CARD in ("", "cpu")
