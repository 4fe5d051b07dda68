"""Layout of a command's help: common options first, all others under "more".

Settings are nested dataclasses. Their fields are distributed to flat dataclasses, one for each heading of the help; the
settings are rebuilt from what was parsed.
"""

import ast
import inspect
import textwrap
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, make_dataclass
from itertools import pairwise
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tyro

from corporeal.core.setting_types import NoOption

OPTIONS_BEFORE_MORE = 6
"""At most this many options are listed first."""


@dataclass(frozen=True)
class Option:
    """One field of the settings, at any depth."""

    path: tuple[str, ...]
    """Names of fields that lead to it."""
    annotation: Any
    """Its type, with its settings for tyro."""
    default: Any
    """``dataclasses.MISSING``: required."""
    kind: type
    """The dataclass that holds it."""

    @property
    def name(self) -> str:
        """Name on the command line, without dashes."""
        given = [m.name for m in _metadata(self.annotation) if getattr(m, "name", None)]
        return given[-1] if given else self.path[-1].replace("_", "-")

    @property
    def positional(self) -> bool:
        """Whether it is positional."""
        return tyro.conf.Positional in _metadata(self.annotation)


@dataclass(frozen=True)
class HelpLayout:
    """Headings of the help, and the mapping from parsed options to the settings."""

    shape: Any
    """Dataclass that tyro parses the command line into."""
    kind: type
    """The settings."""
    slots: dict[tuple[str, ...], tuple[str, ...]]
    """Path of an option in the settings → its path in ``shape``."""

    def settings(self, typed: Any) -> Any:
        """Return the settings of parsed options, an instance of ``shape``."""
        return self._made(self.kind, (), typed)

    def _made(self, kind: type, path: tuple[str, ...], typed: Any) -> Any:
        values = {}
        for f in fields(kind):
            if not _is_offered(kind, f.name):
                continue
            slot = self.slots.get((*path, f.name))
            if slot is None:
                values[f.name] = self._made(_dataclass_of(kind, f.name), (*path, f.name), typed)
            else:
                values[f.name] = _at(typed, slot)
        return kind(**values)


def lay_out(kind: type, first: Sequence[str] = ()) -> HelpLayout:
    """Distribute options to headings.

    Args:
        kind: A dataclass, others within it.
        first: Names of the options that come first, in that order; if there are few, all.

    Raises:
        ValueError: ``first`` names an unknown option, or none or too many.
    """
    options = options_of(kind)
    named = {option.name: option for option in options if not option.positional}
    if len(named) <= OPTIONS_BEFORE_MORE:
        first = list(named)
    elif not 0 < len(first) <= OPTIONS_BEFORE_MORE or not set(first) <= set(named):
        raise ValueError(f"{kind.__name__}: of {sorted(named)}, {list(first)} cannot come first.")
    top = [option for option in options if option.positional] + [named[name] for name in first]
    slots = {option.path: (option.path[-1],) for option in top}
    rest: dict[tuple[str, ...], list[Option]] = {(): []}
    for option in options:
        if option not in top:
            rest.setdefault(option.path[:-1], []).append(option)
    rows = [_row(option) for option in top]
    for path, group in rest.items():
        if group:
            heading = "_".join(("more", *path))
            slots |= {option.path: (heading, option.path[-1]) for option in group}
            rows.append(_heading(heading, path, group))
    return HelpLayout(make_dataclass(kind.__name__, rows, frozen=True), kind, slots)


def options_of(kind: type, path: tuple[str, ...] = (), given: Any = None) -> list[Option]:
    """Return every field of a dataclass, and of the dataclasses within it."""
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for f in fields(kind):
        if not _is_offered(kind, f.name):
            continue
        default = _default(f) if given is None else getattr(given, f.name)
        if is_dataclass(_bare(hints[f.name])):
            inner = None if default is MISSING else default
            found += options_of(_dataclass_of(kind, f.name), (*path, f.name), inner)
        else:
            found.append(Option((*path, f.name), hints[f.name], default, kind))
    return found


def _heading(name: str, path: tuple[str, ...], group: list[Option]) -> tuple[str, Any, Any]:
    """Return a field for one heading and the options below it."""
    kind = make_dataclass(name, [_row(option) for option in group], frozen=True)
    kind.__doc__ = group[0].kind.__doc__ if path else "Further options."
    title = f"more: {path[-1]}" if path else "more"
    return name, Annotated[kind, tyro.conf.arg(name=title)], field(default_factory=kind)


def _row(option: Option) -> tuple[Any, ...]:
    """Return an option as a field with its help."""
    words = field_docstrings(option.kind).get(option.path[-1], "")
    annotation = option.annotation
    if words:
        annotation = Annotated[annotation, tyro.conf.arg(help=words)]
    if option.default is MISSING:
        return option.path[-1], annotation
    return option.path[-1], annotation, field(default_factory=lambda: option.default)


def field_docstrings(kind: type) -> dict[str, str]:
    """Return the strings below the fields of a dataclass in its source."""
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__[:-1]):
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(one)))
        except (OSError, TypeError):  # no source: the class was generated
            continue
        assert isinstance(tree.body[0], ast.ClassDef)
        rows = tree.body[0].body
        for row, below in pairwise(rows):
            if isinstance(row, ast.AnnAssign) and isinstance(row.target, ast.Name):
                words = below.value if isinstance(below, ast.Expr) else None
                if isinstance(words, ast.Constant) and isinstance(words.value, str):
                    found[row.target.id] = " ".join(words.value.split())
    return found


def _is_offered(kind: type, name: str) -> bool:
    """Tell whether a field is an option, or holds some."""
    hint = get_type_hints(kind, include_extras=True)[name]
    return not any(isinstance(one, NoOption) for one in _metadata(hint))


def _metadata(annotation: Any) -> tuple[Any, ...]:
    return get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()


def _bare(annotation: Any) -> Any:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def _dataclass_of(kind: type, name: str) -> Any:
    return _bare(get_type_hints(kind, include_extras=True)[name])


def _default(f: Any) -> Any:
    return f.default if f.default_factory is MISSING else f.default_factory()


def _at(typed: Any, slot: tuple[str, ...]) -> Any:
    for name in slot:
        typed = getattr(typed, name)
    return typed
