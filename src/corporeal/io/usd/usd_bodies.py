"""Physics of USD stages: all data of files written here, UsdPhysics of others.

Meshes are read elsewhere (``mesh_usd.py``); here is what objects weigh, how they move and what they are made of, each
value with who stated it.
"""

# usd-core is optional, and comes without types.
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from corporeal.core.errors import BadFileError, UserError

CUSTOM_DATA_KEY = "corporeal"
"""Name of our own customData."""
FIELD_OF_PHYSICS_ATTRIBUTE = {"density": "density", "dynamicFriction": "friction", "restitution": "restitution"}
"""Attribute of PhysicsMaterialAPI → field of ``Material``."""
BODY_SCHEMAS = {"PhysicsRigidBodyAPI", "PhysicsDeformableBodyAPI"}
USD_EXPORT_ADVICE = "Export it again as USD."


@dataclass(frozen=True)
class StatedValue:
    """One number of a material, and why it is what it is."""

    value: float
    """SI."""
    source: str
    """Who measured or stated it."""
    range: tuple[float, float] | None = None
    """Measured interval, SI; None: the file names none."""
    chosen_by: str = "annotation"
    reason: str = ""
    margin: float = 1.0
    """How sure the material is: 0 (a guess) to 1 (stated outright)."""


@dataclass(frozen=True)
class StatedMaterial:
    """A material of the stage."""

    path: str
    """Of its prim."""
    name: str
    """Of the material in our library where the file names one; else the prim's own."""
    values: Mapping[str, StatedValue] = field(default_factory=dict)
    """Field of ``Material`` → value."""
    custom: Mapping[str, Any] = field(default_factory=dict)
    """Data on the part in files written here; empty for other files."""


@dataclass(frozen=True)
class StatedBody:
    """A rigid or deformable body of the stage."""

    path: str
    """Of its prim."""
    title: str
    """As people call it."""
    mass: float | None
    """[kg]; None: its density or its material says."""
    materials: tuple[StatedMaterial, ...]
    """Bound to it or to what is below it, each once."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of a rigid body [m/s], along the axes of the stage."""
    turns: bool = False
    """Whether it has an angular velocity."""
    custom: Mapping[str, Any] = field(default_factory=dict)
    """Data on the object in files written here; empty for other files."""


def read_usd_physics(path: str | Path) -> tuple[StatedBody, ...]:
    """Read every body of a stage.

    Args:
        path: A USD file; units of length and mass are those that it states.

    Raises:
        BadFileError: It cannot be read.
        UserError: The library is not installed.
    """
    try:
        from pxr import Tf, Usd
    except ImportError as error:
        raise UserError("Reading USD needs usd-core. Install it with: pip install 'corporeal[export]'.") from error
    path = Path(path)
    if not path.is_file():
        raise BadFileError(path, "there is no such file.", "Check the path.")
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise BadFileError(path, "cannot be read as USD.", USD_EXPORT_ADVICE) from error
    return read_stage_bodies(stage, path)


def read_stage_bodies(stage: Any, path: Path) -> tuple[StatedBody, ...]:
    """Read every body of a stage that is open; ``path`` is what it is called."""
    units = _StageUnits.of(stage)
    return tuple(_body(prim, path, units) for prim in _bodies(stage))


def custom_data_of(prim: Any) -> dict[str, Any]:
    """Return what our own writer says at a prim; empty in other files."""
    custom = prim.GetCustomDataByKey(CUSTOM_DATA_KEY) if prim else None
    return _as_plain_data(custom) if isinstance(custom, Mapping) else {}


def physical_material(prim: Any, path: Path, stage: Any) -> StatedMaterial | None:
    """Return the physical material that is bound to a prim, or to all about it."""
    from pxr import UsdShade

    bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0]
    if bound and "PhysicsMaterialAPI" in bound.GetPrim().GetAppliedSchemas():
        return _material(bound.GetPrim(), path, _StageUnits.of(stage))
    return None


def _as_plain_data(value: Any) -> Any:
    """Turn what OpenUSD returns into dictionaries, lists and numbers."""
    if isinstance(value, Mapping):
        return {str(k): _as_plain_data(v) for k, v in value.items()}
    if isinstance(value, str | bool | int | float):
        return value
    return [_as_plain_data(v) for v in value] if hasattr(value, "__iter__") else str(value)


@dataclass(frozen=True)
class _StageUnits:
    mass: float
    """[kg]"""
    density: float
    """[kg/m³]"""
    length: float
    """[m]"""

    @classmethod
    def of(cls, stage: Any) -> "_StageUnits":
        from pxr import UsdGeom, UsdPhysics

        mass, length = (UsdPhysics.GetStageKilogramsPerUnit(stage), UsdGeom.GetStageMetersPerUnit(stage))
        return cls(mass, mass / length**3, length)


def _bodies(stage: Any) -> Iterator[Any]:
    for prim in stage.Traverse():
        listed = prim.GetMetadata("apiSchemas")  # also those that OpenUSD does not know yet
        if listed and not BODY_SCHEMAS.isdisjoint(listed.GetAppliedItems()):
            yield prim


def _body(prim: Any, path: Path, units: _StageUnits) -> StatedBody:
    mass = _number(prim, "physics:mass")  # 0: unset
    found: dict[str, StatedMaterial] = {}
    for material in _materials(prim):
        found.setdefault(str(material.GetPath()), _material(material, path, units))
    x, y, z = (units.length * v for v in _read_vector(prim, "physics:velocity"))
    return StatedBody(
        path=str(prim.GetPath()),
        title=prim.GetDisplayName() or prim.GetName(),
        mass=mass and mass * units.mass,
        materials=tuple(found.values()),
        velocity=(x, y, z),
        turns=any(_read_vector(prim, "physics:angularVelocity")),
        custom=custom_data_of(prim),
    )


def _materials(prim: Any) -> Iterator[Any]:
    """Yield the prims of all physical materials at a body and below it."""
    from pxr import Usd, UsdShade

    for below in Usd.PrimRange(prim):
        bound = UsdShade.MaterialBindingAPI(below).ComputeBoundMaterial("physics")[0]
        if bound and "PhysicsMaterialAPI" in bound.GetPrim().GetAppliedSchemas():
            yield bound.GetPrim()


def _material(prim: Any, path: Path, units: _StageUnits) -> StatedMaterial:
    custom = custom_data_of(prim)
    if isinstance(custom.get("values"), Mapping):
        return _ours(prim, custom)
    source = f"stated by UsdPhysics in {path.name}"
    values = {}
    for attribute, name in FIELD_OF_PHYSICS_ATTRIBUTE.items():
        value = _number(prim, f"physics:{attribute}")
        if value:
            scaled = value * (units.density if name == "density" else 1.0)
            values[name] = StatedValue(scaled, source)
    return StatedMaterial(str(prim.GetPath()), prim.GetDisplayName() or prim.GetName(), values)


def _ours(prim: Any, custom: Mapping[str, Any]) -> StatedMaterial:
    """Read what we wrote: every value with range, source, chooser and reason."""
    values = {}
    for name, row in custom["values"].items():
        low, high = row["range"]
        values[name] = StatedValue(
            value=row["value"],
            source=row["source"],
            range=(low, high),
            chosen_by=row["chosen_by"],
            reason=row.get("reason", ""),
            margin=row.get("margin", 1.0),
        )
    return StatedMaterial(str(prim.GetPath()), custom["material"], values, custom)


def _number(prim: Any, name: str) -> float | None:
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    if isinstance(value, int | float) and isfinite(value) and value > 0:
        return float(value)
    return None


def _read_vector(prim: Any, name: str) -> tuple[float, float, float]:
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    numbers = [float(v) for v in value] if value is not None else []
    good = len(numbers) == 3 and all(map(isfinite, numbers))
    return (numbers[0], numbers[1], numbers[2]) if good else (0.0, 0.0, 0.0)
