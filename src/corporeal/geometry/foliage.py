"""Leaves and roots: how fast a leaf swings, how large a crown is, where wood meets its soil."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.geometry.anatomy import pieces
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.survey import Anatomy, Member
from corporeal.types import Law, Material, Root, Vector

Inertia = Callable[[int, Vector], float]

LEAFY = ("leaves-flowers", "leaf_tissue")
"""Materials that leaves are made of."""
LONGEST_LEAF = 0.15
"""A longer piece stands for many leaves [m]."""
CENTROID = 0.4
"""Shift of a leaf's centre over that of its tip."""
ROCKING = 0.34
"""k_θ/(E h³) of a stem in soil to a depth h (measured on resolved soil, at one geometry)."""
PIVOT = 0.4
"""Height above its foot about which a stem rocks, over its depth in the soil."""


def leaves_of(member: Member, material: Material) -> int:
    """How many separate leaves a part is; 0: it is no foliage."""
    if material.name not in LEAFY:
        return 0
    return sum(int(pieces(m).max()) + 1 for m in (member.body, member.sheet) if len(m.triangles))


def swinging(
    member: Member, points: Float[np.ndarray, "N 3"], tissue: Material, scale: float
) -> Float[np.ndarray, " N"]:
    """Natural angular frequency of the leaf that each point belongs to [rad/s].

    A cantilever of length L and thickness t under its own weight: its centre shifts by
    C a = .4 · 1.5 ρ L⁴/(E t²) a in an acceleration a, and ω = 1/√C.

    Args:
        member: The foliage.
        points: [m]
        tissue: What leaves are made of.
        scale: Scene size over real size: t and the longest leaf are real lengths.

    """
    assert tissue.shell_thickness is not None
    middles, lengths = [], []
    for mesh in (member.body, member.sheet):
        if len(mesh.triangles):
            middles.append(mesh.corners.mean(axis=1))
            lengths.append(lengths_of_pieces(mesh))
    nearest = KDTree(np.concatenate(middles)).query(points)[1]
    length = np.minimum(np.concatenate(lengths)[nearest], LONGEST_LEAF * scale)
    stiffness = tissue.young * (tissue.shell_thickness * scale) ** 2
    return np.sqrt(stiffness / (1.5 * CENTROID * tissue.density)) / length**2


def lengths_of_pieces(mesh: Mesh) -> Float[np.ndarray, " T"]:
    """Length of the piece that each triangle belongs to [m], from end to end."""
    label = np.repeat(pieces(mesh), 3)
    corner = mesh.corners.reshape(-1, 3)
    count = np.bincount(label)
    middle = np.stack([np.bincount(label, x) / count for x in corner.T], axis=1)
    out = np.linalg.norm(corner - middle[label], axis=1)
    order = np.lexsort((out, label))
    end = corner[order[np.cumsum(count) - 1]]  # of each piece, what is farthest out
    length = np.zeros(len(count))
    np.maximum.at(length, label, np.linalg.norm(corner - end[label], axis=1))
    return length[label[::3]]


def crown_volume(points: Float[np.ndarray, "N 3"], cell: float) -> float:
    """Volume of the cells that have leaves in them [m³]."""
    return len(np.unique(np.floor(points / cell).astype(np.int64), axis=0)) * cell**3


def rooted(anatomy: Anatomy, materials: tuple[Material, ...]) -> tuple[int, int] | None:
    """Wood and the soil it stands in, as numbers of parts; None: nothing stands in soil.

    The wood's foot is in the soil, and it rises above it.
    """
    spans = {m.part: span(m) for m in anatomy.members}
    for soil in (k for k in spans if materials[k].law is Law.DRUCKER_PRAGER):
        low, high = spans[soil]
        for wood, (foot, top) in spans.items():
            if wood != soil and low < foot < high < top and materials[wood].name not in LEAFY:
                return wood, soil
    return None


def span(member: Member) -> tuple[float, float]:
    """Lowest and highest point [m]."""
    z = np.concatenate([m.corners.reshape(-1, 3)[:, 2] for m in (member.body, member.sheet)])
    return float(z.min()), float(z.max())


def root_of(
    anatomy: Anatomy, number: int, materials: tuple[Material, ...], inertia_about: Inertia
) -> Root | None:
    """Return the sprung joint of a plant in its soil; None where it stands in none.

    k_θ = .34 E h³ with the depth h of the foot in the soil; the damper takes the soil's loss
    factor at the swing's own frequency, c = η √(k I).

    Args:
        anatomy: The plant.
        number: Of the object.
        materials: Of all parts.
        inertia_about: Gives the moment of inertia of all that swings about a point [kg m²].

    """
    found = rooted(anatomy, materials)
    if found is None:
        return None
    wood, soil = found
    member = next(m for m in anatomy.members if m.part == wood)
    foot = span(member)[0]
    depth = span(next(m for m in anatomy.members if m.part == soil))[1] - foot
    corner = np.concatenate([member.body.corners, member.sheet.corners]).reshape(-1, 3)
    x, y = corner[corner[:, 2] < foot + depth, :2].mean(axis=0)
    point = (float(x), float(y), foot + PIVOT * depth)
    stiffness = ROCKING * materials[soil].young * depth**3
    damping = materials[soil].loss * float(np.sqrt(stiffness * inertia_about(wood, point)))
    return Root(number, wood, point, stiffness, damping)
