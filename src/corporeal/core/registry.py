"""Lazy registries of backends, chosen by name."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from corporeal.core.errors import UnknownChoiceError, UserError


def load_backend(kind: str, name: str, menu: Mapping[str, str]) -> Any:
    """Return the class or function that ``menu`` lists under ``name``.

    Args:
        kind: What is being chosen, for the error message ("vision-language model").
        name: The user's choice.
        menu: Name to ``"module:attribute"``.

    Raises:
        UnknownChoiceError: ``name`` is not on the menu.
        UserError: The backend needs a package that is not installed.
    """
    if name not in menu:
        raise UnknownChoiceError(kind, name, list(menu))
    return load_function(menu[name], f"The {kind} {name!r}")


def load_function(place: str, user: str = "") -> Any:
    """Return the class or function at ``"module:attribute"``.

    Args:
        place: Where it is.
        user: What needs it, for the error message; empty: the place.

    Raises:
        UserError: It needs a package that is not installed.
    """
    module, _, attribute = place.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except ModuleNotFoundError as missing:
        if missing.name is None or missing.name.startswith("corporeal"):
            raise  # our own mistake, not a missing extra
        raise UserError(
            f"{user or place} needs {missing.name!r}. Install it with: pip install {missing.name}."
        ) from missing
