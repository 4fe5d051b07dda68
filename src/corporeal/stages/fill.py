"""Fill every part with material points: solids, walls and sheets, with their true masses."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import KDTree

from corporeal.errors import UserError
from corporeal.geometry.anatomy import Build
from corporeal.geometry.contact_points import contact_points
from corporeal.geometry.falls import drop_heights
from corporeal.geometry.filling import match_moments
from corporeal.geometry.packing import Packing, Recipe, pack, reference
from corporeal.geometry.survey import Anatomy, Member, survey
from corporeal.mpm.treatment import Motion, PartGeometry, Plan, plan
from corporeal.types import (
    Material,
    MaterialField,
    Particles,
    Parts,
    PartWords,
    Scene,
    Structure,
    Treatment,
)

SHEET_SHARE = 0.01
"""Thickness of an open sheet, of its middle extent, where nobody states it."""
POROUS_CELLS = 6
"""A shell narrower than this many cells is filled through, with the shell's mass."""


@dataclass(frozen=True)
class FillConfig:
    """How to fill."""

    detail: Literal["draft", "normal", "fine"] = "draft"
    """The one knob of quality."""
    stiffness: Literal["true", "capped"] = "true"
    """The published rule, "capped", is a control only."""
    seed: int = 0


DEFAULT = FillConfig()


@dataclass(frozen=True)
class Make:
    """How one part is made: what was said about it and what its mesh shows, put together."""

    structure: Structure
    """As simulated: a solid whose mesh turns out to be a wall is a shell here."""
    modelled: bool
    """Whether the mesh shows both faces of the wall."""
    thickness: float
    """Of the wall [m]; 0: solid."""
    sheet: float
    """Thickness of open sheets [m]."""
    body_mass: float
    """Of what its surface encloses [kg]."""
    sheet_mass: float
    """Of its open sheets [kg]."""
    area: float
    """One side [m²]."""
    volume: float
    """Enclosed by the surface, and of the sheets [m³]."""


def fill(
    scene: Scene, parts: Parts, field: MaterialField, config: FillConfig = DEFAULT
) -> Particles:
    """Turn meshes into material points, choosing resolution and treatment on the way."""
    anatomies = examine(scene, parts, config.seed)
    makes = {
        m.part: decide(m, field.structures[m.part], field.materials[m.part], field.words[m.part])
        for a in anatomies
        for m in a.members
    }
    refuse_flat(scene, anatomies)
    chosen = resolve(scene, field, anatomies, makes, config)
    refuse_buried(scene, anatomies, chosen.cell)
    packings = []
    for number, anatomy in enumerate(anatomies):
        recipes = {
            m.part: recipe(m, makes[m.part], chosen.treatments[m.part], chosen.cell)
            for m in anatomy.members
        }
        rng = np.random.default_rng([config.seed, number, 1])
        coarse = is_rigid(anatomy, chosen)
        packings.append(pack(anatomy, recipes, chosen.cell / 2, rng, coarse=coarse))
    packings = keep_apart(packings, chosen.cell)
    return gather(scene, parts, anatomies, makes, chosen, packings)


# ------------------------------------------------------------------ what is there


def examine(scene: Scene, parts: Parts, seed: int) -> list[Anatomy]:
    """Measure every object.

    Raises:
        UserError: A part has no surface.

    """
    count = np.cumsum([0, *(len(s.vertices) for s in scene.surfaces)])
    corners = np.concatenate([s.vertices for s in scene.surfaces])
    triangles = np.concatenate(
        [s.triangles + c for s, c in zip(scene.surfaces, count, strict=False)]
    )
    anatomies = []
    for number in range(len(scene.objects)):
        own = np.flatnonzero(parts.object_of_point == number)
        label = _whole(parts.part_of_point[own])
        rng = np.random.default_rng([seed, number, 0])
        used, joined = np.unique(triangles[own], return_inverse=True)
        anatomies.append(survey(corners[used], joined.reshape(-1, 3), label, rng))
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


def refuse_flat(scene: Scene, anatomies: list[Anatomy]) -> None:
    """Stop when nothing in the scene has a body.

    Raises:
        UserError: Every part is flat.

    """
    members = [m for a in anatomies for m in a.members]
    if all(m.volume == 0 and m.size[0] < 1e-6 * m.size[2] for m in members):
        raise UserError(
            f"{scene.source}: no object encloses a volume; every part is flat, so there is "
            "nothing to fill. Use a model of a solid thing."
        )


def refuse_buried(scene: Scene, anatomies: list[Anatomy], cell: float) -> None:
    """Stop when an object reaches more than one cell into the floor.

    Raises:
        UserError: It names the object.

    """
    for thing, anatomy in zip(scene.objects, anatomies, strict=True):
        lowest = float(anatomy.vertices[:, 2].min())
        if lowest < -cell:
            raise UserError(
                f"Object {thing.name!r} reaches {-lowest:.3g} m below the floor. "
                "Raise its position by as much."
            )


# ------------------------------------------------------------------ how it is made


def decide(member: Member, structure: Structure, material: Material, words: PartWords) -> Make:
    """Say how thick a part's walls are and what it weighs.

    Solid: m = ρ V. Shell: m = ρ min(A t, V) with the area A of one face. A wall whose mesh shows
    both faces is 2 V / A thick unless somebody stated otherwise. Open sheets weigh ρ A t.
    """
    wall = member.build is Build.WALL
    shown = 2 * member.volume / member.body_area if wall else 0.0
    stated = structure.thickness or material.shell_thickness
    guess = SHEET_SHARE * (member.size[1] or member.size[2])
    only_sheet = member.volume == 0
    sheet = (words.thickness or stated or guess) if member.sheet_area or only_sheet else 0.0
    thickness = 0.0
    if structure.kind == "shell":
        thickness = words.thickness or shown or stated or guess
    elif wall:
        thickness = shown
    face = member.body_area * (0.5 if wall else 1.0)
    volume = member.volume if not only_sheet else face * sheet
    if structure.kind == "shell" and not only_sheet:
        matter = min(face * thickness, volume)
    else:
        matter = volume
    if thickness > 0 or only_sheet:
        simulated = Structure("shell", thickness or sheet, structure.reason)
    else:
        simulated = Structure("solid")
    return Make(
        structure=simulated,
        modelled=wall,
        thickness=thickness,
        sheet=sheet,
        body_mass=material.density * matter,
        sheet_mass=material.density * member.sheet_area * sheet,
        area=face + member.sheet_area,
        volume=volume + member.sheet_area * sheet,
    )


def resolve(
    scene: Scene,
    field: MaterialField,
    anatomies: list[Anatomy],
    makes: dict[int, Make],
    config: FillConfig,
) -> Plan:
    """Ask for grid spacing and treatments."""
    geometries = {
        m.part: PartGeometry(
            object=number,
            material=field.materials[m.part],
            structure=makes[m.part].structure,
            size=(max(m.size[0], makes[m.part].sheet), m.size[1], m.size[2]),
            volume=makes[m.part].volume,
            area=makes[m.part].area,
            closed=m.closed and not makes[m.part].modelled,
        )
        for number, anatomy in enumerate(anatomies)
        for m in anatomy.members
    }
    ordered = [geometries[k] for k in sorted(geometries)]
    return plan(ordered, motions(scene, anatomies, config.seed), config.detail, config.stiffness)


def motions(scene: Scene, anatomies: list[Anatomy], seed: int) -> list[Motion]:
    """Estimate every object's speed at impact.

    Falling gives √(v_z² + 2 g h) with the free height h below; pushes and own velocity add across.
    What may be hit by another object is hit at the difference of their speeds across, and at the
    larger of their falls.
    """
    gravity = float(np.linalg.norm(scene.gravity))
    meshes = [a.everything for a in anatomies]
    heights = drop_heights(meshes, np.random.default_rng([seed, 2]))
    across, fall, acceleration = [], [], []
    for thing, height in zip(scene.objects, heights, strict=True):
        velocity, push = np.array(thing.velocity), np.zeros(3)
        if thing.push is not None:
            push = np.array(thing.push.acceleration)
            lasts = max(0.0, min(thing.push.end, scene.duration) - thing.push.start)
            velocity = velocity + push * lasts
        across.append(velocity[:2])
        fall.append(np.sqrt(velocity[2] ** 2 + 2 * gravity * height))
        acceleration.append(gravity + float(np.linalg.norm(push)))
    result = []
    for i in range(len(scene.objects)):
        speeds = [float(np.hypot(fall[i], np.linalg.norm(across[i])))]
        for j in range(len(scene.objects)):
            if j != i:
                closing = np.linalg.norm(across[i] - across[j])
                speeds.append(float(np.hypot(max(fall[i], fall[j]), closing)))
        result.append(Motion(impact_speed=max(speeds), acceleration=acceleration[i]))
    return result


def is_rigid(anatomy: Anatomy, chosen: Plan) -> bool:
    """Whether the object moves as one rigid body."""
    return all(chosen.treatments[m.part].kind == "rigid" for m in anatomy.members)


def recipe(member: Member, made: Make, treatment: Treatment, cell: float) -> Recipe:
    """Say where a part's matter lies on this grid."""
    simulated = treatment.thickness or max(made.thickness, 2 * cell)
    sheet = made.sheet
    if made.structure.kind == "shell" and treatment.kind == "shell":
        sheet = simulated
    if made.thickness == 0:
        return Recipe(np.inf, 0.0, sheet)
    if made.modelled:
        thin = made.thickness < 0.99 * simulated and treatment.kind == "shell"
        return Recipe(0.0 if thin else np.inf, simulated, sheet)
    return Recipe(np.inf if is_porous(member, cell) else simulated, simulated, sheet)


def is_porous(member: Member, cell: float) -> bool:
    """Whether a shell is too narrow for two walls with a hollow between them."""
    return member.size[0] < POROUS_CELLS * cell


# ------------------------------------------------------------------ points


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


def gather(
    scene: Scene,
    parts: Parts,
    anatomies: list[Anatomy],
    makes: dict[int, Make],
    chosen: Plan,
    packings: list[Packing],
) -> Particles:
    """Give every point its volume and density, and rigid objects their contact points."""
    columns: dict[str, list[np.ndarray]] = {k: [] for k in ("volume", "density", "skin", "owner")}
    for number, (anatomy, packing) in enumerate(zip(anatomies, packings, strict=True)):
        volume, density = weigh(anatomy, packing, makes, chosen)
        columns["volume"].append(volume)
        columns["density"].append(density)
        skin = np.zeros((0, 3))
        if is_rigid(anatomy, chosen):
            skin = contact_points(anatomy, chosen.cell / 3, np.random.default_rng([number, 3]))
        columns["skin"].append(skin)
        columns["owner"].append(np.full(len(skin), number))
    counts = [len(p.points) for p in packings]
    velocity = np.array([o.velocity for o in scene.objects], dtype=np.float64).reshape(-1, 3)
    part = np.concatenate([p.part for p in packings])
    return Particles(
        position=np.concatenate([p.points for p in packings]),
        velocity=np.repeat(velocity, counts, axis=0),
        volume=np.concatenate(columns["volume"]),
        density=np.concatenate(columns["density"]),
        object=np.repeat(np.arange(len(packings)), counts),
        part=part,
        cell=chosen.cell,
        treatments=chosen.treatments,
        surface=np.concatenate(columns["skin"]),
        object_of_surface=np.concatenate(columns["owner"]),
        mass_real=tuple(
            makes[k].body_mass + makes[k].sheet_mass for k in range(len(parts.catalogue))
        ),
        fills=describe(parts, anatomies, makes, chosen, part),
        warnings=chosen.warnings,
    )


def weigh(
    anatomy: Anatomy, packing: Packing, makes: dict[int, Make], chosen: Plan
) -> tuple[np.ndarray, np.ndarray]:
    """Volume [m³] and simulated density [kg/m³] of every point of an object.

    A thickened wall keeps the treatment's density, so its volume follows from its mass; a solid
    keeps its true volume. A rigid part's masses are adjusted to its true centre and inertia.
    """
    volume, density = np.zeros(len(packing.points)), np.ones(len(packing.points))
    rng = np.random.default_rng(4)
    for member in anatomy.members:
        made, treatment = makes[member.part], chosen.treatments[member.part]
        own = np.flatnonzero(packing.part == member.part)
        thickened = treatment.kind == "shell" and not (
            made.thickness > 0 and not made.modelled and is_porous(member, chosen.cell)
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


def describe(
    parts: Parts,
    anatomies: list[Anatomy],
    makes: dict[int, Make],
    chosen: Plan,
    part: np.ndarray,
) -> tuple[str, ...]:
    """One sentence per part."""
    members = {m.part: m for a in anatomies for m in a.members}
    sentences = []
    for k, entry in enumerate(parts.catalogue):
        made, count = makes[k], int((part == k).sum())
        what = how_filled(members[k], made, chosen, k)
        mass = made.body_mass + made.sheet_mass
        sentences.append(f"{entry.name}: {what}; {count:,} particles, {mass:.3g} kg.")
    return tuple(sentences)


def how_filled(member: Member, made: Make, chosen: Plan, k: int) -> str:
    """Say in words what the fill is."""
    treatment = chosen.treatments[k]
    if member.volume == 0:
        return f"an open sheet, taken as {made.sheet * 1e3:.3g} mm thick"
    open_too = f", with open sheets {made.sheet * 1e3:.3g} mm thick" if member.sheet_area else ""
    if made.thickness == 0:
        return f"solid, {member.volume * 1e6:.4g} cm³ by winding number{open_too}"
    shown = " as its mesh shows" if made.modelled else ""
    wall = f"a wall {made.thickness * 1e3:.3g} mm thick{shown}"
    if not made.modelled and is_porous(member, chosen.cell):
        return f"{wall}, filled through because it is narrow, with the wall's mass{open_too}"
    if treatment.kind == "shell" and treatment.thickness and treatment.thickness > made.thickness:
        return f"{wall}, simulated {treatment.thickness * 1e3:.3g} mm thick{open_too}"
    return f"{wall}{open_too}"
