"""Foliage and roots: leaf area, natural frequency of leaves, anchorage in the soil."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.core.types import Material, MaterialField, Particles, PlantRoot, Scene, Structure, Vector
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.part_model import PartModel
from corporeal.geometry.connected_components import connected_pieces
from corporeal.geometry.mesh import Mesh
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

InertiaAbout = Callable[[int, Vector], float]

LEAF_MATERIALS = ("leaves-flowers", "leaf_tissue")
"""Materials that leaves are made of."""
WOOD_MATERIALS = ("wood", "hardwood", "softwood", "bamboo")
"""Materials that trunks and stems are made of."""
MAX_LEAF_LENGTH_M = 0.15
"""A longer piece stands for many leaves [m]."""
USUAL_LEAF_LENGTH_M = 0.08
"""Length of a leaf on the border of Webb's (1959) microphylls and notophylls, 20 cm² [m]."""
MAX_LEAF_THICKNESS_M = 3e-3
"""What is thicker in the mean is more than one leaf, even as leaves are drawn [m]."""
LEAF_AREA_PER_CROWN_SURFACE = 0.75
"""Area of leaves over that of the surface that pictures make of a crown: half where a leaf shows both its faces, all
where it covers others."""
MAX_LEAF_FREQUENCY_RAD_S = 300.0
"""Springs are no stiffer [rad/s]: a leaf's own weight moves them by a tenth of a millimetre."""
LEAF_CENTRE_SHIFT_RATIO = 0.4
"""Shift of a leaf's centre over that of its tip."""
ROOT_STIFFNESS_COEFFICIENT = 0.34
"""k_θ/(E h³) of a stem in soil to a depth h (measured on resolved soil, at one geometry)."""
MAX_WOOD_GAP_FRACTION = 0.1
"""Wood begins no farther above its soil, of its height above it."""
ROCKING_PIVOT_DEPTH_RATIO = 0.4
"""Height above its foot about which a stem rocks, over its depth in the soil."""


def is_leafy(material: Material) -> bool:
    """Whether leaves are made of it."""
    return material.name in LEAF_MATERIALS


def count_leaves(member: MeasuredPart, material: Material, made: PartModel, scale: float) -> int:
    """How many leaves a part is; 0: it is no foliage.

    Pieces of its mesh; of a crown in bulk, leaves of the usual size, L²/3, that have its area.
    """
    if not is_leafy(material):
        return 0
    if made.leaves:
        return round(made.leaves / ((USUAL_LEAF_LENGTH_M * scale) ** 2 / 3))
    return sum(int(connected_pieces(m).max()) + 1 for m in (member.body, member.sheet) if len(m.triangles))


def is_bulk_foliage(member: MeasuredPart, scale: float) -> bool:
    """Whether foliage's surface does not show one leaf from another.

    Pictures, and coarse models, show a crown as one body of thickened and joined leaves: most of its surface is in
    pieces longer than a leaf is, and thicker.
    """
    if not len(member.body.triangles):
        return False
    if 2 * member.volume < MAX_LEAF_THICKNESS_M * scale * member.body_area:
        return False
    long = mesh_piece_lengths(member.body) > MAX_LEAF_LENGTH_M * scale
    return float(member.body.areas @ long) > 0.5 * member.body_area


def weigh_bulk_foliage(
    made: PartModel, anatomy: MeasuredObject, member: MeasuredPart, field: MaterialField, tissue: Material, scale: float
) -> PartModel:
    """Weigh a crown in bulk by the area of its leaves, m = ρ t A, and not by its volume.

    A is three quarters of its surface: half of it where every leaf shows both its faces, all where
    each covers others. Thickness and density are those stated for its walls, else a usual
    leaf's. What nothing bears is no crown.
    """
    material, k = field.materials[member.part], member.part
    borne = not all(is_leafy(field.materials[m.part]) for m in anatomy.members)
    alone = borne and is_leafy(material) and not made.pieces and not made.held
    if not alone or not is_bulk_foliage(member, scale):
        return made
    assert tissue.shell_thickness is not None
    thick = field.words[k].thickness or field.structures[k].thickness or material.shell_thickness
    density = material.density if thick else tissue.density
    thick = thick or tissue.shell_thickness * scale
    area = LEAF_AREA_PER_CROWN_SURFACE * member.body_area
    mass, open_mass = density * thick * area, density * thick * member.sheet_area
    return replace(
        made,
        structure=Structure("solid"),
        modelled=False,
        thickness=0.0,
        sheet=thick,
        body_mass=mass,
        sheet_mass=open_mass,
        volume=member.volume,
        density=(mass + open_mass) / member.volume,
        leaves=area + member.sheet_area,
    )


def leaf_frequencies(
    member: MeasuredPart, points: Float[np.ndarray, "N 3"], tissue: Material, scale: float
) -> Float[np.ndarray, " N"]:
    """Natural angular frequency of the leaf that each point belongs to [rad/s].

    A cantilever of length L and thickness t under its own weight: its centre shifts by
    C a = .4 · 1.5 ρ L⁴/(E t²) a in an acceleration a, and ω = 1/√C. In a crown in bulk all are of
    the usual length.

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
            lengths.append(mesh_piece_lengths(mesh))
    nearest = KDTree(np.concatenate(middles)).query(points)[1]
    length = np.minimum(np.concatenate(lengths)[nearest], MAX_LEAF_LENGTH_M * scale)
    if is_bulk_foliage(member, scale):
        length[:] = USUAL_LEAF_LENGTH_M * scale
    stiffness = tissue.young_pa * (tissue.shell_thickness * scale) ** 2
    rate = np.sqrt(stiffness / (1.5 * LEAF_CENTRE_SHIFT_RATIO * tissue.density)) / length**2
    return np.minimum(rate, MAX_LEAF_FREQUENCY_RAD_S)


def mesh_piece_lengths(mesh: Mesh) -> Float[np.ndarray, " T"]:
    """Length of the piece that each triangle belongs to [m], from end to end."""
    label = np.repeat(connected_pieces(mesh), 3)
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


@dataclass(frozen=True)
class RootedWood:
    """Wood that stands in soil of its own object."""

    wood: int
    """Of the parts."""
    soil: int
    foot: float
    """Height of the wood's lowest point [m]."""
    top: float
    """Height of the soil's surface [m]."""
    seen: bool
    """Whether the mesh has the foot."""

    @property
    def doubt(self) -> str:
        """What is guessed where the foot was not seen, in words."""
        deep = self.top - self.foot
        return (
            f"its root depth was not seen and is assumed as {deep:.2g} m, halfway down; how far it "
            "sways depends on that."
        )


def find_rooted_wood(anatomy: MeasuredObject, materials: tuple[Material, ...]) -> RootedWood | None:
    """Return which wood stands in which soil; None: nothing stands in soil.

    The wood's foot is in the soil, and it rises above it. Where the surface of either ends, as what pictures show does,
    the foot is taken to reach halfway down from where most of the soil shows to the object's lowest point.
    """
    soils = [m for m in anatomy.members if CONSTITUTIVE_LAWS[materials[m.part].law].granular]
    for soil in soils:
        low, high = height_range(soil)
        for member in anatomy.members:
            foot, top = height_range(member)
            wood = member is not soil and not is_leafy(materials[member.part])
            if wood and member.closed and low < foot < high < top:
                return RootedWood(member.part, soil.part, foot, high, seen=True)
    for soil in (m for m in soils if m.drawn is not None or not m.closed):
        level = _median_height(soil)
        for member in anatomy.members:
            low, high = height_range(member)
            open_wood = materials[member.part].name in WOOD_MATERIALS and not member.closed
            if open_wood and low < level + MAX_WOOD_GAP_FRACTION * (high - level):
                foot = 0.5 * (level + float(anatomy.vertices[:, 2].min()))
                return RootedWood(member.part, soil.part, foot, level, seen=False)
    return None


def _median_height(soil: MeasuredPart) -> float:
    """Height below and above which half of a surface lies [m]."""
    mesh = soil.drawn or (soil.body if len(soil.body.triangles) else soil.sheet)
    middle, areas = mesh.corners.mean(axis=1)[:, 2], mesh.areas
    order = np.argsort(middle)
    half = np.searchsorted(np.cumsum(areas[order]), 0.5 * areas.sum())
    return float(middle[order[half]])


def height_range(member: MeasuredPart) -> tuple[float, float]:
    """Lowest and highest point [m]."""
    z = np.concatenate([m.corners.reshape(-1, 3)[:, 2] for m in (member.body, member.sheet)])
    return float(z.min()), float(z.max())


def root_joint(
    found: RootedWood,
    anatomy: MeasuredObject,
    number: int,
    materials: tuple[Material, ...],
    inertia_about: InertiaAbout,
) -> PlantRoot:
    """Return the sprung joint of a plant in its soil.

    k_θ = .34 E h³ with the depth h of the foot in the soil; the damper takes the soil's loss
    factor at the swing's own frequency, c = η √(k I).

    Args:
        found: How it stands there.
        anatomy: The plant.
        number: Of the object.
        materials: Of all parts.
        inertia_about: Gives the moment of inertia of all that swings about a point [kg m²].
    """
    member = next(m for m in anatomy.members if m.part == found.wood)
    depth = found.top - found.foot
    corner = np.concatenate([member.body.corners, member.sheet.corners]).reshape(-1, 3)
    low = corner[:, 2] < max(found.top, corner[:, 2].min() + depth)
    x, y = corner[low, :2].mean(axis=0)
    point = (float(x), float(y), found.foot + ROCKING_PIVOT_DEPTH_RATIO * depth)
    soil = materials[found.soil]
    stiffness = ROOT_STIFFNESS_COEFFICIENT * soil.young_pa * depth**3
    damping = soil.loss * float(np.sqrt(stiffness * inertia_about(found.wood, point)))
    return PlantRoot(number, found.wood, point, stiffness, damping)


def with_plant_springs(
    scene: Scene, particles: Particles, anatomies: list[MeasuredObject], field: MaterialField, tissue: Material
) -> Particles:
    """Put leaves on springs, and what bears them into its soil."""
    leafy = [k for k, t in enumerate(particles.treatments) if t.kind == "foliage"]
    if not leafy:
        return particles
    rate, roots, doubts = np.zeros(particles.count), [], []
    for number, anatomy in enumerate(anatomies):
        crowns = [m for m in anatomy.members if m.part in leafy]
        for member in crowns:
            own = particles.part == member.part
            scale = scene.objects[number].scale
            rate[own] = leaf_frequencies(member, particles.position[own], tissue, scale)
        found = find_rooted_wood(anatomy, field.materials) if crowns else None
        if found is not None:
            swing = RockingPlant(particles, [m.part for m in crowns])
            roots.append(root_joint(found, anatomy, number, field.materials, swing))
            doubts += [] if found.seen else [f"{scene.objects[number].name}: {found.doubt}"]
    warnings = (*particles.warnings, *doubts)
    return replace(particles, rate=rate, roots=tuple(roots), warnings=warnings)


@dataclass(frozen=True)
class RockingPlant:
    """What rocks on a root: the wood and the leaves."""

    particles: Particles
    crowns: list[int]

    def __call__(self, wood: int, point: Vector) -> float:
        """Moment of inertia about a level axis through a point [kg m²]."""
        mine = np.isin(self.particles.part, [wood, *self.crowns])
        arm = self.particles.position[mine] - np.array(point)
        level = 0.5 * (arm[:, 0] ** 2 + arm[:, 1] ** 2) + arm[:, 2] ** 2
        return float(self.particles.mass[mine] @ level)
