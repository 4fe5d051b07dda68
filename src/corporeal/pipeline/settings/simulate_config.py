"""Which engine steps a scene: what a person may ask."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core import registry
from corporeal.core.errors import UserError


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings; none of them changes material numbers."""

    engine: Literal["cpu", "cuda", "reference"] = "cpu"
    """cpu: the fast engine; cuda: the same on a CUDA GPU; reference: NumPy in double precision,
    slow, which the others are tested against.
    """
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one field for all,
    a control in which touching objects stick together."""
    breaking: bool = False
    """Brittle objects that are struck with ten times the energy that they bear break into pieces;
    else they stay whole, and it is said what would break.
    """


def validate(config: SimulateConfig) -> None:
    """Raise UserError where there is no engine as asked for, whatever the scene."""
    if config.breaking and (config.engine, config.contact) != ("cpu", "multi"):
        raise UserError(
            "--breaking works with the engine cpu and with contact multi alone. Leave out "
            "--engine and --contact."
        )
    if config.engine == "cuda":
        registry.load_backend(
            "engine", "cuda", {"cuda": "corporeal.mpm.cuda.engine:require_device"}
        )("cuda")
