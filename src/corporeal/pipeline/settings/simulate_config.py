"""Which engine steps a scene: what a person may ask."""

import logging
from dataclasses import dataclass, field
from typing import Any, Literal

from corporeal.core import registry, store
from corporeal.core.errors import UserError
from corporeal.mpm.engines import DEFAULT_ENGINE, engine_class, require_of_class
from corporeal.mpm.problem import BodySplittingEngine, InteractiveEngine


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings; none of them changes material numbers."""

    engine: Literal["cpu", "cuda", "reference", "warp"] = DEFAULT_ENGINE
    """cpu: the fast engine; cuda: the same on a CUDA card; reference: NumPy in double precision,
    slow, which the others are tested against; warp: the former name of cpu."""
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one field for all,
    a control in which touching objects stick together."""
    breaking: bool = field(default=False, metadata=store.ADDED_LATER)
    """Brittle things that are struck with ten times the energy that they bear break into pieces;
    else they stay whole, and it is said what would break."""

    def __post_init__(self) -> None:
        """Take the former name of an engine for its present one, and say so."""
        if self.engine == "warp":
            logging.getLogger(__name__).warning("The engine 'warp' is called 'cpu' now.")
            object.__setattr__(self, "engine", "cpu")


def settings_for_key(config: SimulateConfig) -> dict[str, Any]:
    """Return the settings as results on disk are named by them (``store.kept``).

    The first were kept when the engine `cpu` was called `warp`; they stay what they are.
    """
    engine = "warp" if config.engine == "cpu" else config.engine
    return store.settings_for_key(config) | {"engine": engine}


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
