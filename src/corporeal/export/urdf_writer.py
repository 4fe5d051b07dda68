"""Rigid solids as URDF, one file each: one link with mass, inertia, looks and convex pieces.

URDF has neither poses nor motion of bodies: they are in ``placements.json``.
"""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from corporeal.core.store import write_json
from corporeal.export.export_target import ExportRequest, NothingToWriteError, WrittenTarget
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.mesh_files import MESH_FOLDER, write_collider, write_surfaces, write_xml, xml_comment, xml_numbers

PLACEMENTS_FILE_NAME = "placements.json"


def write_urdf(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write a file for every rigid solid.

    Raises:
        NothingToWriteError: Nothing is rigid.
    """
    scene = asked.scene
    rigid = [s for s in scene.solids if s.rigid]
    if not rigid:
        raise NothingToWriteError(f"Nothing of {scene.title} is rigid, and URDF has rigid bodies only.")
    for solid in rigid:
        write_xml(folder / f"{solid.name}.urdf", _robot(solid, scene, folder))
    write_json(folder / PLACEMENTS_FILE_NAME, {s.name: _placement(s) for s in rigid})
    soft = [s.title for s in scene.solids if not s.rigid]
    sentences = ["Each body has one friction, that with the floor; URDF has no restitution."]
    sentences += [f"{', '.join(soft)} can deform and is left out."] if soft else []
    return WrittenTarget(tuple(sentences))


def _placement(solid: ExportedSolid) -> dict:
    return {
        "title": solid.title,
        "position_m": solid.origin,
        "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0],
        "velocity_m_s": solid.velocity,
        "angular_velocity_rad_s": solid.spin,
    }


def _robot(solid: ExportedSolid, scene: PhysicalScene, folder: Path) -> ET.Element:
    robot = ET.Element("robot", name=solid.name)
    for part in solid.parts:
        data = json.dumps(scene.matter[part].provenance, ensure_ascii=False, allow_nan=False)
        robot.append(xml_comment(f"corporeal part_{part} {data}"))
    link = ET.SubElement(robot, "link", name="body")
    _inertial(link, solid)
    friction = float(scene.friction[solid.heaviest, -1])
    # Bullet's own element; other readers leave it out.
    law = ET.SubElement(link, "contact")
    ET.SubElement(law, "lateral_friction", value=xml_numbers([friction]))
    for name, finish in write_surfaces(solid, folder).items():
        visual = _shape(link, "visual", name)
        material = ET.SubElement(visual, "material", name=f"look_{finish}")
        ET.SubElement(material, "color", rgba=xml_numbers(scene.finishes[finish].colour))
    for k, collider in enumerate(solid.pieces):
        name = f"{solid.name}_piece_{k}"
        write_collider(name, collider.shape, folder)
        _shape(link, "collision", name)
    return robot


def _inertial(link: ET.Element, solid: ExportedSolid) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz="0 0 0", rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=xml_numbers([solid.mass]))
    six = {
        f"i{'xyz'[row]}{'xyz'[column]}": xml_numbers([solid.inertia[row, column]])
        for row, column in zip(*np.triu_indices(3), strict=True)
    }
    ET.SubElement(inertial, "inertia", six)


def _shape(link: ET.Element, role: str, name: str) -> ET.Element:
    item = ET.SubElement(link, role)
    ET.SubElement(item, "origin", xyz="0 0 0", rpy="0 0 0")
    shape = ET.SubElement(item, "geometry")
    ET.SubElement(shape, "mesh", filename=f"{MESH_FOLDER}/{name}.obj")
    return item
