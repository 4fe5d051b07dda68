"""Fill every part with material points: solids, walls and sheets, with their true masses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from corporeal.errors import UserError, check_range
from corporeal.formats.typical_bulk import doubt_mass
from corporeal.geometry.arrangement import underside
from corporeal.geometry.contact_points import contact_points
from corporeal.geometry.contents import with_contents
from corporeal.geometry.extent import oriented_size
from corporeal.geometry.falls import drop_heights
from corporeal.geometry.foliage import in_leaves, is_leafy, leaves_of, planted
from corporeal.geometry.make import (
    Make,
    as_plate,
    compose,
    heavier,
    how_filled,
    plate_thickness,
    recipe,
)
from corporeal.geometry.mass_shares import keep_apart, weigh
from corporeal.geometry.mesh import joined
from corporeal.geometry.outer_skin import cross_section, faces
from corporeal.geometry.packing import Packing, Recipe, pack
from corporeal.geometry.rods import Rod, rod_of
from corporeal.geometry.rooting import drawn_into_ground
from corporeal.geometry.sizes import in_scene, is_scaled, scale_of_part
from corporeal.geometry.survey import Anatomy, Member, survey
from corporeal.geometry.wetted import wetted_points
from corporeal.materials import find
from corporeal.materials.quantities import QUANTITIES
from corporeal.mpm.laws import MENU
from corporeal.mpm.physics.prescribed import fastest_velocity, start_velocity
from corporeal.mpm.physics.wind import greatest_acceleration
from corporeal.treatment.part import Motion, PartGeometry
from corporeal.treatment.plan import Detail, Plan, Quality, plan
from corporeal.treatment.poured import moving, pour
from corporeal.types import Contents, MaterialField, Particles, Parts, Scene, SceneObject, Treatment


@dataclass(frozen=True)
class FillConfig:
    """How objects are filled with material points."""

    detail: Literal["draft", "normal", "fine"] = "draft"
    """Spatial resolution and step budget; the only setting of accuracy."""
    stiffness: Literal["true", "capped"] = "true"
    """Young's moduli as measured, or capped by the published rule, which is a control only."""
    seed: int = 0
    """Seed of all random numbers."""


DEFAULT = FillConfig()
NOTABLE = 0.01
"""Relative difference of a stated mass that is told."""


@dataclass(frozen=True)
class Accuracy:
    """What a filling is to be worth."""

    detail: Detail | Quality
    stiffness: Literal["true", "capped"]
    seed: int


def validate(config: FillConfig) -> None:
    """Raise UserError where a setting cannot be right, whatever the scene."""
    check_range("--seed", config.seed, 0, 2**63)


def fill(
    scene: Scene,
    parts: Parts,
    field: MaterialField,
    config: FillConfig = DEFAULT,
    quality: Quality | None = None,
) -> Particles:
    """Turn meshes into material points, choosing resolution and treatment on the way.

    Walls are as thick as their object is large in the scene: real thickness times its scale.

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
    anatomies = examine(scene, parts, config.seed)
    leaf = find("leaf_tissue")
    tissue = leaf.pick(leaf.typical())
    makes = {
        m.part: in_leaves(
            compose(a, m, field, np.random.default_rng([config.seed, m.part, 5])),
            a,
            m,
            field,
            tissue,
            obj.scale,
        )
        for obj, a in zip(scene.objects, anatomies, strict=True)
        for m in a.members
    }
    makes, heavy = as_heavy_as_stated(scene, anatomies, makes)
    refuse_flat(scene, anatomies)
    # Rods bend as rings of points; resolution and treatments follow from all of it.
    rods = {
        m.part: rod
        for a in anatomies
        for m in a.members
        if makes[m.part].thickness == 0 and (rod := rod_of(m, np.random.default_rng(config.seed)))
    }
    asked = Accuracy(quality or config.detail, config.stiffness, config.seed)
    chosen = resolve(scene, field, anatomies, makes, rods, asked)
    # A plate thinner than two cells is a wall, whoever called it solid; with it the cell may grow.
    while thin := thin_plates(anatomies, makes, rods, chosen, config.seed):
        makes |= {k: as_plate(makes[k], thickness) for k, thickness in thin.items()}
        chosen = resolve(scene, field, anatomies, makes, rods, asked)
    refuse_buried(scene, anatomies, chosen.cell)
    # Points, object by object.
    packings = []
    for number, anatomy in enumerate(anatomies):
        recipes = {
            m.part: on_rings(
                recipe(m, makes[m.part], chosen.treatments[m.part], chosen.cell),
                rods.get(m.part),
                chosen.treatments[m.part],
                chosen.cell,
            )
            for m in anatomy.members
        }
        rng = np.random.default_rng([config.seed, number, 1])
        coarse = is_rigid(anatomy, chosen)
        packings.append(pack(anatomy, recipes, chosen.cell / 2, rng, coarse=coarse))
    # No point of one object in another; volumes and densities that add up to the masses.
    packings = keep_apart(packings, chosen.cell, in_vessels(parts, field))
    particles = gather(scene, parts, anatomies, makes, chosen, packings)
    if any(MENU[m.law].liquid for m in field.materials):
        particles = wet(particles, anatomies, makes, config.seed)
    doubted = implausible_masses(scene, anatomies, particles.mass_real)
    told = (*particles.warnings, *drawn, *heavy, *doubted)
    particles = replace(particles, warnings=told, contents=contents)
    return planted(scene, particles, anatomies, field, tissue)


def pour_out(scene: Scene, parts: Parts, field: MaterialField, seed: int) -> tuple[Contents, ...]:
    """Return what moves in vessels that it does not fill."""
    if not moving(field):
        return ()
    life = in_scene(field, scale_of_part(scene, parts))
    return pour(scene, parts, life, examine(scene, parts, seed), seed)


def in_vessels(parts: Parts, field: MaterialField) -> set[tuple[int, int]]:
    """Objects that hold something, each with every object that may be that."""
    owners = [part.object for part in parts.catalogue]
    held = [owners[k] for k, s in enumerate(field.structures) if s.holds]
    loose = [owners[k] for k, m in enumerate(field.materials) if MENU[m.law].loose]
    return {(min(a, b), max(a, b)) for a in held for b in loose}


def wet(
    particles: Particles, anatomies: list[Anatomy], makes: dict[int, Make], seed: int
) -> Particles:
    """Cover rigid objects with points where liquids touch them."""
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    owner = [np.zeros(0, np.int64)]
    for number, anatomy in enumerate(anatomies):
        if any(particles.treatments[m.part].kind != "rigid" for m in anatomy.members):
            continue
        rng = np.random.default_rng([seed, number, 7])
        found, normal = wetted_points(anatomy, makes, particles.cell, rng)
        points.append(found)
        normals.append(normal)
        owner.append(np.full(len(found), number))
    return replace(
        particles,
        wetted=np.concatenate(points),
        wetted_normal=np.concatenate(normals),
        object_of_wetted=np.concatenate(owner),
    )


# ------------------------------------------------------------------ what is there


def examine(scene: Scene, parts: Parts, seed: int) -> list[Anatomy]:
    """Measure every object.

    Raises:
        UserError: A part has no surface.

    """
    whole = joined(scene.surfaces)
    anatomies = []
    for number in range(len(scene.objects)):
        own = np.flatnonzero(parts.object_of_point == number)
        label = _whole(parts.part_of_point[own])
        rng = np.random.default_rng([seed, number, 0])
        used, triangles = np.unique(whole.triangles[own], return_inverse=True)
        anatomies.append(survey(whole.vertices[used], triangles.reshape(-1, 3), label, rng))
    found = {m.part for a in anatomies for m in a.members}
    for k, part in enumerate(parts.catalogue):
        if k not in found:
            name = scene.objects[part.object].name
            raise UserError(
                f"Part {part.name!r} of object {name!r} has no surface: all of its triangles have "
                "no area. Remove it from the file, or give it another part's name."
            )
    return anatomies


def _whole(label: np.ndarray) -> np.ndarray:
    """Give triangles that belong to no part to the object's most common part."""
    named = label[label >= 0]
    if len(named) == len(label) or not len(named):
        return label
    return np.where(label >= 0, label, np.bincount(named).argmax())


def implausible_masses(
    scene: Scene, anatomies: Sequence[Anatomy], masses: Sequence[float]
) -> list[str]:
    """Say which objects are too heavy or too light for the room that they take.

    Args:
        scene: The objects, with what they are.
        anatomies: One per object.
        masses: Of every part [kg].

    """
    said = (
        doubt_mass(
            obj.name,
            obj.class_name or obj.name,
            sum(masses[m.part] for m in anatomy.members),
            oriented_size(anatomy.vertices),
        )
        for obj, anatomy in zip(scene.objects, anatomies, strict=True)
    )
    return [sentence for sentence in said if sentence]


def refuse_flat(scene: Scene, anatomies: list[Anatomy]) -> None:
    """Stop when nothing in the scene has a body.

    Raises:
        UserError: Every part is flat.

    """
    members = [m for a in anatomies for m in a.members]
    if all(m.volume == 0 and m.size[0] < 1e-6 * m.size[2] for m in members):
        raise UserError(
            f"{scene.source}: no object encloses a volume; every part is flat, so there is "
            "nothing to fill. Use a model of a solid object."
        )


def refuse_buried(scene: Scene, anatomies: list[Anatomy], cell: float) -> None:
    """Stop when an object reaches more than one cell into the floor or a wall.

    Raises:
        UserError: It names the object.

    """
    for obj, anatomy in zip(scene.objects, anatomies, strict=True):
        lowest = float(anatomy.vertices[:, 2].min())
        if lowest < -cell:
            raise UserError(
                f"Object {obj.name!r} reaches {-lowest:.3g} m below the floor. "
                "Raise its position by as much."
            )
        for k, wall in enumerate(scene.walls):
            depth = float(((np.array(wall.point) - anatomy.vertices) @ np.array(wall.normal)).max())
            if depth > cell:
                raise UserError(
                    f"Object {obj.name!r} reaches {depth:.3g} m into wall {k + 1}. "
                    "Move one of them, or turn the wall's normal round."
                )


# ------------------------------------------------------------------ how it is made


def as_heavy_as_stated(
    scene: Scene, anatomies: list[Anatomy], makes: dict[int, Make]
) -> tuple[dict[int, Make], tuple[str, ...]]:
    """Let objects weigh what their file states: all of one object by the same factor.

    Returns:
        How every part is made, and a sentence for each object that its materials and its shape
        would give another mass.

    Raises:
        UserError: No material is as dense as that.

    """
    made, told = dict(makes), []
    for thing, anatomy in zip(scene.objects, anatomies, strict=True):
        own = [m.part for m in anatomy.members]
        usual = sum(makes[k].mass for k in own)
        if thing.mass is None or usual <= 0:
            continue
        made |= {k: heavier(makes[k], thing.mass / usual) for k in own}
        possible = QUANTITIES["density"]
        for row in (made[k] for k in own):
            if not possible.low <= row.density <= possible.high:
                raise UserError(
                    f"{thing.name}: its file states {thing.mass:.3g} kg, so that its matter would "
                    f"have {row.density:.3g} kg/m³; no material has less than {possible.low:g} or "
                    f"more than {possible.high:g}. Correct the file, or its unit of mass."
                )
        if abs(thing.mass / usual - 1) > NOTABLE:
            told.append(
                f"{thing.name} weighs {thing.mass:.3g} kg, as its file states; its materials and "
                f"its shape would give {usual:.3g} kg."
            )
    return made, tuple(told)


def resolve(
    scene: Scene,
    field: MaterialField,
    anatomies: list[Anatomy],
    makes: dict[int, Make],
    rods: dict[int, Rod],
    config: Accuracy,
) -> Plan:
    """Choose grid spacing and treatments."""
    geometries = {
        m.part: PartGeometry(
            object=number,
            material=replace(field.materials[m.part], density=makes[m.part].density),
            structure=makes[m.part].structure,
            size=(max(m.size[0], makes[m.part].sheet), m.size[1], m.size[2]),
            volume=makes[m.part].volume,
            area=makes[m.part].area,
            closed=closes_about(m, makes[m.part]),
            leaves=leaves_of(
                m, field.materials[m.part], makes[m.part], scene.objects[number].scale
            ),
            diameter=rods[m.part].diameter if m.part in rods else 0.0,
            burden=burden(m, anatomy, makes, field),
            scale=scene.objects[number].scale,
            prescribed=scene.objects[number].path is not None,
        )
        for number, anatomy in enumerate(anatomies)
        for m in anatomy.members
    }
    ordered = [geometries[k] for k in sorted(geometries)]
    masses = [sum(makes[m.part].mass for m in a.members) for a in anatomies]
    moved = motions(scene, anatomies, masses, config.seed)
    return plan(ordered, moved, config.detail, config.stiffness)


def thin_plates(
    anatomies: list[Anatomy], makes: dict[int, Make], rods: dict[int, Rod], chosen: Plan, seed: int
) -> dict[int, float]:
    """Thickness of each solid part that bends and is a plate thinner than two cells [m]."""
    found = {}
    for member in (m for a in anatomies for m in a.members if m.part not in rods):
        if chosen.treatments[member.part].kind != "deformable":
            continue
        rng = np.random.default_rng([seed, member.part, 6])
        thickness = plate_thickness(member, makes[member.part], rng)
        if 0 < thickness < 2 * chosen.cell:
            found[member.part] = thickness
    return found


def closes_about(member: Member, made: Make) -> bool:
    """Whether a part cannot bend without stretching, as what closes about something cannot."""
    if made.modelled:
        return False
    return member.encloses if made.thickness else member.closed


def burden(member: Member, anatomy: Anatomy, makes: dict[int, Make], field: MaterialField) -> float:
    """Mass of the foliage of an object over that of one of its other parts [-]."""
    leafy = [m.part for m in anatomy.members if is_leafy(field.materials[m.part])]
    if member.part in leafy:
        return 0.0
    return sum(makes[k].mass for k in leafy) / max(makes[member.part].mass, 1e-30)


def motions(scene: Scene, anatomies: list[Anatomy], masses: list[float], seed: int) -> list[Motion]:
    """Estimate every object's speed at impact.

    Falling gives √(v_z² + 2 g h) with the free height h below; pushes, wind and own velocity add
    across. What may be hit by another object is hit at the difference of their speeds across, and
    at the larger of their falls.
    """
    gravity = float(np.linalg.norm(scene.gravity))
    meshes = [a.everything for a in anatomies]
    heights = drop_heights(meshes, np.random.default_rng([seed, 2]))
    across, fall, forced = [], [], []
    for k, (obj, height) in enumerate(zip(scene.objects, heights, strict=True)):
        drive = driven(obj, anatomies[k], masses[k], scene.duration)
        velocity = np.array(obj.velocity) + drive.velocity
        across.append(velocity[:2])
        dropped = 0.0 if obj.path is not None else height
        fall.append(np.sqrt(velocity[2] ** 2 + 2 * gravity * dropped))
        forced.append(drive.acceleration)
    result = []
    for i in range(len(scene.objects)):
        speeds = [float(np.hypot(fall[i], np.linalg.norm(across[i])))]
        for j in range(len(scene.objects)):
            if j != i:
                closing = np.linalg.norm(across[i] - across[j])
                speeds.append(float(np.hypot(max(fall[i], fall[j]), closing)))
        result.append(Motion(max(speeds), gravity + forced[i], forced[i]))
    return result


@dataclass(frozen=True)
class Drive:
    """What push, wind or a path do to an object."""

    velocity: Float[np.ndarray, " 3"]
    """Gained at most [m/s]."""
    acceleration: float
    """Largest [m/s²]."""


def driven(obj: SceneObject, anatomy: Anatomy, mass: float, duration: float) -> Drive:
    """Estimate what push and wind do to an object: the wind carries it no faster than itself."""
    gained, strongest = np.zeros(3), 0.0
    if obj.path is not None:
        reach = float(np.ptp(anatomy.everything.vertices, axis=0).max())
        return Drive(fastest_velocity(obj.path, reach), 0.0)
    if obj.push is not None:
        push = np.array(obj.push.acceleration)
        gained += push * max(0.0, min(obj.push.end, duration) - obj.push.start)
        strongest += float(np.linalg.norm(push))
    if obj.wind is not None:
        air = np.array(obj.wind.velocity) * (1.0 + obj.wind.gust)
        shown = cross_section(anatomy, obj.wind.velocity)
        blown = greatest_acceleration(obj.wind, shown, mass)
        lasts = max(0.0, min(obj.wind.end, duration) - obj.wind.start)
        gained += air * min(1.0, blown * lasts / max(float(np.linalg.norm(air)), 1e-30))
        strongest += blown
    return Drive(gained, strongest)


def on_rings(recipe: Recipe, rod: Rod | None, treatment: Treatment, cell: float) -> Recipe:
    """Let rings of points stand for a rod that is thinner than two cells and bends."""
    if rod is None or treatment.kind != "deformable" or rod.diameter >= 2 * cell:
        return recipe
    return replace(recipe, depth=0.0, rod=rod, thick=2 * cell)


def is_rigid(anatomy: Anatomy, chosen: Plan) -> bool:
    """Whether the object moves as one rigid body."""
    return all(chosen.treatments[m.part].kind == "rigid" for m in anatomy.members)


# ------------------------------------------------------------------ points


def gather(
    scene: Scene,
    parts: Parts,
    anatomies: list[Anatomy],
    makes: dict[int, Make],
    chosen: Plan,
    packings: list[Packing],
) -> Particles:
    """Give every point its volume and density, and what is rigid its contact points."""
    names = ("volume", "density", "skin", "owner", "face", "bearer")
    columns: dict[str, list[np.ndarray]] = {k: [] for k in names}
    first = 0
    for number, (anatomy, packing) in enumerate(zip(anatomies, packings, strict=True)):
        volume, density = weigh(anatomy, packing, makes, chosen.treatments, chosen.cell)
        columns["volume"].append(volume)
        columns["density"].append(density)
        skin = np.zeros((0, 3))
        stiff = [m.part for m in anatomy.members if chosen.treatments[m.part].kind == "rigid"]
        if stiff:
            outside = anatomy if is_rigid(anatomy, chosen) else anatomy.only(stiff)
            skin = contact_points(outside, chosen.cell / 3, np.random.default_rng([number, 3]))
        columns["skin"].append(skin)
        columns["owner"].append(np.full(len(skin), number))
        if scene.objects[number].wind is not None:
            face, bearer = faces(anatomy, packing.points, chosen.cell / 4)
            columns["face"].append(face)
            columns["bearer"].append(first + bearer)
        first += len(packing.points)
    counts = [len(p.points) for p in packings]
    velocity = [
        start_velocity(o.path, underside(scene, k), p.points)
        if o.path is not None
        else np.broadcast_to(np.array(o.velocity, dtype=np.float64), p.points.shape)
        for k, (o, p) in enumerate(zip(scene.objects, packings, strict=True))
    ]
    part = np.concatenate([p.part for p in packings])
    return Particles(
        position=np.concatenate([p.points for p in packings]),
        velocity=np.concatenate(velocity),
        volume=np.concatenate(columns["volume"]),
        density=np.concatenate(columns["density"]),
        object=np.repeat(np.arange(len(packings)), counts),
        part=part,
        cell=chosen.cell,
        treatments=chosen.treatments,
        surface=np.concatenate(columns["skin"]),
        object_of_surface=np.concatenate(columns["owner"]),
        face=np.concatenate([np.zeros((0, 3)), *columns["face"]]),
        particle_of_face=np.concatenate([np.zeros(0, np.int64), *columns["bearer"]]),
        mass_real=tuple(makes[k].mass for k in range(len(parts.catalogue))),
        fills=describe(scene, parts, anatomies, makes, chosen, part),
        walls=tuple((makes[k].thickness, makes[k].sheet) for k in range(len(parts.catalogue))),
        warnings=chosen.warnings,
    )


def describe(
    scene: Scene,
    parts: Parts,
    anatomies: list[Anatomy],
    makes: dict[int, Make],
    chosen: Plan,
    part_of_particle: Int[np.ndarray, " P"],
) -> tuple[str, ...]:
    """One sentence per part; a second one where its object is not life-size."""
    members = {m.part: m for a in anatomies for m in a.members}
    sentences = []
    for k, entry in enumerate(parts.catalogue):
        made, count = makes[k], int((part_of_particle == k).sum())
        what = how_filled(members[k], made, chosen.treatments[k], chosen.cell)
        shared = f" It weighs what its pieces weigh: {'; '.join(made.pieces)}."
        sentences.append(
            f"{entry.name}: {what}; {count:,} particles, {made.mass:.3g} kg."
            + (shared if made.pieces else "")
            + in_life(made, scene.objects[entry.object].scale)
        )
    return tuple(sentences)


def in_life(made: Make, scale: float) -> str:
    """Say what a part weighs at its real size, and how thick its wall is; "" where it has it."""
    if not is_scaled(scale):
        return ""
    wall = made.thickness or made.sheet
    thick = f", with a wall {wall / scale * 1e3:.3g} mm thick" if wall else ""
    weighs = f"it weighs {made.mass / scale**3:.3g} kg{thick}"
    return f" In life, {1 / scale:.3g} times as large, {weighs}."
