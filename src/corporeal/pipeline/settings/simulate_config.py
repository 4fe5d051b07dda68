"""Settings of the stage simulate."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core import registry
from corporeal.core.errors import UserError
from corporeal.mpm.engines import DEFAULT_ENGINE, engine_class, require_of_class
from corporeal.mpm.problem import BodySplittingEngine, InteractiveEngine


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings; none of them changes material values."""

    engine: Literal["cpu", "cuda", "reference"] = DEFAULT_ENGINE
    """cpu: the fast engine; cuda: the same on a CUDA GPU; reference: NumPy in double precision, slow, which the others
    are tested against.
    """
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one shared
    field, a control in which touching objects stick together.
    """
    breaking: bool = False
    """Break brittle objects that are struck with ten times the energy they withstand; else a warning says what would
    break.
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
