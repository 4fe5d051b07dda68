"""Engines by name: how one is built, and one sentence where it cannot do what is asked."""

from typing import Final, TypeVar

from corporeal.core import registry
from corporeal.core.errors import UserError
from corporeal.mpm.problem import (
    ENGINES,
    BodyAddingEngine,
    BodySplittingEngine,
    Engine,
    InteractiveEngine,
    Problem,
    VariableLoadEngine,
)

DEFAULT_ENGINE: Final = "cpu"
"""Has every capability."""
CAPABILITIES: dict[type, str] = {
    InteractiveEngine: "push or pull bodies while it runs",
    VariableLoadEngine: "change gravity or wind while it runs",
    BodyAddingEngine: "add bodies while it runs",
    BodySplittingEngine: "break bodies into pieces",
}
"""What an engine may lack, in words after "cannot"."""

C = TypeVar("C")


def engine_class(engine: str) -> type[Engine]:
    """Return the class of an engine.

    Raises:
        UnknownChoiceError: There is no such engine.
    """
    return registry.load_backend("engine", engine, ENGINES)


def build_engine(problem: Problem, engine: str = DEFAULT_ENGINE, threads: int | None = None) -> Engine:
    """Return an engine at time 0 of a problem.

    Args:
        problem: From ``pose_problem``, or built by hand.
        engine: A name from ``corporeal.ENGINES``.
        threads: How many threads it may use on the CPU; None: as it likes.

    Raises:
        UnknownChoiceError: There is no such engine.
        UserError: The engine does not work on this machine, or cannot solve the problem.
    """
    chosen = registry.load_backend("engine", engine, ENGINES)
    return chosen(problem) if threads is None else chosen(problem, threads=threads)


def require(engine: Engine, capability: type[C]) -> C:
    """Return an engine as one that has a capability.

    Raises:
        UserError: It has not.
    """
    require_of_class(type(engine), capability)
    assert isinstance(engine, capability)
    return engine


def require_of_class(engine: type[Engine], capability: type) -> None:
    """Refuse a class of engines without a capability, before one is built.

    Raises:
        UserError: It has not.
    """
    if not issubclass(engine, capability):
        raise UserError(
            f"The engine {engine.name!r} cannot {CAPABILITIES[capability]}. Use the engine {DEFAULT_ENGINE}."
        )
