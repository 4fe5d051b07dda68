"""Write OpenUSD's text format (.usda): layers of prims with attributes, samples and metadata.

Text needs no library and is readable. Grammar: OpenUSD's "Crate and text file formats",
https://openusd.org/release/spec.html. Numbers are written in nine digits, which single precision survives unchanged, or
shortest in double.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TextIO

import numpy as np

INDENT = "    "
IDENTIFIER_PATTERN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True)
class UsdSampleStream:
    """Samples of one attribute."""

    name: str
    """Type and name."""
    rows: Callable[[], Iterable[str]]
    """Makes a value for each of the time codes 0, 1, 2 and so on."""

    def write(self, file: TextIO, depth: int) -> None:
        """Write them one by one."""
        _write_lines(file, depth, f"{self.name}.timeSamples = {{")
        for k, value in enumerate(self.rows()):
            _write_lines(file, depth + 1, f"{k}: {value},")
        _write_lines(file, depth, "}")


@dataclass
class UsdPrim:
    """One prim: type, properties, children."""

    kind: str
    """Schema ("Mesh"); "": an over that adds to a prim of another layer."""
    name: str
    schemas: list[str] = field(default_factory=list)
    """API schemas that are applied, whether this release of OpenUSD knows them or not."""
    metadata: list[str] = field(default_factory=list)
    """Lines between the parentheses, from ``usda_display_name``, ``usda_custom_data``, ``usda_inactive`` …"""
    lines: list[str] = field(default_factory=list, repr=False)
    """Attributes and relationships."""
    streams: list["UsdSampleStream"] = field(default_factory=list, repr=False)
    """Attributes whose samples are made while they are written."""
    children: list["UsdPrim"] = field(default_factory=list)
    variants: dict[str, list["UsdPrim"]] = field(default_factory=dict)
    """Name of a variant → prims that it changes; all of the set ``variant_set``."""
    variant_set: str = ""
    chosen: str = ""
    """The variant that is selected."""

    def add(self, child: "UsdPrim") -> "UsdPrim":
        """Put a prim below this one and return it."""
        self.children.append(child)
        return child

    def set(self, kind: str, name: str, value: str) -> None:
        """Give an attribute a value, which is written already."""
        self.lines.append(f"{kind} {name} = {value}")

    def sample(self, kind: str, name: str, values: Iterable[str]) -> None:
        """Give an attribute a value at time codes 0, 1, 2 and so on."""
        rows = "".join(f"{INDENT}{k}: {v},\n" for k, v in enumerate(values))
        self.lines.append(f"{kind} {name}.timeSamples = {{\n{rows}}}")

    def stream(self, kind: str, name: str, rows: Callable[[], Iterable[str]]) -> None:
        """Do as ``sample`` with values that are made one after the other, and none is kept."""
        self.streams.append(UsdSampleStream(f"{kind} {name}", rows))

    def relate(self, name: str, paths: Sequence[str], strength: str = "") -> None:
        """Point to other prims by their paths."""
        targets = ", ".join(f"<{p}>" for p in paths)
        targets = targets if len(paths) == 1 else f"[{targets}]"
        behind = f" (\n{INDENT}bindMaterialAs = {usda_string(strength)}\n)" if strength else ""
        self.lines.append(f"rel {name} = {targets}{behind}")

    def write(self, file: TextIO, depth: int = 0) -> None:
        """Write the prim and all below it."""
        head = f'def {self.kind} "{self.name}"' if self.kind else f'over "{self.name}"'
        _write_lines(file, depth, head + self._parentheses() + "\n{")
        for line in self.lines:
            _write_lines(file, depth + 1, line)
        for stream in self.streams:
            stream.write(file, depth + 1)
        for child in self.children:
            file.write("\n")
            child.write(file, depth + 1)
        if self.variants:
            self._write_variants(file, depth + 1)
        _write_lines(file, depth, "}")

    def _parentheses(self) -> str:
        lines = list(self.metadata)
        if self.schemas:
            lines.append(f"prepend apiSchemas = {usda_strings(self.schemas)}")
        if self.variants:
            chosen = f"{INDENT}string {self.variant_set} = {usda_string(self.chosen)}"
            lines.append(f"variants = {{\n{chosen}\n}}")
            lines.append(f"prepend variantSets = {usda_string(self.variant_set)}")
        if not lines:
            return ""
        inner = "\n".join(INDENT + line for entry in lines for line in entry.split("\n"))
        return f" (\n{inner}\n)"

    def _write_variants(self, file: TextIO, depth: int) -> None:
        _write_lines(file, depth, f"variantSet {usda_string(self.variant_set)} = {{")
        for name, prims in self.variants.items():
            _write_lines(file, depth + 1, f"{usda_string(name)} {{")
            for prim in prims:
                prim.write(file, depth + 2)
            _write_lines(file, depth + 1, "}")
        _write_lines(file, depth, "}")


@dataclass
class UsdLayer:
    """One file: metadata of the stage, layers below it, and prims."""

    default: str
    """Name of the prim that stands for the whole file."""
    fps: float
    last: int = 0
    """Last time code."""
    below: tuple[str, ...] = ()
    """Layers that this one is over, the strongest first, as paths from this file."""
    comment: str = ""
    prims: list[UsdPrim] = field(default_factory=list, repr=False)

    def write(self, file: TextIO) -> None:
        """Write the layer: +Z up, metres and kilograms."""
        lines = [
            f'defaultPrim = "{self.default}"',
            f"endTimeCode = {self.last}",
            "kilogramsPerUnit = 1",
            "metersPerUnit = 1",
            "startTimeCode = 0",
            *([f"subLayers = [{', '.join(f'@{p}@' for p in self.below)}]"] if self.below else []),
            f"timeCodesPerSecond = {usda_number(self.fps)}",
            'upAxis = "Z"',
        ]
        comment = [usda_string(self.comment)] if self.comment else []
        inner = "\n".join(INDENT + line for line in (*comment, *lines))
        file.write(f"#usda 1.0\n(\n{inner}\n)\n")
        for prim in self.prims:
            file.write("\n")
            prim.write(file)


def _write_lines(file: TextIO, depth: int, lines: str) -> None:
    indent = INDENT * depth
    file.write(indent + lines.replace("\n", "\n" + indent) + "\n")


def usda_number(value: float) -> str:
    """Write one number so that the same double is read back."""
    value = float(value)
    return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def usda_vector(values: Iterable[float]) -> str:
    """Write a vector or a quaternion (w, x, y, z)."""
    return f"({', '.join(usda_number(x) for x in values)})"


def usda_floats(values: np.ndarray) -> str:
    """Write an array of numbers in single precision."""
    return f"[{', '.join(['%.9g'] * len(values)) % tuple(_single(values))}]"


def usda_vectors(values: np.ndarray, digits: int = 9) -> str:
    """Write an array (N, n) of vectors in single precision, with so many significant digits."""
    one = f"({', '.join([f'%.{digits}g'] * values.shape[1])})"
    return f"[{', '.join([one] * len(values)) % tuple(_single(values))}]"


def usda_integers(values: np.ndarray) -> str:
    """Write an array of whole numbers."""
    return f"[{', '.join(map(str, np.asarray(values).ravel().tolist()))}]"


def usda_integer_vectors(values: np.ndarray) -> str:
    """Write an array (N, n) of vectors of whole numbers."""
    one = f"({', '.join(['%d'] * values.shape[1])})"
    return f"[{', '.join([one] * len(values)) % tuple(np.asarray(values).ravel().tolist())}]"


def usda_string(value: str) -> str:
    r"""Write a string: one line, quoted, ``\`` and ``"`` escaped."""
    for plain, escaped in (("\\", "\\\\"), ('"', '\\"'), ("\n", "\\n"), ("\r", "\\r")):
        value = value.replace(plain, escaped)
    return f'"{value}"'


def usda_strings(values: Iterable[str]) -> str:
    """Write an array of strings or tokens."""
    return f"[{', '.join(map(usda_string, values))}]"


def usda_display_name(words: str) -> str:
    """Return how people call a prim, in any alphabet."""
    return f"displayName = {usda_string(words)}"


def usda_inactive() -> str:
    """State that a prim is not there."""
    return "active = false"


def usda_custom_data(name: str, values: Mapping[str, Any]) -> str:
    """Keep plain data under one name; null is left out, lists of mappings are numbered."""
    return f"customData = {_dictionary({name: values})}"


def _single(values: np.ndarray) -> list[float]:
    return np.asarray(values, dtype=np.float32).astype(np.float64).ravel().tolist()


def _dictionary(values: Mapping[str, Any]) -> str:
    rows = [f"{INDENT}{_entry(k, v)}" for k, v in values.items() if v is not None and v != []]
    inner = "\n".join(row.replace("\n", f"\n{INDENT}") for row in rows)
    return f"{{\n{inner}\n}}" if rows else "{\n}"


def _entry(key: str, value: Any) -> str:
    name = key if IDENTIFIER_PATTERN.fullmatch(key) else usda_string(key)
    kind, written = _typed(value)
    return f"{kind} {name} = {written}"


def _typed(value: Any) -> tuple[str, str]:
    if isinstance(value, Mapping):
        return "dictionary", _dictionary(value)
    if isinstance(value, list | tuple):
        return _typed_list(value)
    return _typed_leaf(value)


def _typed_list(values: Sequence[Any]) -> tuple[str, str]:
    kind: Literal["string", "number", "other"] = "other"
    if all(isinstance(v, str) for v in values):
        kind = "string"
    elif all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        kind = "number"
    if kind == "string":
        return "string[]", usda_strings(values)
    if kind == "number":
        return "double[]", f"[{', '.join(map(usda_number, values))}]"
    return "dictionary", _dictionary({str(k): v for k, v in enumerate(values)})


def _typed_leaf(value: Any) -> tuple[str, str]:
    if isinstance(value, bool):
        return "bool", str(value).lower()
    if isinstance(value, int):
        return "int64", str(value)
    if isinstance(value, float):
        return "double", usda_number(value)
    return "string", usda_string(str(value))
