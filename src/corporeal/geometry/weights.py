"""Every point's share of its part's mass, and no point of one object among another's."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.geometry.filling import match_moments
from corporeal.geometry.foliage import crown_volume
from corporeal.geometry.make import Make, is_porous
from corporeal.geometry.packing import Packing, reference
from corporeal.geometry.survey import Anatomy
from corporeal.types import Treatment


def keep_apart(packings: list[Packing], cell: float) -> list[Packing]:
    """Remove points of one object that lie among another's; masses are set afterwards."""
    result = list(packings)
    for i in range(len(result)):
        for j in range(i):
            more, less = (i, j) if len(result[i].points) >= len(result[j].points) else (j, i)
            tree = KDTree(result[less].points)
            gap = tree.query(result[more].points, distance_upper_bound=cell / 4)[0]
            mixed = np.isfinite(gap)
            if mixed.any():
                result[more] = result[more].only(~_spare(mixed, result[more].part))
    return result


def _spare(mixed: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Leave every part at least one point."""
    mixed = mixed.copy()
    for k in np.unique(part):
        own = np.flatnonzero(part == k)
        if mixed[own].all():
            mixed[own[0]] = False
    return mixed


def weigh(
    anatomy: Anatomy,
    packing: Packing,
    makes: Mapping[int, Make],
    treatments: Sequence[Treatment],
    cell: float,
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Volume [m³] and simulated density [kg/m³] of every point of an object.

    A thickened wall keeps the treatment's density, so its volume follows from its mass; a solid
    keeps its true volume; foliage fills its crown's. A rigid part's masses are adjusted to its true
    centre and inertia.
    """
    volume, density = np.zeros(len(packing.points)), np.ones(len(packing.points))
    rng = np.random.default_rng(4)
    for member in anatomy.members:
        made, treatment = makes[member.part], treatments[member.part]
        own = np.flatnonzero(packing.part == member.part)
        thickened = treatment.kind == "shell" and not (
            made.thickness > 0 and not made.modelled and is_porous(member, cell)
        )
        mass = _shared(packing.volumes[own], packing.sheet[own], made)
        if treatment.kind == "rigid":
            one_face = made.thickness if not made.modelled else 0.0
            body, sheets = reference(anatomy, member, one_face, rng)
            wanted = np.concatenate([body, sheets])
            weights = np.concatenate(
                [
                    np.full(len(body), made.body_mass / max(len(body), 1)),
                    np.full(len(sheets), made.sheet_mass / max(len(sheets), 1)),
                ]
            )
            mass = match_moments(packing.points[own], mass, wanted, weights)
        whole = mass.sum() / treatment.density if thickened else made.volume
        if treatment.kind == "deformable" and treatment.density < 0.999 * mass.sum() / whole:
            whole = mass.sum() / treatment.density  # a rod thicker than in life
        if treatment.kind == "foliage":
            whole = crown_volume(packing.points[own], cell)
        density[own] = mass.sum() / whole
        volume[own] = mass / density[own]
    return volume, density


def _shared(volumes: np.ndarray, sheet: np.ndarray, made: Make) -> np.ndarray:
    """Spread a part's mass over its points; what has no points of its own goes to the others."""
    mass = np.zeros(len(volumes))
    for these, total in ((~sheet, made.body_mass), (sheet, made.sheet_mass)):
        if these.any():
            mass[these] = total * volumes[these] / volumes[these].sum()
    return mass * (made.body_mass + made.sheet_mass) / mass.sum()
