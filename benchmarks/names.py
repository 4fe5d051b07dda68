"""Measure what a name and a plain shape become without a model: material, build, mass, warnings.

    python benchmarks/names.py [--list TOML] [--only NAME ...] [--json FILE] [--against FILE]
    python benchmarks/names.py --units

The list (recognition/names.toml) says of every thing what it may be made of and what it weighs in
life. Each is written to a GLB whose name is all that tells what it is, and goes through the same
functions as a run. ``--against`` names a file that ``--json`` wrote and prints what differs.
``--units`` writes every file in centimetres, inches and millimetres instead, as if it were in
metres, and prints the names about whose size and mass nothing is said.
"""

import argparse
import json
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
from recognition.shapes import shape
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from corporeal.core.types import Inventory, MaterialField, Parts, Scene
from corporeal.discretization.mesh_measures import MeasuredObject, measure_objects
from corporeal.discretization.object_masses import (
    warn_of_implausible_masses,
    warn_of_masses_not_as_named,
    warn_of_thick_walls,
)
from corporeal.discretization.part_model import PartModel
from corporeal.materials import find_material
from corporeal.pipeline.in_memory import load_scene
from corporeal.pipeline.mass_posterior import ground_with_mass_posterior
from corporeal.pipeline.settings import GroundConfig
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import part_models
from corporeal.pipeline.stages.segment import segment

LIST = Path(__file__).parent / "recognition" / "names.toml"
WITHIN = 2.5
"""Factor beyond the masses in life from which a mass is implausible."""
UP = trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0))
VERDICTS = ("right", "wrong", "unknown")
UNITS = {"centimetres": 0.01, "inches": 0.0254, "millimetres": 0.001}
"""Units of files that do not say so [m]."""


@dataclass(frozen=True)
class Found:
    """What came out of one name."""

    name: str
    material: str | None
    structure: str | None
    verdict: str
    mass: float
    """[kg]"""
    off: float
    """Factor from the nearer end of the masses in life; 1 inside, below 1 where too light."""
    warned: bool
    """Of its size, its mass or its wall."""
    false_alarm: bool
    """Said to be implausible although it weighs what such things do."""

    @property
    def implausible(self) -> bool:
        """Whether it weighs what no such thing does."""
        return not 1 / WITHIN <= self.off <= WITHIN

    @property
    def silent(self) -> bool:
        """Whether it is implausible, taken for known, and nothing is said."""
        return self.implausible and not self.warned and self.verdict != "unknown"


@dataclass(frozen=True)
class Weighed:
    """What the pipeline makes of one file."""

    scene: Scene
    anatomies: list[MeasuredObject]
    makes: dict[int, PartModel]
    field: MaterialField
    inventory: Inventory
    parts: Parts

    @property
    def masses(self) -> list[float]:
        """Of its parts [kg]."""
        return [self.makes[k].mass for k in sorted(self.makes)]

    @property
    def size(self) -> list[str]:
        """What is said of how large it is."""
        return [w for w in self.scene.warnings if "--extent" in w]

    @property
    def weight(self) -> list[str]:
        """What is said of how heavy it is."""
        told = (warn_of_implausible_masses, warn_of_masses_not_as_named)
        return [w for tell in told for w in tell(self.scene, self.anatomies, self.masses)]


def weigh(mesh: trimesh.Trimesh, path: Path, metres_per_unit: float = 1.0, from_pictures: bool = False) -> Weighed:
    """Write a mesh [m], upright along z, to a file and take it through the pipeline's functions.

    Args:
        mesh: Is left as it is.
        path: Of a GLB, whose name tells what it is.
        metres_per_unit: In which unit its file is, which does not say so.
        from_pictures: Its shape is its outside, as photographs show it.

    """
    written = mesh.copy().apply_transform(UP).apply_scale(1 / metres_per_unit)
    written.visual = TextureVisuals(material=PBRMaterial(name="material", metallicFactor=0.0))
    trimesh.Scene({"mesh": written}).export(path)
    scene = load_scene(path)
    inventory = describe(scene, from_pictures=[0] if from_pictures else ())
    parts = segment(scene, inventory)
    anatomies = measure_objects(scene, parts, 0)
    field, leaf = (ground_with_mass_posterior(scene, parts, inventory, GroundConfig()), find_material("leaf_tissue"))
    makes = part_models(scene, anatomies, field, leaf.pick(leaf.typical()), 0)
    return Weighed(scene, anatomies, makes, field, inventory, parts)


def look_at(row: dict, folder: Path, metres_per_unit: float = 1.0) -> Found:
    """Take one thing through the pipeline's functions by its name and shape alone.

    Args:
        row: Of the list.
        folder: Where its file is written.
        metres_per_unit: In which unit its file is, which does not say so.

    """
    seen = weigh(shape(row["shape"]), folder / f"{row['name']}.glb", metres_per_unit)
    words, mass = seen.field.words[0], sum(seen.masses)
    weight, size = seen.weight, seen.size
    wall = warn_of_thick_walls(seen.scene, seen.anatomies, seen.makes, seen.field)
    off = _off(mass, row["kg"])
    return Found(
        row["name"],
        words.material,
        words.structure,
        _verdict(words.material, row["of"].split()),
        mass,
        off,
        bool(weight or size or wall),
        bool(weight or (size and metres_per_unit == 1.0)) and off == 1.0,
    )


def _verdict(material: str | None, accepted: Sequence[str]) -> str:
    if material is None:
        return "unknown"
    return "right" if material in accepted else "wrong"


def _off(mass: float, life: Sequence[float]) -> float:
    low, high = life
    return mass / low if mass < low else mass / high if mass > high else 1.0


def main() -> None:
    """Measure every name of the list and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", type=Path, default=LIST)
    parser.add_argument("--only", nargs="+", help="these names alone")
    parser.add_argument("--json", type=Path, help="keep what was found in this file")
    parser.add_argument("--units", action="store_true", help="files in artists' units")
    parser.add_argument("--against", type=Path, help="print what differs from such a file")
    asked = parser.parse_args()
    rows = tomllib.loads(asked.list.read_text(encoding="utf-8"))["things"]
    rows = [r for r in rows if not asked.only or r["name"] in asked.only]
    if asked.units:
        print(in_wrong_units(rows))
        return
    with TemporaryDirectory() as folder:
        found = [look_at(row, Path(folder)) for row in rows]
    for one in found:
        print(_line(one))
    print(summary(found))
    if asked.json:
        asked.json.write_text(json.dumps([asdict(f) for f in found], indent=1, ensure_ascii=False))
    if asked.against:
        before = {row["name"]: Found(**row) for row in json.loads(asked.against.read_text())}
        differ = [f for f in found if f.name in before and _changed(before[f.name], f)]
        print("\n".join(f"- {_line(before[f.name])}\n+ {_line(f)}" for f in differ))


def in_wrong_units(rows: Sequence[dict]) -> str:
    """Say about which files in artists' units no warning is given."""
    lines = []
    for unit, metres in UNITS.items():
        with TemporaryDirectory() as folder:
            found = [look_at(row, Path(folder), metres) for row in rows]
        silent = [f.name for f in found if not f.warned]
        lines.append(f"in {unit}: nothing is said of {len(silent)} of {len(rows)}: {silent}")
    return "\n".join(lines)


def summary(found: Sequence[Found]) -> str:
    """Count verdicts, implausible masses and false alarms."""
    verdicts = ", ".join(f"{v} {sum(f.verdict == v for f in found)}" for v in VERDICTS)
    implausible = sum(f.implausible for f in found)
    return (
        f"{len(found)} names: {verdicts}; mass implausible {implausible}, of these known and "
        f"without a warning {sum(f.silent for f in found)}; false alarms "
        f"{sum(f.false_alarm for f in found)}; inside the masses in life "
        f"{sum(f.off == 1.0 for f in found)}"
    )


def _changed(before: Found, after: Found) -> bool:
    keys = ("material", "structure", "warned")
    same = all(getattr(before, k) == getattr(after, k) for k in keys)
    return not same or abs(before.mass / after.mass - 1) > 0.01


def _line(one: Found) -> str:
    marks = " SILENT" * one.silent + " FALSE ALARM" * one.false_alarm + " warned" * one.warned
    return (
        f"{one.name:24} {one.verdict:7} {one.material or '-':18} {one.structure or '-':7} "
        f"{one.mass:9.3g} kg, off x {one.off:.2g}{marks}"
    )


if __name__ == "__main__":
    main()
