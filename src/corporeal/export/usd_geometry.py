"""The layer ``geometry.usda``: shapes and looks, numbers without physics.

Schemas: UsdGeom, UsdShade, UsdPreviewSurface 2.6. Subdivision is ``none``, else a viewer would
round every mesh (Catmull–Clark is the default); st runs up where glTF's v runs down.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core.types import Finish, Surface
from corporeal.export.solids import PhysicalScene, Solid
from corporeal.export.target import Soft
from corporeal.export.usd_soft import grains_prim, tetrahedra_prim
from corporeal.geometry.convex_hull import Piece
from corporeal.io.usd_text import (
    Prim,
    integers,
    number,
    text,
    title,
    vector,
    vectors,
)

TEXTURES = "textures"
WORLD = "World"
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def geometry(scene: PhysicalScene, folder: Path, soft: Soft) -> Prim:
    """Return the tree of all shapes, and write the pictures on them beside it."""
    world = Prim("Xform", WORLD, metadata=[title(scene.title)])
    looks = world.add(Prim("Scope", "Looks"))
    for key in sorted({look_name(s) for b in scene.solids for s in b.surfaces}):
        coloured = key.endswith("_coloured")
        finish = int(key.removesuffix("_coloured").removeprefix("look_"))
        looks.add(_look(key, scene.finishes[finish], coloured, folder))
    for solid in scene.solids:
        world.add(_solid(solid, scene, soft))
    return world


def path_of(solid: Solid, *below: str) -> str:
    """Path of a solid's prim or of one below it."""
    return "/".join(("", WORLD, solid.name, *below))


def look_name(surface: Surface) -> str:
    """Name of the material that a surface is shown with."""
    return f"look_{surface.finish}" + ("_coloured" if surface.colours is not None else "")


def surface_name(number: int) -> str:
    """Name of a surface's mesh, by its number in the scene."""
    return f"surface_{number}"


def _solid(solid: Solid, scene: PhysicalScene, soft: Soft) -> Prim:
    prim = Prim("Xform", solid.name, metadata=[title(solid.title)])
    prim.set("double3", "xformOp:translate", vector(solid.origin))
    prim.set("quatf", "xformOp:orient", vector(IDENTITY))
    prim.set("uniform token[]", "xformOpOrder", '["xformOp:translate", "xformOp:orient"]')
    for number_, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
        prim.add(_surface(surface_name(number_), surface, scene))
    if solid.rigid:
        prim.add(_colliders(solid))
    elif soft != "none":
        prim.add(grains_prim(solid))
        prim.add(tetrahedra_prim(solid, scene))
    return prim


def _surface(name: str, surface: Surface, scene: PhysicalScene) -> Prim:
    prim = Prim("Mesh", name, ["MaterialBindingAPI"], [title(surface.name)])
    _fill(prim, surface.vertices, surface.triangles)
    if surface.normals is not None:
        prim.lines.append(_with(f"normal3f[] normals = {vectors(surface.normals)}", "vertex"))
    if surface.uv is not None:
        up = np.column_stack([surface.uv[:, 0], 1 - surface.uv[:, 1]])
        prim.lines.append(_with(f"texCoord2f[] primvars:st = {vectors(up)}", "vertex"))
    if surface.colours is not None:
        base = np.asarray(scene.finishes[surface.finish].colour[:3])
        shown = vectors(surface.colours[:, :3] * base)
        prim.lines.append(_with(f"color3f[] primvars:displayColor = {shown}", "vertex"))
    prim.relate("material:binding", [f"/{WORLD}/Looks/{look_name(surface)}"])
    return prim


def _fill(prim: Prim, vertices: np.ndarray, triangles: np.ndarray) -> None:
    prim.set("float3[]", "extent", vectors(np.array([vertices.min(axis=0), vertices.max(axis=0)])))
    prim.set("int[]", "faceVertexCounts", integers(np.full(len(triangles), 3)))
    prim.set("int[]", "faceVertexIndices", integers(triangles))
    prim.set("point3f[]", "points", vectors(vertices))
    prim.set("uniform token", "subdivisionScheme", text("none"))


def _with(line: str, interpolation: str) -> str:
    return f"{line} (\n    interpolation = {text(interpolation)}\n)"


def _colliders(solid: Solid) -> Prim:
    group = Prim("Scope", "colliders")
    for name, shape in named_colliders(solid):
        prim = group.add(Prim("Mesh", name))
        _fill(prim, shape.vertices, shape.triangles)
        prim.set("uniform token", "purpose", text("guide"))
    return group


def named_colliders(solid: Solid) -> Iterator[tuple[str, Piece]]:
    """Names and shapes of a rigid solid's pieces, then of its hull."""
    for k, collider in enumerate(solid.pieces):
        yield f"piece_{k}", collider.shape
    if solid.hull is not None:
        yield "hull", solid.hull.shape


# ---------------------------------------------------------------- looks


def _look(name: str, finish: Finish, coloured: bool, folder: Path) -> Prim:
    material, path = Prim("Material", name, metadata=[title(finish.name)]), f"/{WORLD}/Looks/{name}"
    material.lines.append(f"token outputs:surface.connect = <{path}/surface.outputs:surface>")
    shader = material.add(Prim("Shader", "surface"))
    shader.set("uniform token", "info:id", text("UsdPreviewSurface"))
    if finish.texture is not None and not coloured:
        shader.lines.append(_connected("color3f", "diffuseColor", f"{path}/picture", "rgb"))
        _picture(material, path, name, finish, folder)
    elif coloured:
        shader.lines.append(_connected("color3f", "diffuseColor", f"{path}/colours", "result"))
        reader = material.add(Prim("Shader", "colours"))
        reader.set("uniform token", "info:id", text("UsdPrimvarReader_float3"))
        reader.set("string", "inputs:varname", text("displayColor"))
        reader.lines.append("float3 outputs:result")
    else:
        shader.set("color3f", "inputs:diffuseColor", vector(finish.colour[:3]))
    shader.set("float", "inputs:metallic", number(finish.metallic))
    shader.set("float", "inputs:roughness", number(finish.roughness))
    if finish.glow:
        light = [finish.glow * c for c in finish.colour[:3]]
        shader.set("color3f", "inputs:emissiveColor", vector(light))
    _see_through(shader, path, finish, coloured)
    shader.lines.append("token outputs:surface")
    return material


def _see_through(shader: Prim, path: str, finish: Finish, coloured: bool) -> None:
    if finish.alpha_mode == "OPAQUE":
        if finish.transmission:
            shader.set("float", "inputs:opacity", number(1 - finish.transmission))
        return
    four = finish.texture is not None and finish.texture.shape[-1] == 4 and not coloured
    if four:
        shader.lines.append(_connected("float", "opacity", f"{path}/picture", "a"))
    else:
        shader.set("float", "inputs:opacity", number(finish.colour[3]))
    if finish.alpha_mode == "MASK":
        shader.set("float", "inputs:opacityThreshold", number(finish.alpha_cutoff))


def _picture(material: Prim, path: str, name: str, finish: Finish, folder: Path) -> None:
    (folder / TEXTURES).mkdir(exist_ok=True)
    Image.fromarray(np.asarray(finish.texture)).save(folder / TEXTURES / f"{name}.png")
    coordinates = material.add(Prim("Shader", "st"))
    coordinates.set("uniform token", "info:id", text("UsdPrimvarReader_float2"))
    coordinates.set("string", "inputs:varname", text("st"))
    coordinates.lines.append("float2 outputs:result")
    picture = material.add(Prim("Shader", "picture"))
    picture.set("uniform token", "info:id", text("UsdUVTexture"))
    picture.set("asset", "inputs:file", f"@./{TEXTURES}/{name}.png@")
    picture.set("float4", "inputs:scale", vector(finish.colour))
    picture.set("token", "inputs:sourceColorSpace", text("sRGB"))
    picture.lines.append(_connected("float2", "st", f"{path}/st", "result"))
    for axis in ("wrapS", "wrapT"):
        picture.set("token", f"inputs:{axis}", text("repeat"))
    picture.lines += ["float outputs:a", "float3 outputs:rgb"]


def _connected(kind: str, name: str, path: str, output: str) -> str:
    return f"{kind} inputs:{name}.connect = <{path}.outputs:{output}>"
