"""Parsing of --field.

one | one:E=2e6,nu=.4,rho=200    one material for everything, all of it solid
omniphysgs                       one E, nu and density for every law
vomp:PATH pixie:PATH table:PATH  a file of the whole scene, or a folder with one per object
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.errors import UserError
from corporeal.fields.field_table import read_field_table
from corporeal.fields.pixie_reader import read_pixie
from corporeal.fields.sampled_field import FIELD_VALUE_BOUNDS, SampledField, check_field
from corporeal.fields.vomp_reader import read_vomp

FIELD_READERS: Mapping[str, tuple[Callable[[Path], SampledField], str]] = {
    "vomp": (read_vomp, ".npz"),
    "pixie": (read_pixie, ".ply"),
    "table": (read_field_table, ".csv"),
}
"""Kind of a field → its reader, and what the name of its files ends in."""
FIELD_LETTERS = {"E": "young", "nu": "poisson", "rho": "density"}
PHYSGAUSSIAN_UNIFORM = {"young": 2e6, "poisson": 0.4, "density": 200.0}
"""PhysGaussian's config/ficus_config.json [SI]."""
OMNIPHYSGS_UNIFORM = {"young": 2e6, "poisson": 0.4, "density": 1000.0}
"""OmniPhysGS: buffers of elasticity.py, which its training does not change [SI]."""
FIELD_SPECIFICATION_HELP = (
    "Use one, one:E=2e6,nu=.4,rho=200, omniphysgs, vomp:PATH, pixie:PATH or table:PATH.csv."
)


@dataclass(frozen=True)
class UniformField:
    """The same numbers everywhere."""

    method: str
    value: Mapping[str, float]
    """Field of ``types.Material`` → value, SI."""
    keeps_laws: bool
    """Whether parts keep their laws and builds; else all is solid fixed-corotated material."""


@dataclass(frozen=True)
class FieldFiles:
    """Fields in files of one kind."""

    kind: str
    path: Path

    def of(self, object_name: str | None) -> Path | None:
        """Return the file of one object, or of the whole scene (None); None: there is none.

        A folder holds one file per object, named as the object is or as it is without its number.
        """
        if not self.path.is_dir():
            return self.path if object_name is None else None
        if object_name is None:
            return None
        names = (object_name, re.sub(r"_\d+$", "", object_name))
        tried = (self.path / f"{name}{FIELD_READERS[self.kind][1]}" for name in names)
        return next((path for path in tried if path.exists()), None)

    def read(self, path: Path) -> SampledField:
        """Read one file.

        Raises:
            BadFileError: It cannot be used.

        """
        return check_field(FIELD_READERS[self.kind][0](path))


def parse_field_specification(spec: str) -> UniformField | FieldFiles | None:
    """Read a specification; None: it is empty, and our own numbers count.

    Raises:
        UserError: It is none, or its file does not exist.

    """
    kind, colon, rest = spec.partition(":")
    if not spec:
        return None
    if kind == "one":
        return UniformField(
            "one material",
            PHYSGAUSSIAN_UNIFORM | (_parse_field_numbers(spec, rest) if colon else {}),
            False,
        )
    if spec == "omniphysgs":
        return UniformField("OmniPhysGS", OMNIPHYSGS_UNIFORM, True)
    if kind not in FIELD_READERS or not rest:
        raise UserError(f"--field {spec} is not a field. {FIELD_SPECIFICATION_HELP}")
    path = Path(rest).expanduser()
    if not path.exists():
        raise UserError(f"No such file: {path}. Check the path after {kind}:.")
    if path.is_dir() and not any(path.glob(f"*{FIELD_READERS[kind][1]}")):
        raise UserError(f"{path} holds no {FIELD_READERS[kind][1]} file. Put one per object there.")
    return FieldFiles(kind, path)


def _parse_field_numbers(spec: str, text: str) -> dict[str, float]:
    found = {}
    for pair in text.split(","):
        letter, _, number = pair.partition("=")
        name = FIELD_LETTERS.get(letter.strip())
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        low, high = FIELD_VALUE_BOUNDS.get(name or "", (0.0, 0.0))
        if name is None or not low < value < high:
            raise UserError(
                f"--field {spec}: {pair!r} is not a valid number. {FIELD_SPECIFICATION_HELP}"
            )
        found[name] = value
    return found
