"""A scene as MJCF for MuJoCo: ``scene.xml`` with meshes beside it.

Every two shapes that may meet are an explicit contact pair with the friction of the two materials;
MuJoCo itself would take the larger of two coefficients. The floor meets convex hulls, things meet
one another with their convex pieces. Restitution e is a damping ratio: a linear spring of damping
ratio ζ returns e = exp(-π ζ / √(1 - ζ²)) of a speed. What can deform is a flex of tetrahedra.
"""

import json
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from corporeal.core.version import __version__
from corporeal.export.friction import ROLLING, SPINNING
from corporeal.export.meshes import FOLDER, write_collider, write_picture, write_surfaces
from corporeal.export.solids import PhysicalScene, Solid
from corporeal.export.target import Asked, Written
from corporeal.export.usd_soft import CELLS, tetrahedra_of
from corporeal.io.xml_text import comment, words, write_xml
from corporeal.recognition.words import writable

NAME = "scene.xml"
CONTACT = 4e-3
"""1/ω of a contact's spring [s]: what meets at a speed v sinks in by about v/ω; the step must be a
quarter of it. At twice the stiffness piles of light things come apart."""
STEP = CONTACT / 4
FLEX_CONTACT = 8e-3
"""Time constant of the contacts of what can deform [s]."""
INELASTIC = 0.01
"""Restitution below it is none."""
POISSON = 0.45
"""Largest that the tetrahedra of MuJoCo bear: they lock above it [-]."""
FLEX_RADIUS = 0.05
"""Of a cell: skin of what can deform."""
FLEX_DAMPING = 1e-3
"""Of the tetrahedra [s]."""
ONLY_FLEX = "4"
"""Bit of contype and conaffinity by which what can deform meets everything else."""
MEMORY = "1G"
SIMULATED = "corporeal"
VIEWED, COLLIDING = "2", "3"
"""Groups of geoms: what is seen, what collides (hidden until one asks for it)."""


@dataclass(frozen=True)
class _Geom:
    """A geom that may meet others in pairs."""

    name: str
    solid: int
    """-1: floor and walls."""
    part: int
    """-1: floor and walls."""
    meets: str
    """Whose pairs it is in: "ground" or "things"."""


def write_mjcf(asked: Asked, folder: Path) -> Written:
    """Write ``scene.xml`` and its meshes."""
    scene = asked.scene
    soft = [s for s in scene.solids if not s.rigid] if asked.config.soft != "none" else []
    root = ET.Element("mujoco", model=scene.name)
    root.append(comment(_words(scene)))
    ET.SubElement(root, "compiler", meshdir=FOLDER, texturedir=FOLDER)
    _option(root, scene, bool(soft))
    ET.SubElement(root, "size", memory=MEMORY)
    defaults = ET.SubElement(root, "default")
    # A flex and a geom that meet take the larger friction: the flex's, which has ours.
    ET.SubElement(defaults, "geom", friction="0 0 0")
    _provenance(root, scene)
    assets, world, contact = (ET.SubElement(root, n) for n in ("asset", "worldbody", "contact"))
    _looks(assets, scene, folder)
    geoms = _grounds(world, scene)
    for solid in (s for s in scene.solids if s.rigid):
        geoms += _rigid(solid, folder, assets, world)
    for solid in soft:
        _flex(solid, scene, world)
    _pairs(contact, scene, geoms)
    _start(root, scene, soft)
    write_xml(folder / NAME, root)
    return Written(tuple(_unsaid(asked)))


def damping_ratio(restitution: float) -> float:
    """ζ of the linear spring that returns a share e of a speed: e = exp(-π ζ / √(1 - ζ²))."""
    if restitution <= INELASTIC:
        return 1.0
    loss = -float(np.log(restitution))
    return loss / float(np.hypot(np.pi, loss))


def _words(scene: PhysicalScene) -> str:
    credits = f" Contains: {'; '.join(scene.credits)}." if scene.credits else ""
    return writable(f"{scene.title}, written by corporeal {__version__}.{credits}")


def _option(root: ET.Element, scene: PhysicalScene, soft: bool) -> None:
    # MuJoCo 4 needs the integrator "discrete" for a flex of this stiffness; that has no noslip.
    solver = ("discrete", "0") if soft else ("implicitfast", "4")
    ET.SubElement(
        root,
        "option",
        timestep=f"{STEP:g}",
        gravity=words(scene.gravity),
        cone="elliptic",
        iterations="100",
        integrator=solver[0],
        noslip_iterations=solver[1],
    )


def _provenance(root: ET.Element, scene: PhysicalScene) -> None:
    custom = ET.SubElement(root, "custom")
    for k, matter in enumerate(scene.matter):
        data = json.dumps(matter.provenance, ensure_ascii=False, allow_nan=False)
        ET.SubElement(custom, "text", name=f"{SIMULATED} part_{k}", data=data)
    for k, sentence in enumerate(scene.unsaid):
        ET.SubElement(custom, "text", name=f"{SIMULATED} unsaid_{k}", data=sentence)


def _looks(assets: ET.Element, scene: PhysicalScene, folder: Path) -> None:
    for k, finish in enumerate(scene.finishes):
        item = {"name": f"look_{k}", "rgba": words(finish.colour)}
        if finish.texture is not None:
            write_picture(f"look_{k}", finish, folder)
            ET.SubElement(assets, "texture", name=f"look_{k}", type="2d", file=f"look_{k}.png")
            item["texture"] = f"look_{k}"
        ET.SubElement(assets, "material", item)


# ---------------------------------------------------------------- bodies


def _grounds(world: ET.Element, scene: PhysicalScene) -> list[_Geom]:
    ET.SubElement(world, "light", pos="0 0 3", directional="true", dir="-0.3 0.4 -1")
    planes = [("floor", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    planes += [(f"wall_{k}", w.point, w.normal) for k, w in enumerate(scene.walls)]
    for name, point, normal in planes:
        attributes = {"name": name, "type": "plane", "size": "0 0 0.05", "pos": words(point)}
        meeting = {"contype": "0", "conaffinity": ONLY_FLEX}
        ET.SubElement(world, "geom", attributes | meeting | {"zaxis": words(normal)})
    return [_Geom(name, -1, -1, "ground") for name, _, _ in planes]


def _rigid(solid: Solid, folder: Path, assets: ET.Element, world: ET.Element) -> list[_Geom]:
    body = ET.SubElement(world, "body", name=solid.name, pos=words(solid.origin))
    ET.SubElement(body, "freejoint")
    I = solid.inertia  # noqa: E741
    six = [*np.diag(I), I[0, 1], I[0, 2], I[1, 2]]
    inertial = {"pos": "0 0 0", "mass": words([solid.mass]), "fullinertia": words(six)}
    ET.SubElement(body, "inertial", inertial)
    for name, finish in write_surfaces(solid, folder).items():
        seen = {"group": VIEWED, "contype": "0", "conaffinity": "0", "material": f"look_{finish}"}
        _mesh(assets, body, name, "shell", seen)
    geoms = []
    shapes = [(f"{solid.name}_piece_{k}", c, "things") for k, c in enumerate(solid.pieces)]
    shapes += [(f"{solid.name}_hull", solid.hull, "ground")] if solid.hull else []
    for name, collider, meets in shapes:
        write_collider(name, collider.shape, folder)
        # Rigid things meet only in pairs; the hull meets what can deform.
        affinity = ONLY_FLEX if meets == "ground" else "0"
        own = {"group": COLLIDING, "contype": "0", "conaffinity": affinity}
        _mesh(assets, body, name, "convex", own)
        geoms.append(_Geom(name, solid.number, collider.part, meets))
    return geoms


def _mesh(
    assets: ET.Element, body: ET.Element, name: str, inertia: str, attributes: dict[str, str]
) -> None:
    ET.SubElement(assets, "mesh", name=name, file=f"{name}.obj", inertia=inertia)
    ET.SubElement(
        body, "geom", {"name": name, "type": "mesh", "mesh": name, "mass": "0"} | attributes
    )


def _flex(solid: Solid, scene: PhysicalScene, world: ET.Element) -> None:
    """Add what can deform: elastic only, with the modulus of its heaviest part."""
    mesh, matter = tetrahedra_of(solid, scene.cell), scene.matter[solid.heaviest]
    item = ET.SubElement(
        world,
        "flexcomp",
        name=solid.name,
        type="direct",
        dim="3",
        dof="full",
        pos=words(solid.origin),
        mass=words([solid.mass]),
        radius=words([FLEX_RADIUS * CELLS * scene.cell]),
        point=words(mesh.points),
        element=" ".join(map(str, mesh.corners.ravel().tolist())),
    )
    poisson = min(matter.treatment.poisson, POISSON)
    elastic = {"young": words([matter.treatment.young]), "poisson": words([poisson])}
    ET.SubElement(item, "elasticity", elastic | {"damping": words([FLEX_DAMPING])})
    ET.SubElement(
        item,
        "contact",
        selfcollide="none",
        contype=ONLY_FLEX,
        conaffinity=ONLY_FLEX,
        solref=words([FLEX_CONTACT, 1.0]),
        friction=words([scene.friction[solid.heaviest, -1], SPINNING, ROLLING]),
    )


def _pairs(contact: ET.Element, scene: PhysicalScene, geoms: list[_Geom]) -> None:
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
        attributes["friction"] = words([friction, friction, SPINNING, ROLLING, ROLLING])
        attributes["solref"] = words([CONTACT / ratio, ratio])
        ET.SubElement(contact, "pair", attributes | {"solimp": ".95 .99 .001 .5 2"})


def _start(root: ET.Element, scene: PhysicalScene, soft: list[Solid]) -> None:
    """Give velocities as a keyframe; a free joint turns about the body's axes, here the world's."""
    rigid = [s for s in scene.solids if s.rigid]
    moving = [np.concatenate([s.velocity, s.spin]) for s in rigid]
    for solid in soft:
        points = len(tetrahedra_of(solid, scene.cell).points)
        moving.append(np.tile(solid.velocity, points))
    speeds = np.concatenate([np.zeros(0), *moving])
    if np.any(speeds):
        keys = ET.SubElement(root, "keyframe")
        ET.SubElement(keys, "key", name="start", qvel=words(speeds))


def _unsaid(asked: Asked) -> list[str]:
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
        if matter.treatment.poisson > POISSON:
            ratio = f"{matter.treatment.poisson:.3g}"
            sentences.append(
                f"Poisson's ratio of {matter.name} is {POISSON} in MuJoCo, not {ratio}."
            )
    if scene.settled:
        sentences.append("Nothing bounces: in MuJoCo what lies at rest would creep.")
    return sentences
