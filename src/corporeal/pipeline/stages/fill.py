"""Fill every part with material points: solids, walls and sheets, with their true masses."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import (
    ROUNDING,
    Material,
    MaterialField,
    Particles,
    Parts,
    Scene,
    Treatment,
    reworded,
)
from corporeal.discretization.bedded import all_bedded, how_bedded, loose_sheets
from corporeal.discretization.contact_points import contact_points
from corporeal.discretization.contents import holders, with_contents
from corporeal.discretization.foliage import in_leaves, planted
from corporeal.discretization.hollowed import all_hollowed
from corporeal.discretization.lids import all_lidded, how_lidded
from corporeal.discretization.loose_contents import in_vessels, pour_out, wetted
from corporeal.discretization.make import Make, compose, how_filled, recipe
from corporeal.discretization.mass_shares import keep_apart, weigh
from corporeal.discretization.object_masses import (
    as_heavy_as_stated,
    implausible_masses,
    masses_not_as_named,
    walls_drawn_too_thick,
)
from corporeal.discretization.outer_skin import faces
from corporeal.discretization.packing import Packing, Recipe, pack
from corporeal.discretization.plan import Plan, Quality
from corporeal.discretization.resolution import Accuracy, Bodies, resolve
from corporeal.discretization.rods import Rod, rod_of
from corporeal.discretization.rooting import drawn_into_ground
from corporeal.discretization.scene_survey import examine, refuse_buried, refuse_flat
from corporeal.discretization.sizes import in_scene, is_scaled, scale_of_part
from corporeal.discretization.survey import Anatomy
from corporeal.geometry.arrangement import underside
from corporeal.materials import find
from corporeal.mpm.physics.prescribed import start_velocity
from corporeal.pipeline.settings.fill_config import FillConfig

DEFAULT = FillConfig()
COUNTED = re.compile(r"Object (\d+) of the scene")
"""As the treatment, which knows no names, calls an object."""


def fill(
    scene: Scene,
    parts: Parts,
    field: MaterialField,
    config: FillConfig = DEFAULT,
    quality: Quality | None = None,
) -> Particles:
    """Turn meshes into material points, choosing resolution and treatment on the way.

    A wall is as thick as in life times the scale of its object.

    Args:
        scene: What is filled.
        parts: Which triangles belong to which part.
        field: What every part is made of.
        config: Resolution.
        quality: What is bought instead of what ``config.detail`` buys; None: that.

    """
    # What moves in vessels is an object of its own.
    contents = pour_out(scene, parts, field, config.seed)
    scene, parts, field = with_contents(scene, parts, field, contents).all
    field = in_scene(field, scale_of_part(scene, parts))
    scene, drawn = drawn_into_ground(scene, parts, field)
    # What is loose fills what holds it, of which its surface alone may be drawn; what is hollow is
    # closed below what is soft.
    bedded = all_bedded(all_hollowed(examine(scene, parts, config.seed), field), field)
    anatomies = all_lidded(bedded, field)
    # How every part is made; objects weigh what their files state.
    leaf = find("leaf_tissue")
    tissue = leaf.pick(leaf.typical())
    makes = composed(scene, anatomies, field, tissue, config.seed)
    makes, heavy = as_heavy_as_stated(scene, anatomies, makes)
    refuse_flat(scene, anatomies)
    rods = solid_rods(anatomies, makes, config.seed)
    bodies = Bodies(scene, field, anatomies, makes, rods, holders(scene, contents))
    # Grid spacing and treatments follow from all of it.
    asked = Accuracy(quality or config.detail, config.stiffness, config.seed)
    bodies, chosen = resolve(bodies, asked)
    refuse_buried(scene, anatomies, chosen.cell)
    # No point of one object in another; volumes and densities that add up to the masses.
    together = in_vessels(parts, field)
    packings = keep_apart(packed(bodies, chosen, config.seed), chosen.cell, together)
    particles = wetted(gather(parts, bodies, chosen, packings), bodies, config.seed)
    doubted = implausible_masses(scene, anatomies, particles.mass_real)
    unlike = masses_not_as_named(scene, anatomies, particles.mass_real)
    thick = walls_drawn_too_thick(scene, anatomies, makes, field)
    told = (*by_name(particles.warnings, scene), *drawn, *heavy, *thick, *doubted, *unlike)
    told += loose_sheets(scene, parts, anatomies, field)
    particles = replace(particles, warnings=told, contents=contents)
    return planted(scene, particles, anatomies, field, tissue)


def by_name(warnings: Iterable[str], scene: Scene) -> tuple[str, ...]:
    """Return sentences with the names of objects in place of their numbers."""
    return tuple(
        reworded(w, COUNTED.sub(lambda found: scene.objects[int(found[1]) - 1].name, w))
        for w in warnings
    )


# ------------------------------------------------------------------ how it is made


def composed(
    scene: Scene, anatomies: list[Anatomy], field: MaterialField, tissue: Material, seed: int
) -> dict[int, Make]:
    """How each part is made; crowns of leaves from ``tissue``."""
    return {
        m.part: in_leaves(
            compose(a, m, field, np.random.default_rng([seed, m.part, 5])),
            a,
            m,
            field,
            tissue,
            obj.scale,
        )
        for obj, a in zip(scene.objects, anatomies, strict=True)
        for m in a.members
    }


def solid_rods(anatomies: list[Anatomy], makes: dict[int, Make], seed: int) -> dict[int, Rod]:
    """Each part that is a solid rod: where it bends, rings of points stand for it."""
    return {
        m.part: rod
        for a in anatomies
        for m in a.members
        if makes[m.part].thickness == 0 and (rod := rod_of(m, np.random.default_rng(seed)))
    }


# ------------------------------------------------------------------ points


def packed(bodies: Bodies, chosen: Plan, seed: int) -> list[Packing]:
    """Place points in every object."""
    packings = []
    for number, anatomy in enumerate(bodies.anatomies):
        recipes = {
            m.part: on_rings(
                recipe(m, bodies.makes[m.part], chosen.treatments[m.part], chosen.cell),
                bodies.rods.get(m.part),
                chosen.treatments[m.part],
                chosen.cell,
            )
            for m in anatomy.members
        }
        rng = np.random.default_rng([seed, number, 1])
        coarse = is_rigid(anatomy, chosen)
        packings.append(pack(anatomy, recipes, chosen.cell / 2, rng, coarse=coarse))
    return packings


def on_rings(recipe: Recipe, rod: Rod | None, treatment: Treatment, cell: float) -> Recipe:
    """Let rings of points stand for a rod that is thinner than two cells and bends."""
    if rod is None or treatment.kind != "deformable" or rod.diameter >= 2 * cell:
        return recipe
    return replace(recipe, depth=0.0, rod=rod, thick=2 * cell)


def is_rigid(anatomy: Anatomy, chosen: Plan) -> bool:
    """Whether the object moves as one rigid body."""
    return all(chosen.treatments[m.part].kind == "rigid" for m in anatomy.members)


def gather(parts: Parts, bodies: Bodies, chosen: Plan, packings: list[Packing]) -> Particles:
    """Give every point its volume and density, and what is rigid its contact points."""
    scene, anatomies, makes = bodies.scene, bodies.anatomies, bodies.makes
    pairs = list(zip(anatomies, packings, strict=True))
    weighed = [weigh(a, p, makes, chosen.treatments, chosen.cell) for a, p in pairs]
    surfaces = [contact_surface(a, chosen, number) for number, a in enumerate(anatomies)]
    windward = [wind_faces(scene, k, *pair, chosen.cell) for k, pair in enumerate(pairs)]
    counts = [len(p.points) for p in packings]
    firsts = np.cumsum([0, *counts[:-1]])
    part = np.concatenate([p.part for p in packings])
    return Particles(
        position=np.concatenate([p.points for p in packings]),
        velocity=np.concatenate([velocities(scene, k, p.points) for k, p in enumerate(packings)]),
        volume=np.concatenate([volume for volume, _ in weighed]),
        density=np.concatenate([density for _, density in weighed]),
        object=np.repeat(np.arange(len(packings)), counts),
        part=part,
        cell=chosen.cell,
        treatments=chosen.treatments,
        surface=np.concatenate([points for points, _ in surfaces]),
        object_of_surface=np.repeat(np.arange(len(surfaces)), [len(s) for s, _ in surfaces]),
        rounding=np.concatenate([rounding for _, rounding in surfaces]),
        face=np.concatenate([face for face, _ in windward]),
        particle_of_face=np.concatenate(
            [first + bearer for first, (_, bearer) in zip(firsts, windward, strict=True)]
        ),
        mass_real=tuple(makes[k].mass for k in range(len(parts.catalogue))),
        fills=describe(parts, bodies, chosen, part),
        walls=tuple((makes[k].thickness, makes[k].sheet) for k in range(len(parts.catalogue))),
        warnings=chosen.warnings,
    )


def contact_surface(
    anatomy: Anatomy, chosen: Plan, number: int
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 12"]]:
    """Points on the surface of what is rigid in object ``number`` [m], and how it curves there."""
    stiff = [m.part for m in anatomy.members if chosen.treatments[m.part].kind == "rigid"]
    if not stiff:
        return np.zeros((0, 3)), np.zeros((0, ROUNDING))
    outside = anatomy if is_rigid(anatomy, chosen) else anatomy.only(stiff)
    return contact_points(outside, chosen.cell / 3, np.random.default_rng([number, 3]))


def wind_faces(
    scene: Scene, number: int, anatomy: Anatomy, packing: Packing, cell: float
) -> tuple[Float[np.ndarray, "F 3"], Int[np.ndarray, " F"]]:
    """Area vectors of the faces on which wind acts [m²], and the point of the object at each."""
    if scene.objects[number].wind is None:
        return np.zeros((0, 3)), np.zeros(0, np.int64)
    return faces(anatomy, packing.points, cell / 4)


def velocities(
    scene: Scene, number: int, points: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, "N 3"]:
    """Velocity at the start of each point of object ``number`` [m/s]."""
    obj = scene.objects[number]
    if obj.path is not None:
        return start_velocity(obj.path, underside(scene, number), points)
    return np.broadcast_to(np.array(obj.velocity, dtype=np.float64), points.shape)


# ------------------------------------------------------------------ in words


def describe(
    parts: Parts, bodies: Bodies, chosen: Plan, part_of_particle: Int[np.ndarray, " P"]
) -> tuple[str, ...]:
    """One sentence per part; a second one where its object is not life-size."""
    members = {m.part: m for a in bodies.anatomies for m in a.members}
    sentences = []
    for k, entry in enumerate(parts.catalogue):
        make, count = bodies.makes[k], int((part_of_particle == k).sum())
        what = how_filled(members[k], make, chosen.treatments[k], chosen.cell)
        what += how_bedded(members[k], parts) + how_lidded(members[k])
        shared = f" It weighs what its pieces weigh: {'; '.join(make.pieces)}."
        sentences.append(
            f"{entry.name}: {what}; {count:,} particles, {make.mass:.3g} kg."
            + (shared if make.pieces else "")
            + in_life(make, bodies.scene.objects[entry.object].scale)
        )
    return tuple(sentences)


def in_life(make: Make, scale: float) -> str:
    """Say what a part weighs at its real size, and how thick its wall is; "" where it has it."""
    if not is_scaled(scale):
        return ""
    wall = make.thickness or make.sheet
    thick = f", with a wall {wall / scale * 1e3:.3g} mm thick" if wall else ""
    weighs = f"it weighs {make.mass / scale**3:.3g} kg{thick}"
    return f" In life, {1 / scale:.3g} times as large, {weighs}."
