"""A scene as MJCF for MuJoCo: ``scene.xml`` with meshes beside it.

Every two shapes that may meet are an explicit contact pair with the friction of the two materials; MuJoCo itself would
take the larger of two coefficients. The floor meets convex hulls, objects meet one another with their convex pieces.
Restitution e is a damping ratio: a linear spring of damping ratio ζ returns e = exp(-π ζ / √(1 - ζ²)) of a speed. What
can deform is a flex of tetrahedra.
"""

import json
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from corporeal.core.version import __version__
from corporeal.export.export_target import ExportRequest, WrittenTarget
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.mesh_files import (
    MESH_FOLDER,
    write_collider,
    write_picture,
    write_surfaces,
    write_xml,
    xml_comment,
    xml_numbers,
)
from corporeal.export.surface_friction import ROLLING_FRICTION_M, TORSIONAL_FRICTION_M
from corporeal.export.usd_deformables import TETRAHEDRON_CELL_DX, tetrahedra_of
from corporeal.recognition.readable_names import single_line_text

MJCF_FILE_NAME = "scene.xml"
CONTACT_TIME_S = 4e-3
"""1/ω of a contact's spring [s]: what meets at a speed v sinks in by about v/ω; the step must be a quarter of it. At
twice the stiffness piles of light objects come apart.
"""
TIME_STEP_S = CONTACT_TIME_S / 4
FLEX_CONTACT_TIME_S = 8e-3
"""Time constant of the contacts of what can deform [s]."""
MIN_RESTITUTION = 0.01
"""Restitution below it is none."""
MAX_FLEX_POISSON_RATIO = 0.45
"""Largest that the tetrahedra of MuJoCo bear: they lock above it [-]."""
FLEX_RADIUS_DX = 0.05
"""Of a cell: skin of what can deform."""
FLEX_DAMPING_S = 1e-3
"""Of the tetrahedra [s]."""
FLEX_CONTACT_BIT = "4"
"""Bit of contype and conaffinity by which what can deform meets everything else."""
MUJOCO_MEMORY = "1G"
PROVENANCE_PREFIX = "corporeal"
VISUAL_GROUP, COLLISION_GROUP = "2", "3"
"""Groups of geoms: what is seen, what collides (hidden until one asks for it)."""


@dataclass(frozen=True)
class _PairGeom:
    """A geom that may meet others in pairs."""

    name: str
    solid: int
    """-1: floor and walls."""
    part: int
    """-1: floor and walls."""
    meets: str
    """Whose pairs it is in: "ground" or "things"."""


def write_mjcf(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write ``scene.xml`` and its meshes."""
    scene = asked.scene
    soft = [s for s in scene.solids if not s.rigid] if asked.config.soft != "none" else []
    root = ET.Element("mujoco", model=scene.name)
    root.append(xml_comment(_scene_comment(scene)))
    ET.SubElement(root, "compiler", meshdir=MESH_FOLDER, texturedir=MESH_FOLDER)
    _option(root, scene, bool(soft))
    ET.SubElement(root, "size", memory=MUJOCO_MEMORY)
    defaults = ET.SubElement(root, "default")
    # A flex and a geom that meet take the larger friction: the flex's, which has ours.
    ET.SubElement(defaults, "geom", friction="0 0 0")
    _provenance(root, scene)
    assets, world, contact = (ET.SubElement(root, n) for n in ("asset", "worldbody", "contact"))
    _materials(assets, scene, folder)
    geoms = _planes(world, scene)
    for solid in (s for s in scene.solids if s.rigid):
        geoms += _rigid_body(solid, folder, assets, world)
    for solid in soft:
        _flex(solid, scene, world)
    _contact_pairs(contact, scene, geoms)
    _start_keyframe(root, scene, soft)
    write_xml(folder / MJCF_FILE_NAME, root)
    return WrittenTarget(tuple(_not_written(asked)))


def damping_ratio(restitution: float) -> float:
    """ζ of the linear spring that returns a share e of a speed: e = exp(-π ζ / √(1 - ζ²))."""
    if restitution <= MIN_RESTITUTION:
        return 1.0
    loss = -float(np.log(restitution))
    return loss / float(np.hypot(np.pi, loss))


def _scene_comment(scene: PhysicalScene) -> str:
    credits = f" Contains: {'; '.join(scene.credits)}." if scene.credits else ""
    return single_line_text(f"{scene.title}, written by corporeal {__version__}.{credits}")


def _option(root: ET.Element, scene: PhysicalScene, soft: bool) -> None:
    # MuJoCo 4 needs the integrator "discrete" for a flex of this stiffness; that has no noslip.
    solver = ("discrete", "0") if soft else ("implicitfast", "4")
    ET.SubElement(
        root,
        "option",
        timestep=f"{TIME_STEP_S:g}",
        gravity=xml_numbers(scene.gravity),
        cone="elliptic",
        iterations="100",
        integrator=solver[0],
        noslip_iterations=solver[1],
    )


def _provenance(root: ET.Element, scene: PhysicalScene) -> None:
    custom = ET.SubElement(root, "custom")
    for k, matter in enumerate(scene.matter):
        data = json.dumps(matter.provenance, ensure_ascii=False, allow_nan=False)
        ET.SubElement(custom, "text", name=f"{PROVENANCE_PREFIX} part_{k}", data=data)
    for k, sentence in enumerate(scene.unsaid):
        ET.SubElement(custom, "text", name=f"{PROVENANCE_PREFIX} unsaid_{k}", data=sentence)


def _materials(assets: ET.Element, scene: PhysicalScene, folder: Path) -> None:
    for k, finish in enumerate(scene.finishes):
        item = {"name": f"look_{k}", "rgba": xml_numbers(finish.colour)}
        if finish.texture is not None:
            write_picture(f"look_{k}", finish, folder)
            ET.SubElement(assets, "texture", name=f"look_{k}", type="2d", file=f"look_{k}.png")
            item["texture"] = f"look_{k}"
        ET.SubElement(assets, "material", item)


def _planes(world: ET.Element, scene: PhysicalScene) -> list[_PairGeom]:
    ET.SubElement(world, "light", pos="0 0 3", directional="true", dir="-0.3 0.4 -1")
    planes = [("floor", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    planes += [(f"wall_{k}", w.point, w.normal) for k, w in enumerate(scene.walls)]
    for name, point, normal in planes:
        attributes = {"name": name, "type": "plane", "size": "0 0 0.05", "pos": xml_numbers(point)}
        meeting = {"contype": "0", "conaffinity": FLEX_CONTACT_BIT}
        ET.SubElement(world, "geom", attributes | meeting | {"zaxis": xml_numbers(normal)})
    return [_PairGeom(name, -1, -1, "ground") for name, _, _ in planes]


def _rigid_body(solid: ExportedSolid, folder: Path, assets: ET.Element, world: ET.Element) -> list[_PairGeom]:
    body = ET.SubElement(world, "body", name=solid.name, pos=xml_numbers(solid.origin))
    ET.SubElement(body, "freejoint")
    I = solid.inertia  # noqa: E741
    six = [*np.diag(I), I[0, 1], I[0, 2], I[1, 2]]
    inertial = {"pos": "0 0 0", "mass": xml_numbers([solid.mass]), "fullinertia": xml_numbers(six)}
    ET.SubElement(body, "inertial", inertial)
    for name, finish in write_surfaces(solid, folder).items():
        seen = {"group": VISUAL_GROUP, "contype": "0", "conaffinity": "0", "material": f"look_{finish}"}
        _mesh(assets, body, name, "shell", seen)
    geoms = []
    shapes = [(f"{solid.name}_piece_{k}", c, "things") for k, c in enumerate(solid.pieces)]
    shapes += [(f"{solid.name}_hull", solid.hull, "ground")] if solid.hull else []
    for name, collider, meets in shapes:
        write_collider(name, collider.shape, folder)
        # Rigid objects meet only in pairs; the hull meets what can deform.
        affinity = FLEX_CONTACT_BIT if meets == "ground" else "0"
        own = {"group": COLLISION_GROUP, "contype": "0", "conaffinity": affinity}
        _mesh(assets, body, name, "convex", own)
        geoms.append(_PairGeom(name, solid.number, collider.part, meets))
    return geoms


def _mesh(assets: ET.Element, body: ET.Element, name: str, inertia: str, attributes: dict[str, str]) -> None:
    ET.SubElement(assets, "mesh", name=name, file=f"{name}.obj", inertia=inertia)
    ET.SubElement(body, "geom", {"name": name, "type": "mesh", "mesh": name, "mass": "0"} | attributes)


def _flex(solid: ExportedSolid, scene: PhysicalScene, world: ET.Element) -> None:
    """Add what can deform: elastic only, with the modulus of its heaviest part."""
    mesh, matter = tetrahedra_of(solid, scene.cell), scene.matter[solid.heaviest]
    item = ET.SubElement(
        world,
        "flexcomp",
        name=solid.name,
        type="direct",
        dim="3",
        dof="full",
        pos=xml_numbers(solid.origin),
        mass=xml_numbers([solid.mass]),
        radius=xml_numbers([FLEX_RADIUS_DX * TETRAHEDRON_CELL_DX * scene.cell]),
        point=xml_numbers(mesh.points),
        element=" ".join(map(str, mesh.corners.ravel().tolist())),
    )
    poisson = min(matter.treatment.poisson, MAX_FLEX_POISSON_RATIO)
    elastic = {"young": xml_numbers([matter.treatment.simulated_young_pa]), "poisson": xml_numbers([poisson])}
    ET.SubElement(item, "elasticity", elastic | {"damping": xml_numbers([FLEX_DAMPING_S])})
    ET.SubElement(
        item,
        "contact",
        selfcollide="none",
        contype=FLEX_CONTACT_BIT,
        conaffinity=FLEX_CONTACT_BIT,
        solref=xml_numbers([FLEX_CONTACT_TIME_S, 1.0]),
        friction=xml_numbers([scene.friction[solid.heaviest, -1], TORSIONAL_FRICTION_M, ROLLING_FRICTION_M]),
    )


def _contact_pairs(contact: ET.Element, scene: PhysicalScene, geoms: list[_PairGeom]) -> None:
    for a, b in combinations(geoms, 2):
        ground = a.solid < 0
        if a.solid == b.solid or b.meets != a.meets or (ground and b.solid < 0):
            continue
        if not ground and a.meets == "ground":
            continue  # hulls meet floor and walls only
        friction = float(scene.friction[a.part, b.part])
        # MuJoCo knows no speed too small to bounce: what lies at rest would creep.
        returned = 0.0 if scene.settled else float(scene.restitution[a.part, b.part])
        ratio = damping_ratio(returned)
        attributes = {"geom1": a.name, "geom2": b.name, "condim": "6"}
        attributes["friction"] = xml_numbers(
            [friction, friction, TORSIONAL_FRICTION_M, ROLLING_FRICTION_M, ROLLING_FRICTION_M]
        )
        attributes["solref"] = xml_numbers([CONTACT_TIME_S / ratio, ratio])
        ET.SubElement(contact, "pair", attributes | {"solimp": ".95 .99 .001 .5 2"})


def _start_keyframe(root: ET.Element, scene: PhysicalScene, soft: list[ExportedSolid]) -> None:
    """Give velocities as a keyframe; a free joint turns about the body's axes, here the world's."""
    rigid = [s for s in scene.solids if s.rigid]
    moving = [np.concatenate([s.velocity, s.spin]) for s in rigid]
    for solid in soft:
        points = len(tetrahedra_of(solid, scene.cell).points)
        moving.append(np.tile(solid.velocity, points))
    speeds = np.concatenate([np.zeros(0), *moving])
    if np.any(speeds):
        keys = ET.SubElement(root, "keyframe")
        ET.SubElement(keys, "key", name="start", qvel=xml_numbers(speeds))


def _not_written(asked: ExportRequest) -> list[str]:
    scene, sentences = asked.scene, []
    soft = [s for s in scene.solids if not s.rigid]
    if soft and asked.config.soft == "none":
        return [f"{', '.join(s.title for s in soft)} can deform and is left out."]
    for solid in soft:
        matter = scene.matter[solid.heaviest]
        if matter.material.yield_stress or matter.material.friction_angle:
            sentences.append(f"{solid.title} yields in corporeal; in MuJoCo it is elastic.")
        if len(solid.parts) > 1:
            sentences.append(f"All of {solid.title} has the modulus of {matter.name}.")
        if matter.treatment.poisson > MAX_FLEX_POISSON_RATIO:
            ratio = f"{matter.treatment.poisson:.3g}"
            sentences.append(f"Poisson's ratio of {matter.name} is {MAX_FLEX_POISSON_RATIO} in MuJoCo, not {ratio}.")
    if scene.settled:
        sentences.append("No restitution: in MuJoCo resting objects would creep.")
    return sentences
