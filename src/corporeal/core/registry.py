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
    module, _, attribute = menu[name].partition(":")
    try:
        return getattr(import_module(module), attribute)
    except ModuleNotFoundError as missing:
        if missing.name is None or missing.name.startswith("corporeal"):
            raise  # our own mistake, not a missing extra
        raise UserError(
            f"The {kind} {name!r} needs {missing.name!r}. "
            f"Install it with: pip install {missing.name}."
        ) from missing
