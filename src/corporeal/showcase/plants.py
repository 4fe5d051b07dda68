"""Plants: potted ficus, small tree. Branches are tubes; leaves are closed lenses on the twigs."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Finish
from corporeal.showcase import parametric_surfaces, procedural_textures, sdf
from corporeal.showcase.prop_mesh import (
    PropMesh,
    PropModel,
    PropPart,
    concatenate_meshes,
    mesh_difference,
    mesh_union,
    textured_finish,
    unit_vectors,
)

BRANCHES_PER_GENERATION = {3: 5, 2: 4, 1: 3}
"""Branches on a branch, by how many generations follow it."""


@dataclass(frozen=True)
class PlantBranch:
    """One branch."""

    path: Float[np.ndarray, "N 3"]
    """[m]"""
    radii: Float[np.ndarray, " N"]
    """[m]"""
    generations: int
    """How many follow; 0: it bears leaves."""

    def at(self, share: float) -> Float[np.ndarray, "3"]:
        """Point at a share of the way along [m]."""
        t = np.linspace(0, 1, len(self.path))
        return np.array([np.interp(share, t, self.path[:, i]) for i in range(3)])

    def radius(self, share: float) -> float:
        """Radius at a share of the way along [m]."""
        return float(np.interp(share, np.linspace(0, 1, len(self.radii)), self.radii))

    @property
    def heading(self) -> Float[np.ndarray, "3"]:
        """Unit direction at the tip."""
        return unit_vectors(self.path[-1] - self.path[-2])


@dataclass(frozen=True)
class GrowthHabit:
    """How a plant grows."""

    spread: float
    """Angle between a branch and its children [rad]."""
    droop: float
    """How much the last twigs hang, against 0.16 of upward growth."""


@dataclass(frozen=True)
class BranchStart:
    """Where and how a branch starts."""

    start: Float[np.ndarray, "3"]
    """[m]"""
    heading: Float[np.ndarray, "3"]
    length: float
    """[m]"""
    radius: float
    """[m]"""
    generations: int


@dataclass(frozen=True)
class FoliageStyle:
    """How a plant's leaves are."""

    count: int
    size: float
    """Length of a leaf [m]."""
    thickness: float
    """[m]"""
    droop: float


def potted_ficus(seed: int = 10) -> PropModel:
    """Model a potted ficus, 1.26 m: terracotta, soil, three braided trunks, glossy leaves."""
    rng = np.random.default_rng(seed)
    twigs: list[PlantBranch] = []
    habit = GrowthHabit(0.85, 0.12)
    for k, lean in enumerate((0.10, -0.12, 0.02)):
        stem = _braided_stem(k, lean)
        aside = [0.5 * np.cos(2.1 * k), 0.5 * np.sin(2.1 * k), 0.2]
        twigs.append(stem)
        twigs += _grow_branch(rng, BranchStart(stem.path[-1], stem.heading + aside, 0.30, 0.0100, 2), habit)
    sides = {3: 12, 2: 7, 1: 5, 0: 4}
    trunk = mesh_union([parametric_surfaces.tube_surface(t.path, t.radii, sides[t.generations], 4) for t in twigs])
    pot, soil = _pot_and_soil()
    clay = procedural_textures.speckle_texture(512, 61, "#a8502c", "#c8693d", "#dc8a5c", falloff=1.3)
    earth = procedural_textures.speckle_texture(256, 62, "#1f140d", "#3a281b", "#6a5138", falloff=0.4)
    bark = procedural_textures.bark_texture(256, 63, "#6e5b48", "#978370", "#bfae9b")
    blade = procedural_textures.leaf_texture(128, "#2a6b2a", "#43923a", "#76bf55")
    green = Finish("ficus leaf", texture=blade, roughness=0.42, translucency=0.45)
    leaves = _set_leaves(rng, twigs, FoliageStyle(610, 0.095, 0.0016, 0.35))
    return PropModel(
        "potted_ficus",
        (
            PropPart("pot", pot, textured_finish("terracotta", clay, 0.85), "terracotta"),
            PropPart("soil", mesh_difference(soil, trunk), textured_finish("potting soil", earth, 1.0), "potting_soil"),
            PropPart("trunk", trunk, textured_finish("ficus bark", bark, 0.85), "hardwood"),
            PropPart("leaves", leaves, green, "leaves-flowers"),
        ),
    )


def _braided_stem(k: int, lean: float) -> PlantBranch:
    """One of three stems that wind about each other."""
    t = np.linspace(0, 1, 12)
    turn = 2.1 * k + 4.5 * t
    x = 0.017 * np.cos(turn) * (1 - 0.3 * t) + lean * 0.3 * t**2
    y = 0.017 * np.sin(turn) + 0.06 * (k - 1) * t**2
    return PlantBranch(np.stack([x, y, 0.13 + 0.47 * t], 1), np.linspace(0.016, 0.0105, 12), 3)


def _pot_and_soil() -> tuple[PropMesh, PropMesh]:
    outside = [(0, 0), (0.095, 0), (0.100, 0), (0.104, 0.006), (0.132, 0.195), (0.132, 0.195)]
    outside += [(0.148, 0.197), (0.150, 0.200), (0.154, 0.245), (0.152, 0.250)]
    inside = [(0.152, 0.250), (0.140, 0.251), (0.137, 0.247), (0.120, 0.19), (0.095, 0.022)]
    inside += [(0.09, 0.016), (0, 0.014)]
    rim_to_floor = parametric_surfaces.soften_corners(inside)
    pot = parametric_surfaces.lathe_surface(
        np.concatenate([parametric_surfaces.soften_corners(outside), rim_to_floor[1:]]), 56
    )
    lid = [(0.14, 0.251), (0, 0.251)]
    hollow = parametric_surfaces.lathe_surface(np.concatenate([rim_to_floor[::-1][:-1], lid]), 56)
    noise = sdf.periodic_noise_3d(2, 1.3)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        points = np.stack([x, y, 0 * x], -1).reshape(-1, 3) / 0.06
        return 0.188 + 0.004 * noise(points).reshape(x.shape)

    fill = parametric_surfaces.mound_surface(height, lambda a: 0.150 + 0 * a, 12, 40, 0.2).moved((0, 0, 0.0165))
    return pot, mesh_difference(hollow, mesh_difference(hollow, fill))


def small_tree(seed: int = 9) -> PropModel:
    """Model a broadleaf sapling, 1.08 m, its roots flaring into the ground."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, 14)
    bend = np.stack([0.05 * np.sin(2.5 * t), 0.04 * np.sin(3.4 * t + 0.5) - 0.019], 1)
    path = np.column_stack([bend, 0.024 + 0.66 * t])
    stem = PlantBranch(path, 0.020 + 0.016 * (1 - t) + 0.028 * np.exp(-t / 0.06), 3)
    upwards = BranchStart(path[-1], np.array([0.0, 0, 1.0]), 0.44, 0.020, 3)
    twigs = [stem, *_grow_branch(rng, upwards, GrowthHabit(0.85, 0.05))]
    for a in np.arange(5) * 2.4 + 0.3:
        start = stem.at(min(0.70 + 0.055 * (a % 5), 0.97))
        heading = np.array([np.cos(a), np.sin(a), 0.75])
        twigs += _grow_branch(rng, BranchStart(start, heading, 0.33, 0.013, 2), GrowthHabit(0.8, 0.05))
    sides = {3: 14, 2: 7, 1: 5, 0: 3}
    wood = mesh_union([parametric_surfaces.tube_surface(t.path, t.radii, sides[t.generations], 2) for t in twigs])
    v = wood.vertices.copy()
    v[:, 2] = np.maximum(v[:, 2], 0)
    bark = procedural_textures.bark_texture(256, 71, "#40301f", "#6b5440", "#978069")
    blade = procedural_textures.leaf_texture(128, "#3c7a1e", "#6aa52c", "#a9d04f")
    green = Finish("tree leaf", texture=blade, roughness=0.5, translucency=0.5)
    leaves = _set_leaves(rng, twigs, FoliageStyle(720, 0.120, 0.0018, 0.15))
    trunk = replace(wood, vertices=v)
    return PropModel(
        "small_tree",
        (
            PropPart("trunk", _at_sapling_size(trunk), textured_finish("tree bark", bark, 0.9), "hardwood"),
            PropPart("leaves", _at_sapling_size(leaves), green, "leaves-flowers"),
        ),
    )


def _at_sapling_size(mesh: PropMesh) -> PropMesh:
    """Bring the tree, which was drawn at 1.8 m, to a sapling's size."""
    return replace(mesh, vertices=0.6 * mesh.vertices)


def _grow_branch(rng: np.random.Generator, bud: BranchStart, habit: GrowthHabit) -> list[PlantBranch]:
    """Grow one branch and then its children."""
    n = 6 if bud.generations else 4
    heading, path = bud.heading, [np.asarray(bud.start, float)]
    rise = 0.16 - habit.droop * (bud.generations == 0)
    for _ in range(n - 1):
        heading = unit_vectors(heading + 0.16 * rng.standard_normal(3) + [0, 0, rise])
        path.append(path[-1] + heading * bud.length / (n - 1))
    taper = np.linspace(1, 0.62 if bud.generations else 0.35, n)
    branch = PlantBranch(np.array(path), bud.radius * taper, bud.generations)
    if not bud.generations:
        return [branch]
    twigs = [branch]
    children = BRANCHES_PER_GENERATION[bud.generations]
    turn = rng.random() * 2 * np.pi
    for k in range(children):
        share = 0.45 + 0.55 * (k + 1) / children
        turn += 2.4
        out = unit_vectors(np.cross(heading, [np.cos(turn), np.sin(turn), 0.2]))
        last = 0.45 if k == children - 1 else 1
        angle = habit.spread * (0.8 + 0.4 * rng.random()) * last
        child = BranchStart(
            branch.at(share),
            heading * np.cos(angle) + out * np.sin(angle),
            bud.length * (0.62 + 0.16 * rng.random()),
            branch.radius(share) * 0.68,
            bud.generations - 1,
        )
        twigs += _grow_branch(rng, child, habit)
    return twigs


def _set_leaves(rng: np.random.Generator, twigs: list[PlantBranch], foliage: FoliageStyle) -> PropMesh:
    """Set leaves along the last twigs, turned to the light, each with its own tint."""
    ends = [t for t in twigs if t.generations == 0]
    centre = np.mean([t.path.mean(0) for t in ends], 0)
    per_twig = max(foliage.count / len(ends), 1)
    leaves = []
    for k in range(foliage.count):
        twig = ends[k % len(ends)]
        share = 0.2 + 0.8 * ((k // len(ends)) + rng.random() * 0.7) / per_twig
        at = twig.at(min(share, 0.995))
        leaves.append(_set_leaf(rng, at, unit_vectors(at - centre + [0, 0, 0.02]), twig.heading, foliage))
    return concatenate_meshes(leaves)


def _set_leaf(
    rng: np.random.Generator, at: np.ndarray, outward: np.ndarray, along: np.ndarray, foliage: FoliageStyle
) -> PropMesh:
    """Set one leaf at a point [m] of a twig."""
    scatter = 0.75 * rng.standard_normal(3) * [1, 1, 0.7]
    x = unit_vectors(0.5 * along + 0.75 * outward + scatter + [0, 0, -foliage.droop])
    up = np.array([0, 0, 1.0]) + 0.5 * outward + 0.25 * rng.standard_normal(3)
    y = unit_vectors(np.cross(up, x))
    frame = np.stack([x, y, np.cross(x, y)], 1)
    length = foliage.size * (0.75 + 0.45 * rng.random())
    m = parametric_surfaces.leaf_surface(length, foliage.thickness, 0.10 + 0.25 * rng.random())
    # A crown shades softly when its leaves lean towards the crown's own normal.
    n = m.normals @ frame.T
    n = unit_vectors(n + 0.55 * outward * np.sign(n @ outward)[:, None])
    tint = (0.62 + 0.5 * rng.random()) * np.array([1.0 + 0.25 * rng.random(), 1.0, 0.85])
    posed = replace(m, vertices=m.vertices @ frame.T + at, normals=n)
    return posed.tinted(np.clip(tint, 0, 1))
