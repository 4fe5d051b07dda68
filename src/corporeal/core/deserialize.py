"""Conversion of plain JSON data to frozen dataclasses.

The inverse of ``store.plain``: what was written to a file is read by the names of fields, not by strings. Keys that no
field has are ignored, so that a reader declares only what it needs, and a field with a default may be absent, as in
tables that are written manually.
"""

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from math import nan
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")


def from_plain(kind: type[T], data: Mapping[str, Any]) -> T:
    """Make a dataclass from plain data.

    Args:
        kind: A dataclass whose fields are numbers, strings, paths, enums, dataclasses, or tuples, lists and mappings by
            name of these.
        data: Field → value; null stands for a number that is not finite.

    Raises:
        ValueError: A field without a default is absent, or a value has another structure.
    """
    hints = get_type_hints(kind)
    known = fields(kind)  # type: ignore[arg-type]
    absent = [f.name for f in known if f.name not in data and not _has_default(f)]
    if absent:
        raise ValueError(f"{kind.__name__} needs {', '.join(absent)}")
    return kind(**{f.name: _value(hints[f.name], data[f.name]) for f in known if f.name in data})


def _has_default(field: Field) -> bool:
    return field.default is not MISSING or field.default_factory is not MISSING


def _value(hint: Any, data: Any) -> Any:
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        (kind, *_) = (k for k in inner if k is not type(None))
        return None if data is None else _value(kind, data)
    if origin is tuple or origin is list:
        return _row(origin, inner, data)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {name: _value(inner[1], value) for name, value in data.items()}
    if is_dataclass(hint) and isinstance(hint, type):
        return from_plain(hint, data)
    return _leaf(hint, data)


def _row(origin: type, inner: tuple[Any, ...], data: Any) -> Any:
    if not isinstance(data, list | tuple):
        raise ValueError(f"a list was expected, not {data!r}")
    if origin is list or inner[-1] is Ellipsis:
        return origin(_value(inner[0], value) for value in data)
    return tuple(_value(kind, value) for kind, value in zip(inner, data, strict=True))


def _leaf(hint: Any, data: Any) -> Any:
    if hint is Path:
        return Path(data)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _member(hint, data)
    return nan if hint is float and data is None else data


def _member(kind: type[Enum], data: Any) -> Enum:
    """Return what was written as its name in lower case."""
    name = str(data).upper()
    if name not in kind.__members__:
        raise ValueError(f"{data!r} is not a {kind.__name__}")
    return kind[name]
