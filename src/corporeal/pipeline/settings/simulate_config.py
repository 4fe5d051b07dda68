"""Settings of the stage simulate."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core import registry
from corporeal.core.errors import UserError


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings; none of them changes material values."""

    engine: Literal["cpu", "cuda", "reference"] = "cpu"
    """cpu: the fast engine; cuda: the same on a CUDA GPU; reference: NumPy in double precision,
    slow, which the others are tested against.
    """
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one shared
    field, a control in which touching objects stick together.
    """
    breaking: bool = False
    """Break brittle objects that are struck with ten times the energy they withstand; else a
    warning says what would break.
    """


def validate(config: SimulateConfig) -> None:
    """Raise UserError where the engine cannot run."""
    if config.breaking and (config.engine, config.contact) != ("cpu", "multi"):
        raise UserError(
            "--breaking works with the engine cpu and with contact multi alone. Leave out "
            "--engine and --contact."
        )
    if config.engine == "cuda":
        registry.load_backend(
            "engine", "cuda", {"cuda": "corporeal.mpm.cuda.engine:require_device"}
        )("cuda")
