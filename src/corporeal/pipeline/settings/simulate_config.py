"""Which engine steps a scene: what a person may ask."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core import registry
from corporeal.core.errors import UserError
from corporeal.mpm.engines import DEFAULT_ENGINE, engine_class, require_of_class
from corporeal.mpm.problem import BodySplittingEngine, InteractiveEngine


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings; none of them changes material numbers."""

    engine: Literal["cpu", "cuda", "reference"] = DEFAULT_ENGINE
    """cpu: the fast engine; cuda: the same on a CUDA card; reference: NumPy in double precision,
    slow, which the others are tested against."""
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one field for all,
    a control in which touching objects stick together."""
    breaking: bool = False
    """Brittle things that are struck with ten times the energy that they bear break into pieces;
    else they stay whole, and it is said what would break."""


def validate(config: SimulateConfig) -> None:
    """Raise UserError where there is no engine as asked for, whatever the scene."""
    if config.breaking:
        for capability in (InteractiveEngine, BodySplittingEngine):
            require_of_class(engine_class(config.engine), capability)
        if config.contact != "multi":
            raise UserError("--breaking works with contact multi alone. Leave out --contact.")
    if config.engine == "cuda":
        registry.load_backend(
            "engine", "cuda", {"cuda": "corporeal.mpm.cuda.engine:require_device"}
        )("cuda")
