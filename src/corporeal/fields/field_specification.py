"""Parsing of --field.

one | one:E=2e6,nu=.4,rho=200    one material for everything, all of it solid
omniphysgs                       one E, nu and density for every law
vomp:PATH pixie:PATH table:PATH  a file of the whole scene, or a folder with one per object

Pixie's points: ``mapped_preds.ply`` or ``world_mapped_preds.ply``.

Columns x, y, z, density [kg/m³], E [Pa], nu and material_id beside colours (pixie/voxel/map_pred_to_coords.py, MIT);
the names of the ids are those of its simulator (MATERIAL_ID_TO_NAME in mpm_solver_warp.py), 7 being the background of
its training.

VoMP's voxels: the npz that its ``save_materials`` writes.

``voxel_data`` is a structured array of x, y, z in the frame and unit of the mesh file, youngs_modulus [Pa],
poissons_ratio and density [kg/m³] (vomp/inference/utils.py, Apache-2.0).
"""

import csv
import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError, UserError
from corporeal.fields.sampled_field import FIELD_VALUE_BOUNDS, SampledField, check_field
from corporeal.io.ply_container import read_ply_elements

VOMP_COLUMNS = {"young_pa": "youngs_modulus", "poisson": "poissons_ratio", "density": "density"}
VOMP_WRITE_AGAIN = "Write it again with VoMP's save_materials."


def read_vomp(path: Path) -> SampledField:
    """Read a file without unpickling anything.

    Raises:
        BadFileError: It is damaged, holds pickled objects, or lacks a column.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            rows = file["voxel_data"]
    except KeyError as error:
        raise BadFileError(path, "has no array voxel_data.", VOMP_WRITE_AGAIN) from error
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        pickled = "Object arrays" in str(error)
        what = "holds pickled objects, which are not read." if pickled else "is no sound npz file."
        raise BadFileError(path, what, VOMP_WRITE_AGAIN) from error
    except (AttributeError, TypeError, IndexError) as error:  # an npy file: one array, no names
        raise BadFileError(path, "is no npz file.", VOMP_WRITE_AGAIN) from error
    missing = [n for n in ("x", "y", "z", *VOMP_COLUMNS.values()) if n not in (rows.dtype.names or ())]
    if missing:
        raise BadFileError(path, f"voxel_data has no {', '.join(missing)}.", VOMP_WRITE_AGAIN)
    rows = rows.reshape(-1)
    return SampledField(
        method="VoMP",
        path=path,
        position=np.stack([rows[axis].astype(float) for axis in "xyz"], axis=1),
        values={ours: rows[theirs].astype(float) for ours, theirs in VOMP_COLUMNS.items()},
    )


PIXIE_KINDS = ("jelly", "metal", "sand", "visplas", "fluid", "snow", "stationary", "background")
"""By material_id."""
PIXIE_COLUMNS = {"young_pa": "E", "poisson": "nu", "density": "density"}
PIXIE_FILE_NAMES = "mapped_preds.ply or world_mapped_preds.ply"


def read_pixie(path: Path) -> SampledField:
    """Read a file; points of the background are left out.

    Raises:
        BadFileError: It is damaged, lacks a column, or is the normalised prediction.
    """
    if path.suffix.lower() in (".npy", ".npz"):
        what = "is Pixie's normalised prediction, without places and units."
        raise BadFileError(path, what, f"Name {PIXIE_FILE_NAMES} instead.")
    rows = read_ply_elements(path, memoryview(path.read_bytes())).get("vertex", {})
    missing = [n for n in ("x", "y", "z", "material_id", *PIXIE_COLUMNS.values()) if n not in rows]
    if missing:
        raise BadFileError(path, f"its vertices have no {', '.join(missing)}.", f"Name {PIXIE_FILE_NAMES}.")
    number = rows["material_id"].astype(float)
    known = np.isin(number, range(len(PIXIE_KINDS)))
    if not known.all():
        what = f"{int((~known).sum())} points have a material_id that is none of 0 to 7."
        raise BadFileError(path, what, "Write it again with Pixie.")
    kind = np.array(PIXIE_KINDS)[number.astype(int)]
    there = kind != "background"
    return SampledField(
        method="Pixie",
        path=path,
        position=np.stack([rows[axis][there].astype(float) for axis in "xyz"], axis=1),
        values={ours: rows[theirs][there].astype(float) for ours, theirs in PIXIE_COLUMNS.items()},
        kind=kind[there],
    )


TABLE_COLUMNS = {"young_pa": "E", "poisson": "nu", "density": "density"}
TABLE_HEADER_HELP = "Its first line names the columns: x,y,z and any of E,nu,density (SI)."


def read_field_table(path: Path) -> SampledField:
    """Read a CSV file.

    Raises:
        BadFileError: A column is missing, or a cell is no number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = [[cell.strip() for cell in line] for line in csv.reader(file) if any(line)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadFileError(path, "is no CSV file in UTF-8.", TABLE_HEADER_HELP) from error
    names, body = (lines[0], lines[1:]) if lines else ([], [])
    columns = {ours: theirs for ours, theirs in TABLE_COLUMNS.items() if theirs in names}
    if not columns or not {"x", "y", "z"} <= set(names):
        raise BadFileError(path, "lacks columns.", TABLE_HEADER_HELP)
    rows = np.array([_line_numbers(path, k, line, len(names)) for k, line in enumerate(body, start=2)])
    rows = rows.reshape(-1, len(names))
    column = {name: rows[:, k] for k, name in enumerate(names)}
    return SampledField(
        method="the table",
        path=path,
        position=np.stack([column[axis] for axis in "xyz"], axis=1),
        values={ours: column[theirs] for ours, theirs in columns.items()},
    )


def _line_numbers(path: Path, number: int, line: list[str], width: int) -> list[float]:
    try:
        values = [float(cell) for cell in line]
    except ValueError as error:
        raise BadFileError(path, f"line {number} holds a cell that is no number.", TABLE_HEADER_HELP) from error
    if len(values) != width:
        raise BadFileError(path, f"line {number} has {len(values)} cells, not {width}.", TABLE_HEADER_HELP)
    return values


FIELD_READERS: Mapping[str, tuple[Callable[[Path], SampledField], str]] = {
    "vomp": (read_vomp, ".npz"),
    "pixie": (read_pixie, ".ply"),
    "table": (read_field_table, ".csv"),
}
"""Kind of a field → its reader, and what the name of its files ends in."""
FIELD_LETTERS = {"E": "young_pa", "nu": "poisson", "rho": "density"}
PHYSGAUSSIAN_UNIFORM = {"young_pa": 2e6, "poisson": 0.4, "density": 200.0}
"""PhysGaussian's config/ficus_config.json [SI]."""
OMNIPHYSGS_UNIFORM = {"young_pa": 2e6, "poisson": 0.4, "density": 1000.0}
"""OmniPhysGS: buffers of elasticity.py, which its training does not change [SI]."""
FIELD_SPECIFICATION_HELP = "Use one, one:E=2e6,nu=.4,rho=200, omniphysgs, vomp:PATH, pixie:PATH or table:PATH.csv."


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
            "one material", PHYSGAUSSIAN_UNIFORM | (_parse_field_numbers(spec, rest) if colon else {}), False
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
            raise UserError(f"--field {spec}: {pair!r} is not a valid number. {FIELD_SPECIFICATION_HELP}")
        found[name] = value
    return found
