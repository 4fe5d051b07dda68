"""Conversion of the results of a run to solids at one instant."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from corporeal.core.errors import UserError
from corporeal.core.store import to_plain
from corporeal.core.types import PartDescription, Particles, Surface
from corporeal.discretization.object_scaling import part_scales
from corporeal.export.exported_solids import ConvexCollider, ExportedSolid, MaterialPoints, PartMaterial, PhysicalScene
from corporeal.export.scene_motion import SceneMotion
from corporeal.export.unsupported_features import unsupported_features
from corporeal.geometry.convex_decomposition import decompose_convex
from corporeal.geometry.convex_hull import ConvexPiece, convex_hull_of
from corporeal.geometry.mesh import join_meshes
from corporeal.materials import materials_json
from corporeal.mpm.physics.rigid import mass_and_inertia
from corporeal.recognition.readable_names import unique_names
from corporeal.simulation.simulation_result import PreparedScene


def identifiers(titles: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return ASCII identifiers, each once: letters, digits and underscores, no digit in front.

    Accents are dropped; letters of other alphabets become underscores, and a name of nothing else becomes ``thing``.
    """
    taken = list(taken)
    return unique_names([*taken, *map(_identifier, titles)])[len(taken) :]


def _identifier(title: str) -> str:
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
    word = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")[:60]
    if not re.search(r"[A-Za-z]", word):
        return f"thing_{word}" if word else "thing"
    return word if word[0].isalpha() else f"thing_{word}"


FLAT_HULL_THICKNESS_FRACTION = 1e-4
"""Of the extent: thickness that the hull of a flat object is given."""
STRUCTURE_FIELDS = ("structure", "thickness", "contents", "fill")
"""Fields of ``PartDescription`` that say how a part is built."""
RESERVED_NAMES = ("World", "Looks", "Matter", "Physics", "Floor", "Floors", "Hulls", "Pieces", "floor")
"""Names that our files use for other objects."""


def physical_scene(prepared: PreparedScene, motion: SceneMotion) -> PhysicalScene:
    """Take a scene as it stands at an instant of its motion.

    Raises:
        UserError: An object has no matter.
    """
    scene, field, particles = prepared.scene, prepared.field, prepared.particles
    empty = [o.name for k, o in enumerate(scene.objects) if not np.any(particles.object == k)]
    if empty:
        raise UserError(f"{', '.join(empty)} holds no material points. Run corporeal fill again.")
    titles = [o.name for o in scene.objects]
    names = identifiers(titles, RESERVED_NAMES)
    made = partial(_solid, prepared, motion)
    solids = tuple(made(k, name) for k, name in enumerate(names))
    (name,) = identifiers([scene.name])
    return PhysicalScene(
        name=name,
        title=scene.name,
        solids=solids,
        matter=_part_materials(prepared),
        finishes=scene.finishes,
        friction=np.asarray(field.friction, dtype=float),
        restitution=np.asarray(field.restitution, dtype=float),
        gravity=scene.gravity,
        walls=scene.walls,
        fps=scene.fps,
        settled=scene.settled,
        cell=particles.cell,
        time=motion.instant,
        duration=scene.duration,
        credits=tuple(dict.fromkeys(o.credit for o in scene.objects if o.credit)),
        unsaid=unsupported_features(scene, particles, motion),
    )


def _part_materials(prepared: PreparedScene) -> tuple[PartMaterial, ...]:
    heavy = prepared.particles.mass_real, part_scales(prepared.scene, prepared.parts)
    listed = materials_json(prepared.field, prepared.parts, *heavy)["parts"]
    catalogue = prepared.parts.catalogue
    field = prepared.field
    rows = zip(catalogue, field.materials, prepared.particles.treatments, listed, field.words, strict=True)
    return tuple(
        PartMaterial(
            part.name,
            part.object,
            material,
            treatment,
            row | {"words": _described_structure(words), "simulated": to_plain(treatment)},
        )
        for part, material, treatment, row, words in rows
    )


def _described_structure(words: PartDescription) -> dict[str, Any]:
    """Return how a part is described as built, before its shape was looked at."""
    return {key: getattr(words, key) for key in STRUCTURE_FIELDS}


def _provenance(prepared: PreparedScene, motion: SceneMotion, number: int) -> dict[str, Any]:
    thing = prepared.scene.objects[number]
    return {
        "class": thing.class_name,
        "real_extent_m": thing.real_extent,
        "scale": thing.scale,
        "source": thing.source,
        "credit": thing.credit,
        "sized_by": thing.sized_by,
        "velocity_m_s": [float(v) for v in motion.velocity(number)],
    }


def _parts_of_surfaces(prepared: PreparedScene, numbers: list[int]) -> tuple[int, ...]:
    """Return the part that most triangles of each surface belong to; none named: the first."""
    counts = [len(s.triangles) for s in prepared.scene.surfaces]
    ends = np.cumsum([0, *counts])
    found = []
    for n in numbers:
        label = prepared.parts.part_of_point[ends[n] : ends[n + 1]]
        label = label[label >= 0]
        found.append(int(np.bincount(label).argmax()) if len(label) else 0)
    return tuple(found)


def _solid(prepared: PreparedScene, motion: SceneMotion, number: int, name: str) -> ExportedSolid:
    scene, particles = prepared.scene, prepared.particles
    own = np.flatnonzero(particles.object == number)
    now = motion.particles[own]
    whole = mass_and_inertia(now, particles.mass[own], particles.volume[own])
    rigid = motion.is_rigid(number)
    surfaces = [n for n, s in enumerate(scene.surfaces) if s.object == number]
    solid = ExportedSolid(
        name=name,
        title=scene.objects[number].name,
        number=number,
        rigid=rigid,
        origin=whole.centre,
        mass=whole.total,
        inertia=whole.inertia,
        velocity=motion.velocity(number),
        spin=motion.spin(number),
        parts=_parts_by_mass(particles, own),
        surfaces=tuple(_posed_surface(scene.surfaces[n], motion, n, whole.centre) for n in surfaces),
        surface_numbers=tuple(surfaces),
        part_of_surface=_parts_of_surfaces(prepared, surfaces),
        provenance=_provenance(prepared, motion, number),
    )
    if not rigid:
        return replace(solid, grains=_material_points(particles, motion, own, whole.centre))
    return _with_colliders(solid, prepared, motion, own)


def _parts_by_mass(particles: Particles, own: Int[np.ndarray, " N"]) -> tuple[int, ...]:
    part, mass = particles.part[own], particles.mass[own]
    return tuple(sorted(set(part.tolist()), key=lambda k: -float(mass[part == k].sum())))


def _posed_surface(surface: Surface, motion: SceneMotion, number: int, origin: np.ndarray) -> Surface:
    vertices, normals = motion.surface_now(number)
    kept = None if surface.normals is None else normals
    return replace(surface, vertices=vertices - origin, normals=kept)


def _material_points(
    particles: Particles, motion: SceneMotion, own: np.ndarray, origin: Float[np.ndarray, "3"]
) -> MaterialPoints:
    return MaterialPoints(
        position=motion.particles[own] - origin,
        velocity=motion.particle_velocity[own],
        volume=particles.volume[own],
        mass=particles.mass[own],
        part=particles.part[own],
        number=own,
    )


def _with_colliders(
    solid: ExportedSolid, prepared: PreparedScene, motion: SceneMotion, own: np.ndarray
) -> ExportedSolid:
    """Cut the mesh as the scene has it, and turn the pieces to where the body is now."""
    scene, particles = prepared.scene, prepared.particles
    mesh = join_meshes([scene.surfaces[n] for n in solid.surface_numbers])
    pieces = decompose_convex(mesh.vertices, mesh.triangles)
    near = KDTree(particles.position[own])
    parts = [int(particles.part[own[near.query(p.centre)[1]]]) for p in pieces]
    hull = convex_hull_of(mesh.vertices, FLAT_HULL_THICKNESS_FRACTION * float(np.ptp(mesh.vertices, axis=0).max()))

    def here(piece: ConvexPiece) -> ConvexPiece:
        return ConvexPiece(motion.placed(solid.number, piece.vertices) - solid.origin, piece.triangles)

    return replace(
        solid,
        pieces=tuple(ConvexCollider(here(p), k) for p, k in zip(pieces, parts, strict=True)),
        hull=ConvexCollider(here(hull), solid.heaviest),
    )


def principal_axes(inertia: Float[np.ndarray, "3 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Return the moments of inertia [kg m²] and the quaternion (w, x, y, z) of their axes."""
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return moments, Rotation.from_matrix(axes).as_quat(scalar_first=True)
