"""Masses of material points, and removal of overlaps between objects."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from corporeal.core.types import Discretization
from corporeal.discretization.cavity import is_vessel
from corporeal.discretization.foliage import crown_volume
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.object_filling import ObjectFilling, reference_points
from corporeal.discretization.part_model import PartModel, is_porous_shell
from corporeal.discretization.point_filling import match_moments

MAX_UNMESHED_WALL_FRACTION = 0.1
"""The material of a shell's triangles may differ from the part's by this share without a word [-]."""


def remove_mixed_points(
    packings: list[ObjectFilling], cell: float, together: Collection[tuple[int, int]] = ()
) -> list[ObjectFilling]:
    """Remove points of one object that lie among another's; masses are set afterwards.

    Args:
        packings: One per object.
        cell: dx [m].
        together: Vessels and what is in them, which their true surfaces keep apart.
    """
    result = list(packings)
    for i in range(len(result)):
        for j in range(i):
            if (j, i) in together:
                continue
            more, less = (i, j) if len(result[i].points) >= len(result[j].points) else (j, i)
            tree = KDTree(result[less].points)
            gap = tree.query(result[more].points, distance_upper_bound=cell / 4)[0]
            mixed = np.isfinite(gap) & ~result[more].is_vertex
            if mixed.any():
                result[more] = result[more].only(~_keep_one_point(mixed, result[more].part))
    return result


def _keep_one_point(mixed: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Leave every part at least one point."""
    mixed = mixed.copy()
    for k in np.unique(part):
        own = np.flatnonzero(part == k)
        if mixed[own].all():
            mixed[own[0]] = False
    return mixed


def warn_of_unmeshed_walls(
    packings: Sequence[ObjectFilling], makes: Mapping[int, PartModel], treatments: Sequence[Discretization]
) -> Iterator[str]:
    """Warn where the triangles of a shell hold another amount of material than the part, whose mass they bear."""
    for number, packing in enumerate(packings):
        for part in np.unique(packing.part[packing.is_vertex]).tolist():
            made, laid = makes[part], float(packing.volumes[packing.part == part].sum())
            share = laid * treatments[part].density / (made.body_mass + made.sheet_mass)
            if abs(share - 1.0) > MAX_UNMESHED_WALL_FRACTION:
                yield (
                    f"Object {number + 1} of the scene: the triangles of a thin wall hold {share:.2g} of its material, "
                    "and its whole mass is spread over them: where it is thick or joined it is not as in reality."
                )


def weigh_points(
    anatomy: MeasuredObject,
    packing: ObjectFilling,
    makes: Mapping[int, PartModel],
    treatments: Sequence[Discretization],
    cell: float,
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Volume [m³] and simulated density [kg/m³] of every point of an object.

    A thickened wall keeps the treatment's density, so its volume follows from its mass; a solid keeps its true volume;
    foliage fills its crown's; what is filled is as dense in the middle as its contents. A rigid part's masses are
    adjusted to its true centre and inertia.
    """
    volume, density = np.zeros(len(packing.points)), np.ones(len(packing.points))
    rng = np.random.default_rng(4)
    for member in anatomy.members:
        made, treatment = makes[member.part], treatments[member.part]
        own = np.flatnonzero(packing.part == member.part)
        points, volumes = packing.points[own], packing.volumes[own]
        mass = _share_part_mass(volumes, packing.sheet[own], made)
        whole = np.zeros(0)
        if made.held:
            mass, whole = _held_masses_and_volumes(anatomy, member, packing.only(own), made, cell)
        if treatment.kind == "rigid":
            mass = match_moments(points, mass, *_true_mass_points(anatomy, member, made, rng))
        if made.held:
            density[own] = mass / whole
        elif treatment.kind == "foliage":
            density[own] = mass.sum() / crown_volume(points, cell)
        else:
            density[own] = mass.sum() / _simulated_volume(member, made, treatment, mass.sum(), cell)
        volume[own] = mass / density[own]
    return volume, density


def _simulated_volume(
    member: MeasuredPart, made: PartModel, treatment: Discretization, mass: float, cell: float
) -> float:
    """Volume of a part as simulated [m³]: what is thickened takes up more than in reality."""
    thickened = treatment.kind == "shell" and not (
        made.thickness > 0 and not made.modelled and is_porous_shell(member, cell)
    )
    thin = treatment.kind == "deformable" and treatment.density < 0.999 * mass / made.volume
    return mass / treatment.density if thickened or thin else made.volume


def _true_mass_points(
    anatomy: MeasuredObject, member: MeasuredPart, made: PartModel, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "M 3"], Float[np.ndarray, " M"]]:
    """Points spread as a part's material truly is, and their masses [kg]."""
    one_face = made.thickness if not made.modelled else 0.0
    body, sheets = reference_points(anatomy, member, one_face, rng)
    groups = [(body, made.body_mass), (sheets, made.sheet_mass)]
    groups += [(made.held.lies, made.held.mass)] if made.held else []
    weights = [np.full(len(p), mass / max(len(p), 1)) for p, mass in groups]
    return np.concatenate([p for p, _ in groups]), np.concatenate(weights)


def _held_masses_and_volumes(
    anatomy: MeasuredObject, member: MeasuredPart, packing: ObjectFilling, made: PartModel, cell: float
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Mass [kg] and volume [m³] of a filled part's points: wall and contents apart.

    Behind a closed surface the outermost points bear the wall, at least half a cell deep, and all below the level what
    lies there; of a vessel those between its faces do. What is inflated is one solid.
    """
    assert made.held is not None
    points, volumes = packing.points, packing.volumes
    low = points[:, 2] <= max(made.held.level, points[:, 2].min())
    if is_vessel(member):
        wall = packing.sheet.copy()
        if anatomy.shape is not None:
            wall |= anatomy.shape.inside(points)
        low, room = ~wall, made.held.room
        parts = [(wall, made.volume - room), (low, room * made.held.fill)]
        least = 1e-9 * made.volume
        whole = _spread_totals(volumes, [_PointTotal(m, max(v, least)) for m, v in parts if m.any()])
    else:
        depth = member.shape.closest(points)[0]
        wall = depth <= max(made.thickness, 0.5 * cell, depth.min())
        whole = _spread_totals(volumes, [_PointTotal(np.ones(len(points), dtype=bool), made.volume)])
    if made.structure.inflated:
        return _spread_totals(volumes, [_PointTotal(np.ones(len(points), dtype=bool), made.mass)]), whole
    loads = [(wall, made.body_mass + made.sheet_mass), (low, made.held.mass)]
    mass = _spread_totals(volumes, [_PointTotal(m if m.any() else ~m, load) for m, load in loads])
    return np.maximum(mass, 1e-6 * made.mass / len(mass)), whole


@dataclass(frozen=True)
class _PointTotal:
    """What some points bear together."""

    mask: Bool[np.ndarray, " N"]
    value: float
    """Mass [kg] or volume [m³]."""


def _spread_totals(volumes: np.ndarray, totals: list[_PointTotal]) -> np.ndarray:
    """Spread each total over the points of its mask, in proportion to their volumes."""
    found = np.zeros(len(volumes))
    for total in totals:
        own = volumes[total.mask]
        found[total.mask] += total.value * own / own.sum()
    return found


def _share_part_mass(volumes: np.ndarray, sheet: np.ndarray, made: PartModel) -> np.ndarray:
    """Spread a part's mass over its points; what has no points of its own goes to the others."""
    mass = np.zeros(len(volumes))
    for these, total in ((~sheet, made.body_mass), (sheet, made.sheet_mass)):
        if these.any():
            mass[these] = total * volumes[these] / volumes[these].sum()
    return mass * (made.body_mass + made.sheet_mass) / mass.sum()
