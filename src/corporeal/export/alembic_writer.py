"""A scene as Alembic: the vertices of every surface at every frame, for video and effects tools.

Alembic does not define axes or orientation; the convention is +Y up and clockwise faces. Written with alembic3d, an
unofficial build of PyAlembic under a name of its own.
"""

# The library is optional.
# pyright: reportMissingImports=false

import json
from pathlib import Path

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.store import require_disk_space
from corporeal.core.types import Surface
from corporeal.core.version import __version__
from corporeal.export.export_target import ExportRequest, NothingToWriteError, WrittenTarget
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene

ALEMBIC_FILE_NAME = "video.abc"
Z_UP_TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rows: Alembic's x, y and z of ours."""
PROVENANCE_PROPERTY = "corporeal"


def write_alembic(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write ``video.abc``.

    Raises:
        NothingToWriteError: Nothing moves.
        UserError: The library is not installed.
    """
    if not asked.motion.moves:
        raise NothingToWriteError("Nothing was simulated, and Alembic needs motion.")
    try:
        from alembic3d import Abc, AbcCoreAbstract, AbcGeom
    except ImportError as error:
        raise UserError("Alembic needs alembic3d. Install it with: pip install 'corporeal[export]'.") from error
    scene = asked.scene
    shapes = asked.motion.shapes(scene.solids)
    # The library ends the process where the disk is full.
    require_disk_space(folder, 2 * shapes.vertices.nbytes)
    # What describes an archive must not hold ; or =, so that credits stand at the objects.
    archive = Abc.CreateArchiveWithInfo(
        str(folder / ALEMBIC_FILE_NAME), float(scene.fps), f"corporeal {__version__}", scene.name
    )
    clock = AbcCoreAbstract.TimeSampling(1.0 / scene.fps, 0.0)
    archive.addTimeSampling(clock)
    for solid in scene.solids:
        node = AbcGeom.OXform(archive.getTop(), solid.name)
        properties = node.getSchema().getUserProperties()
        Abc.OStringProperty(properties, PROVENANCE_PROPERTY).setValue(_provenance(scene, solid))
        for number, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
            mesh = AbcGeom.OPolyMesh(node, f"surface_{number}")
            schema = mesh.getSchema()
            schema.setTimeSampling(clock)
            _fill_mesh(schema, surface, *shapes.of(number))
    return WrittenTarget(("Appearance is left out: Alembic has none.",))


def _provenance(scene: PhysicalScene, solid: ExportedSolid) -> str:
    about = {"title": solid.title, "mass_kg": solid.mass, "rigid": solid.rigid}
    about |= {"parts": [scene.matter[k].provenance for k in solid.parts]}
    about |= {"credits": list(scene.credits)}
    return json.dumps(about, ensure_ascii=False, allow_nan=False)


def _fill_mesh(schema, surface: Surface, vertices: np.ndarray, normals: np.ndarray) -> None:
    """Give a mesh its vertices at every frame; faces and texture coordinates stay."""
    import imath  # comes with alembic3d
    from alembic3d import AbcGeom

    vertex, varying = AbcGeom.GeometryScope.kVertexScope, surface.normals is not None
    corners = np.ascontiguousarray(surface.triangles[:, ::-1].ravel(), np.int32)
    faces = imath.IntArrayFromBuffer(corners)
    counts = imath.IntArrayFromBuffer(np.full(len(surface.triangles), 3, np.int32))
    uv = AbcGeom.OV2fGeomParamSample()
    if surface.uv is not None:
        up = np.column_stack([surface.uv[:, 0], 1 - surface.uv[:, 1]]).astype(np.float32)
        uv = AbcGeom.OV2fGeomParamSample(imath.V2fArrayFromBuffer(up), vertex)
    for place, normal in zip(vertices, normals, strict=True):
        given = [_to_y_up(place), faces, counts]
        if varying:
            given += [uv, AbcGeom.ON3fGeomParamSample(_to_y_up(normal), vertex)]
        elif surface.uv is not None:
            given += [uv]
        schema.set(AbcGeom.OPolyMeshSchemaSample(*given))


def _to_y_up(vectors: np.ndarray):
    """Return our vectors as Alembic's."""
    import imath

    return imath.V3fArrayFromBuffer(np.ascontiguousarray(vectors @ Z_UP_TO_Y_UP.T, np.float32))
