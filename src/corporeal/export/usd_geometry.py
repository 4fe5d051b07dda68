"""The layer ``geometry.usda``: shapes and appearance without physics.

Schemas: UsdGeom, UsdShade, UsdPreviewSurface 2.6. Subdivision is ``none``, else a viewer would round every mesh
(Catmull–Clark is the default); st runs up where glTF's v runs down.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core.types import Finish, Surface
from corporeal.export.export_target import SoftRepresentation
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.usd_deformables import material_points_prim, tetrahedra_prim
from corporeal.geometry.convex_hull import ConvexPiece
from corporeal.io.usd.usda_writer import (
    UsdPrim,
    usda_display_name,
    usda_integers,
    usda_number,
    usda_string,
    usda_vector,
    usda_vectors,
)

TEXTURE_FOLDER = "textures"
WORLD_PRIM = "World"
IDENTITY_QUATERNION = (1.0, 0.0, 0.0, 0.0)


def geometry_prims(scene: PhysicalScene, folder: Path, soft: SoftRepresentation) -> UsdPrim:
    """Return the tree of all shapes, and write the pictures on them beside it."""
    world = UsdPrim("Xform", WORLD_PRIM, metadata=[usda_display_name(scene.title)])
    looks = world.add(UsdPrim("Scope", "Looks"))
    for key in sorted({look_name(s) for b in scene.solids for s in b.surfaces}):
        coloured = key.endswith("_coloured")
        finish = int(key.removesuffix("_coloured").removeprefix("look_"))
        looks.add(_material_prim(key, scene.finishes[finish], coloured, folder))
    for solid in scene.solids:
        world.add(_solid(solid, scene, soft))
    return world


def solid_path(solid: ExportedSolid, *below: str) -> str:
    """Path of a solid's prim or of one below it."""
    return "/".join(("", WORLD_PRIM, solid.name, *below))


def look_name(surface: Surface) -> str:
    """Name of the material that a surface is shown with."""
    return f"look_{surface.finish}" + ("_coloured" if surface.colours is not None else "")


def surface_name(number: int) -> str:
    """Name of a surface's mesh, by its number in the scene."""
    return f"surface_{number}"


def _solid(solid: ExportedSolid, scene: PhysicalScene, soft: SoftRepresentation) -> UsdPrim:
    prim = UsdPrim("Xform", solid.name, metadata=[usda_display_name(solid.title)])
    prim.set("double3", "xformOp:translate", usda_vector(solid.origin))
    prim.set("quatf", "xformOp:orient", usda_vector(IDENTITY_QUATERNION))
    prim.set("uniform token[]", "xformOpOrder", '["xformOp:translate", "xformOp:orient"]')
    for number_, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
        prim.add(_surface(surface_name(number_), surface, scene))
    if solid.rigid:
        prim.add(_colliders(solid))
    elif soft != "none":
        prim.add(material_points_prim(solid))
        prim.add(tetrahedra_prim(solid, scene))
    return prim


def _surface(name: str, surface: Surface, scene: PhysicalScene) -> UsdPrim:
    prim = UsdPrim("Mesh", name, ["MaterialBindingAPI"], [usda_display_name(surface.name)])
    _fill(prim, surface.vertices, surface.triangles)
    if surface.normals is not None:
        prim.lines.append(_with_interpolation(f"normal3f[] normals = {usda_vectors(surface.normals)}", "vertex"))
    if surface.uv is not None:
        up = np.column_stack([surface.uv[:, 0], 1 - surface.uv[:, 1]])
        prim.lines.append(_with_interpolation(f"texCoord2f[] primvars:st = {usda_vectors(up)}", "vertex"))
    if surface.colours is not None:
        base = np.asarray(scene.finishes[surface.finish].colour[:3])
        shown = usda_vectors(surface.colours[:, :3] * base)
        prim.lines.append(_with_interpolation(f"color3f[] primvars:displayColor = {shown}", "vertex"))
    prim.relate("material:binding", [f"/{WORLD_PRIM}/Looks/{look_name(surface)}"])
    return prim


def _fill(prim: UsdPrim, vertices: np.ndarray, triangles: np.ndarray) -> None:
    prim.set("float3[]", "extent", usda_vectors(np.array([vertices.min(axis=0), vertices.max(axis=0)])))
    prim.set("int[]", "faceVertexCounts", usda_integers(np.full(len(triangles), 3)))
    prim.set("int[]", "faceVertexIndices", usda_integers(triangles))
    prim.set("point3f[]", "points", usda_vectors(vertices))
    prim.set("uniform token", "subdivisionScheme", usda_string("none"))


def _with_interpolation(line: str, interpolation: str) -> str:
    return f"{line} (\n    interpolation = {usda_string(interpolation)}\n)"


def _colliders(solid: ExportedSolid) -> UsdPrim:
    group = UsdPrim("Scope", "colliders")
    for name, shape in named_colliders(solid):
        prim = group.add(UsdPrim("Mesh", name))
        _fill(prim, shape.vertices, shape.triangles)
        prim.set("uniform token", "purpose", usda_string("guide"))
    return group


def named_colliders(solid: ExportedSolid) -> Iterator[tuple[str, ConvexPiece]]:
    """Names and shapes of a rigid solid's pieces, then of its hull."""
    for k, collider in enumerate(solid.pieces):
        yield f"piece_{k}", collider.shape
    if solid.hull is not None:
        yield "hull", solid.hull.shape


def _material_prim(name: str, finish: Finish, coloured: bool, folder: Path) -> UsdPrim:
    material, path = (
        UsdPrim("Material", name, metadata=[usda_display_name(finish.name)]),
        f"/{WORLD_PRIM}/Looks/{name}",
    )
    material.lines.append(f"token outputs:surface.connect = <{path}/surface.outputs:surface>")
    shader = material.add(UsdPrim("Shader", "surface"))
    shader.set("uniform token", "info:id", usda_string("UsdPreviewSurface"))
    if finish.texture is not None and not coloured:
        shader.lines.append(_connected("color3f", "diffuseColor", f"{path}/picture", "rgb"))
        _picture(material, path, name, finish, folder)
    elif coloured:
        shader.lines.append(_connected("color3f", "diffuseColor", f"{path}/colours", "result"))
        reader = material.add(UsdPrim("Shader", "colours"))
        reader.set("uniform token", "info:id", usda_string("UsdPrimvarReader_float3"))
        reader.set("string", "inputs:varname", usda_string("displayColor"))
        reader.lines.append("float3 outputs:result")
    else:
        shader.set("color3f", "inputs:diffuseColor", usda_vector(finish.colour[:3]))
    shader.set("float", "inputs:metallic", usda_number(finish.metallic))
    shader.set("float", "inputs:roughness", usda_number(finish.roughness))
    if finish.emission:
        light = [finish.emission * c for c in finish.colour[:3]]
        shader.set("color3f", "inputs:emissiveColor", usda_vector(light))
    _add_transparency(shader, path, finish, coloured)
    shader.lines.append("token outputs:surface")
    return material


def _add_transparency(shader: UsdPrim, path: str, finish: Finish, coloured: bool) -> None:
    if finish.alpha_mode == "OPAQUE":
        if finish.transmission:
            shader.set("float", "inputs:opacity", usda_number(1 - finish.transmission))
        return
    four = finish.texture is not None and finish.texture.shape[-1] == 4 and not coloured
    if four:
        shader.lines.append(_connected("float", "opacity", f"{path}/picture", "a"))
    else:
        shader.set("float", "inputs:opacity", usda_number(finish.colour[3]))
    if finish.alpha_mode == "MASK":
        shader.set("float", "inputs:opacityThreshold", usda_number(finish.alpha_cutoff))


def _picture(material: UsdPrim, path: str, name: str, finish: Finish, folder: Path) -> None:
    (folder / TEXTURE_FOLDER).mkdir(exist_ok=True)
    Image.fromarray(np.asarray(finish.texture)).save(folder / TEXTURE_FOLDER / f"{name}.png")
    coordinates = material.add(UsdPrim("Shader", "st"))
    coordinates.set("uniform token", "info:id", usda_string("UsdPrimvarReader_float2"))
    coordinates.set("string", "inputs:varname", usda_string("st"))
    coordinates.lines.append("float2 outputs:result")
    picture = material.add(UsdPrim("Shader", "picture"))
    picture.set("uniform token", "info:id", usda_string("UsdUVTexture"))
    picture.set("asset", "inputs:file", f"@./{TEXTURE_FOLDER}/{name}.png@")
    picture.set("float4", "inputs:scale", usda_vector(finish.colour))
    picture.set("token", "inputs:sourceColorSpace", usda_string("sRGB"))
    picture.lines.append(_connected("float2", "st", f"{path}/st", "result"))
    for axis in ("wrapS", "wrapT"):
        picture.set("token", f"inputs:{axis}", usda_string("repeat"))
    picture.lines += ["float outputs:a", "float3 outputs:rgb"]


def _connected(kind: str, name: str, path: str, output: str) -> str:
    return f"{kind} inputs:{name}.connect = <{path}.outputs:{output}>"
