"""Choice of grid spacing and discretization from the construction of parts and expected loads."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from corporeal.core.types import MaterialField, Scene
from corporeal.discretization.discretization_plan import (
    DetailLevel,
    DiscretizationPlan,
    QualityPreset,
    plan_discretization,
)
from corporeal.discretization.filled_shells import part_as_contents
from corporeal.discretization.foliage import count_leaves, is_leafy
from corporeal.discretization.impact_speeds import expected_motions
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.part_geometry import PartGeometry
from corporeal.discretization.part_model import PartModel, plate_as_wall, plate_thickness
from corporeal.discretization.prescribed_compression import compression_pressures
from corporeal.discretization.rods import Rod
from corporeal.mpm.laws import CONSTITUTIVE_LAWS


@dataclass(frozen=True)
class SimulationAccuracy:
    """What a simulation is to be worth."""

    detail: DetailLevel | QualityPreset
    stiffness: Literal["true", "capped"]
    seed: int
    shells: bool = False
    """Whether deformable walls are triangle shells with their true thickness."""


@dataclass(frozen=True)
class MeasuredScene:
    """The objects of a scene as measured, and how their parts are made."""

    scene: Scene
    field: MaterialField
    anatomies: list[MeasuredObject]
    """One per object."""
    makes: Mapping[int, PartModel]
    """Of each part."""
    rods: Mapping[int, Rod]
    """Of each part that is a solid rod."""
    vessels: Mapping[int, int]
    """Of each object that lies loose in another, that other."""


def choose_resolution(bodies: MeasuredScene, accuracy: SimulationAccuracy) -> tuple[MeasuredScene, DiscretizationPlan]:
    """Choose grid spacing and treatments, and make walls of thin plates.

    A plate thinner than two cells is a wall, whoever called it solid; with it the cell may grow,
    so that other plates become thin.

    Returns:
        The bodies with their plates as walls; grid spacing and treatments.
    """
    chosen = _plan_scene(bodies, accuracy)
    while thin := thin_plate_thicknesses(bodies, chosen, accuracy.seed):
        walls = {k: plate_as_wall(bodies.makes[k], thickness) for k, thickness in thin.items()}
        bodies = replace(bodies, makes={**bodies.makes, **walls})
        chosen = _plan_scene(bodies, accuracy)
    return bodies, chosen


def _plan_scene(bodies: MeasuredScene, accuracy: SimulationAccuracy) -> DiscretizationPlan:
    anatomies = enumerate(bodies.anatomies)
    geometries = {m.part: _part_geometry(m, bodies, n) for n, a in anatomies for m in a.members}
    if accuracy.shells:
        calm = [obj.wind is None for obj in bodies.scene.objects]
        geometries = {
            k: replace(g, thin_shell=calm[g.object] and is_thin_shell(bodies.makes[k], g))
            for k, g in geometries.items()
        }
    ordered = add_compression_strain(bodies, [geometries[k] for k in sorted(geometries)], accuracy.seed)
    masses = [sum(bodies.makes[m.part].mass for m in a.members) for a in bodies.anatomies]
    moved = expected_motions(bodies.scene, bodies.anatomies, masses, accuracy.seed, bodies.vessels)
    return plan_discretization(ordered, moved, accuracy.detail, accuracy.stiffness, bodies.field.floor)


def add_compression_strain(bodies: MeasuredScene, parts: list[PartGeometry], seed: int) -> list[PartGeometry]:
    """Add the strain that prescribed motion forces on parts.

    The parts of an object share its pressure: the stiffer a part, the less it strains.

    Args:
        bodies: As measured.
        parts: All of the scene's, of which the strain is not known.
        seed: Of the points by which gaps are measured.
    """
    compliances = [0.0] * len(bodies.anatomies)
    volumes = [0.0] * len(compliances)
    for part in parts:
        compliances[part.object] += part.volume / mean_stiffness(part)
        volumes[part.object] += part.volume
    whole = [c / max(v, 1e-30) for c, v in zip(compliances, volumes, strict=True)]
    found = compression_pressures(bodies.scene, bodies.anatomies, whole, seed)
    return [replace(p, pressed=found[p.object] / mean_stiffness(p)) for p in parts]


def mean_stiffness(part: PartGeometry) -> float:
    """E of a part as a whole [Pa]: of what fills it, or of a wall by its share of the volume."""
    inside = part_as_contents(part)
    if inside.structure.kind != "shell" or part.volume <= 0.0:
        return max(inside.material.young_pa, 1.0)
    share = part.narrowing * part.area * (part.structure.thickness or 0.0) / part.volume
    return max(part.material.young_pa * min(1.0, share), 1.0)


def _part_geometry(member: MeasuredPart, bodies: MeasuredScene, number: int) -> PartGeometry:
    """Collect what the treatment policy needs to know of a part of object ``number``."""
    obj, k = bodies.scene.objects[number], member.part
    made, material = bodies.makes[k], bodies.field.materials[k]
    return PartGeometry(
        object=number,
        material=replace(material, density=made.density),
        structure=made.structure,
        size=(max(member.size[0], made.sheet), member.size[1], member.size[2]),
        volume=made.volume,
        area=made.area,
        narrowing=wall_narrowing(made),
        closed=is_closed_about(member, made),
        leaves=count_leaves(member, material, made, obj.scale),
        diameter=bodies.rods[k].diameter if k in bodies.rods else 0.0,
        burden=foliage_burden(member, bodies.anatomies[number], bodies),
        scale=obj.scale,
        prescribed=obj.path is not None,
    )


def is_thin_shell(made: PartModel, part: PartGeometry) -> bool:
    """Whether a part is nothing but a wall around air, or a sheet, of a material that keeps its shape."""
    keeps = not CONSTITUTIVE_LAWS[part.material.law].loose
    wall = made.structure.kind == "shell" and bool(made.structure.thickness) and made.structure.contents is None
    return keeps and wall and made.held is None and not made.structure.holds and part.leaves == 0


def thin_plate_thicknesses(bodies: MeasuredScene, chosen: DiscretizationPlan, seed: int) -> dict[int, float]:
    """Thickness of each solid part that bends and is a plate thinner than two cells [m]."""
    found = {}
    members = (m for a in bodies.anatomies for m in a.members)
    for member in (m for m in members if m.part not in bodies.rods):
        if chosen.treatments[member.part].kind != "deformable":
            continue
        rng = np.random.default_rng([seed, member.part, 6])
        thickness = plate_thickness(member, bodies.makes[member.part], rng)
        if 0 < thickness < 2 * chosen.cell:
            found[member.part] = thickness
    return found


def is_closed_about(member: MeasuredPart, made: PartModel) -> bool:
    """Whether a part cannot bend without stretching, as what closes about something cannot."""
    if made.modelled:
        return False
    return member.encloses if made.thickness else member.closed


def wall_narrowing(made: PartModel) -> float:
    """Volume of a part's wall over its area times its thickness [-]."""
    thin = made.density * made.area * made.thickness
    return (made.body_mass + made.sheet_mass) / thin if thin > 0.0 else 1.0


def foliage_burden(member: MeasuredPart, anatomy: MeasuredObject, bodies: MeasuredScene) -> float:
    """Mass of the foliage of an object over that of one of its other parts [-]."""
    leafy = [m.part for m in anatomy.members if is_leafy(bodies.field.materials[m.part])]
    if member.part in leafy:
        return 0.0
    makes = bodies.makes
    return sum(makes[k].mass for k in leafy) / max(makes[member.part].mass, 1e-30)
