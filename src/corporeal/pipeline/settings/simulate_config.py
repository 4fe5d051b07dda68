"""Settings of the stage simulate."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core import registry
from corporeal.core.errors import UserError
from corporeal.mpm.engines import DEFAULT_ENGINE, engine_class, require_of_class
from corporeal.mpm.problem import BodySplittingEngine, InteractiveEngine


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings."""

    engine: Literal["cpu", "cuda", "reference"] = DEFAULT_ENGINE
    """cpu: compiled, multi-threaded; cuda: the same method on an NVIDIA GPU; reference: NumPy in double precision,
    slow, for verification.
    """
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one shared
    field, a control in which touching objects stick together.
    """
    breaking: bool = False
    """Simulate fracture of brittle objects where the impact energy exceeds ten times E₅₀, the energy that breaks half
    of such objects; otherwise a warning names the objects that would break.
    """


def validate(config: SimulateConfig) -> None:
    """Raise UserError where the engine cannot run."""
    if config.breaking:
        for capability in (InteractiveEngine, BodySplittingEngine):
            require_of_class(engine_class(config.engine), capability)
        if config.contact != "multi":
            raise UserError("--breaking works with contact multi alone. Leave out --contact.")
    if config.engine == "cuda":
        registry.load_backend("engine", "cuda", {"cuda": "corporeal.mpm.cuda.engine:require_device"})("cuda")
