"""Meshes of USD, USDA, USDC and USDZ at the first time sample, in the axes and unit of the stage.

What UsdPhysics says of bodies and their material comes along (``usd_bodies.py``).

Shapes that USD states by numbers (cube, sphere, capsule, cone, cylinder, plane) become triangles. A layer, and an
image, must lie in the folder of the file, or in the package itself.

Source: OpenUSD 26.11, UsdGeom (mesh, subset, primvar, stage metrics; ``size``, ``radius``, ``height``, ``axis``: the
height of a capsule is that of its cylinder, all are centred at the origin, the tip of a cone points along its axis),
UsdShade (UsdPreviewSurface).
"""

# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false, reportArgumentType=false, reportOptionalIterable=false

import io
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdShade, UsdUtils

from corporeal.core.errors import BadFileError
from corporeal.core.types import STATED_MATTER_KEY, SUBSTANCE_KEY, Finish, Surface
from corporeal.io.gltf.gltf_materials import DEFAULT_FINISH
from corporeal.io.image_decoder import as_reduced_array
from corporeal.io.mesh.raw_mesh import MESH_EXPORT_ADVICE, NODE_NAMES_KEY, RawMesh
from corporeal.io.usd.usd_bodies import StatedBody, StatedMaterial, custom_data_of, physical_material, read_stage_bodies

CIRCLE_SEGMENTS = 48
"""Corners of a circle."""
SPHERE_SUBDIVISIONS = 4
"""Subdivisions of the icosahedron that a sphere is made of."""
ROTATION_FROM_Z_TO_AXIS = {
    "X": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "Y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "Z": np.eye(3),
}
"""Rotations that take +Z to the axis that is named."""


def is_usd_shape(prim: Usd.Prim) -> bool:
    """Whether a prim is one of these shapes."""
    return prim.GetTypeName() in SHAPE_MAKERS


def shape_triangles(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[np.ndarray, np.ndarray] | None:
    """Return corners (V, 3) in the prim's frame and triangles (T, 3), outward; None: no size."""

    def number(name: str) -> float:
        value = prim.GetAttribute(name).Get(time)
        return float(value) if value is not None else 0.0

    kind = prim.GetTypeName()
    names, make = SHAPE_MAKERS[kind]
    sizes = [number(name) for name in names]
    if not all(np.isfinite(sizes)) or min(sizes) < 0 or sizes[0] == 0:
        return None
    made = make(*sizes)
    axis = UsdGeom.Tokens.z if kind in ("Cube", "Sphere") else prim.GetAttribute("axis").Get(time)
    return np.asarray(made.vertices) @ ROTATION_FROM_Z_TO_AXIS[str(axis)].T, np.asarray(made.faces, np.int64)


def _cone(radius: float, height: float) -> trimesh.Trimesh:
    made = trimesh.creation.cone(radius, height, sections=CIRCLE_SEGMENTS)
    return made.apply_translation([0.0, 0.0, -0.5 * height])


SHAPE_MAKERS = {
    "Cube": (("size",), lambda size: trimesh.creation.box((size, size, size))),
    "Sphere": (("radius",), lambda radius: trimesh.creation.icosphere(SPHERE_SUBDIVISIONS, radius)),
    "Cylinder": (
        ("radius", "height"),
        lambda radius, height: trimesh.creation.cylinder(radius, height, sections=CIRCLE_SEGMENTS),
    ),
    "Capsule": (
        ("radius", "height"),
        lambda radius, height: trimesh.creation.capsule(height, radius, count=[CIRCLE_SEGMENTS, CIRCLE_SEGMENTS]),
    ),
    "Cone": (("radius", "height"), _cone),
}
"""Type of a prim → the attributes that say its size, and what makes it along +Z."""


FIRST_TIME_CODE = Usd.TimeCode.EarliestTime()
MAX_TEXTURE_BYTES = 2**27
"""[bytes]"""
UNREAD_SHAPES = "shapes that are no meshes"
UV_PRIMVAR_NAMES = ("st", "UVMap", "st0", "uv", "map1")
"""Names that programs give to texture coordinates; ``st`` is the usual one."""


def read_usd(path: Path) -> RawMesh:
    """Read all visible meshes of a stage.

    Raises:
        BadFileError: It cannot be read, or leads out of its folder.
    """
    stage = _open_stage(path)
    unit = _unit(path, UsdGeom.GetStageMetersPerUnit(stage))  # 0.01 where it states none
    lost: Counter[str] = Counter()
    looks = _UsdFinishes(path.parent)
    bodies = read_stage_bodies(stage, path)
    surfaces = tuple(
        _with_bound_substance(surface, _bound_substance(prim, path, bodies))
        for prim in _visible_prims(stage, lost)
        for surface in (_shape_surfaces if is_usd_shape(prim) else _surfaces)(path, prim, looks)
    )
    lost["spins of bodies"] += sum(b.turns for b in bodies)
    return RawMesh(
        surfaces,
        tuple(looks.finishes),
        up="+y" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else "+z",
        unit=unit,
        lost=tuple(f"{what} ({count})" for what, count in (lost + looks.lost).items()),
        bodies={b.path: {"title": b.title, "mass": b.mass, "velocity": b.velocity, "custom": b.custom} for b in bodies},
        custom=custom_data_of(stage.GetDefaultPrim()).get("scene", {}),
    )


def _bound_substance(prim: Usd.Prim, path: Path, bodies: tuple[StatedBody, ...]) -> StatedMaterial | None:
    """Return what a mesh is made of: as bound to it, else as all colliders of its body are."""
    own = physical_material(prim, path, prim.GetStage())
    about = [b for b in bodies if prim.GetPath().HasPrefix(Sdf.Path(b.path))]
    if own is None and about and len(about[-1].materials) == 1:
        return about[-1].materials[0]
    return own


def _with_bound_substance(surface: Surface, matter: StatedMaterial | None) -> Surface:
    """Write down at a surface what it is made of, as ``vlm.stated`` reads it."""
    if matter is None:
        return surface
    values = {name: asdict(value) for name, value in matter.values.items()}
    stated = {"values": values, "words": dict(matter.custom.get("words", {}))}
    name = str(matter.custom.get("name") or surface.name)  # of the part
    extras = surface.extras | {SUBSTANCE_KEY: matter.name, STATED_MATTER_KEY: stated}
    return replace(surface, name=name, extras=extras)


def _unit(path: Path, metres: float) -> float:
    if not 0 < metres < np.inf:
        raise BadFileError(path, f"states that a unit is {metres:g} m.", MESH_EXPORT_ADVICE)
    return float(metres)


def usd_companions(path: Path) -> list[str]:
    """Return the files that a stage is made of, beside itself."""
    _check_layers(path)
    layers, assets, _ = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
    named = [layer.realPath for layer in layers] + list(assets)
    own = path.resolve()
    inside = [Path(n) for n in named if n and "[" not in n and _is_inside(n, path.parent)]
    return sorted({str(p) for p in inside if p.resolve() != own and p.is_file()})


def _is_inside(name: str, folder: Path) -> bool:
    """Whether a path, or a package's with a path in it ("a.usdz[b.png]"), lies in a folder."""
    return Path(name.partition("[")[0]).resolve().is_relative_to(folder.resolve())


def _open_stage(path: Path) -> Usd.Stage:
    _check_layers(path)
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as problem:
        raise BadFileError(path, "cannot be read as USD.", MESH_EXPORT_ADVICE) from problem
    for layer in stage.GetUsedLayers():
        if layer.realPath and not _is_inside(layer.realPath, path.parent):
            _is_outside_folder(path, layer.realPath)
    return stage


def _check_layers(path: Path) -> None:
    """Reject a file whose layers lead out of its folder, before any of these is opened."""
    known, todo = set(), [str(path)]
    while todo:
        name = todo.pop()
        if name in known:
            continue
        known.add(name)
        try:
            layer = Sdf.Layer.FindOrOpen(name)
        except Tf.ErrorException:
            layer = None
        if layer is None:
            if name == str(path):
                raise BadFileError(path, "cannot be read as USD.", MESH_EXPORT_ADVICE)
            continue  # a layer that is not there leaves its part of the scene out
        for asset in filter(None, layer.GetCompositionAssetDependencies()):  # "": the layer itself
            place = layer.ComputeAbsolutePath(asset)
            if not _is_inside(place, path.parent):
                _is_outside_folder(path, asset)
            todo.append(place)


def _is_outside_folder(path: Path, name: str) -> None:
    what = f"names {name[:80]!r}, which lies outside its folder."
    raise BadFileError(path, what, "Put all its layers into one folder, or pack it as .usdz.")


def _visible_prims(stage: Usd.Stage, lost: Counter[str]) -> Iterator[Usd.Prim]:
    """Yield meshes and simple shapes that a render would show; count what else it would show."""
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        image = UsdGeom.Imageable(prim)
        if not image or not prim.IsA(UsdGeom.Boundable):
            continue
        hidden = image.ComputeVisibility(FIRST_TIME_CODE) == UsdGeom.Tokens.invisible
        if hidden or image.ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
            continue
        if prim.IsA(UsdGeom.Mesh) or is_usd_shape(prim):
            yield prim
        elif prim.IsA(UsdGeom.Plane):
            continue  # the floor, which is always there
        elif prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer):
            lost[UNREAD_SHAPES] += 1


def _shape_surfaces(path: Path, prim: Usd.Prim, looks: "_UsdFinishes") -> Iterator[Surface]:
    """Yield a cube, a sphere and the like as triangles."""
    found = shape_triangles(prim, FIRST_TIME_CODE)
    if found is None:
        return
    world, turn = _world_points(prim, found[0])
    bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    yield Surface(
        name=prim.GetDisplayName() or prim.GetName(),
        object=0,
        finish=looks.number(bound, UsdGeom.Gprim(prim)),
        vertices=world,
        triangles=found[1] if turn > 0 else np.ascontiguousarray(found[1][:, ::-1]),
        extras={NODE_NAMES_KEY: str(prim.GetPath()).strip("/").split("/")},
    )


def _world_points(prim: Usd.Prim, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return points of a prim's frame in the stage, and the determinant of the way there."""
    to_world = np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(FIRST_TIME_CODE))
    return points @ to_world[:3, :3] + to_world[3, :3], float(np.linalg.det(to_world[:3, :3]))


def _surfaces(path: Path, prim: Usd.Prim, looks: "_UsdFinishes") -> Iterator[Surface]:
    """Yield one surface for each material of a mesh."""
    mesh = UsdGeom.Mesh(prim)
    points = np.asarray(mesh.GetPointsAttr().Get(FIRST_TIME_CODE) or [], float).reshape(-1, 3)
    counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get(FIRST_TIME_CODE) or [], np.int64)
    corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(FIRST_TIME_CODE) or [], np.int64)
    if not len(points) or not len(counts):
        return
    bad = counts.min() < 0 or counts.sum() != len(corners)
    if bad or corners.min(initial=0) < 0 or corners.max(initial=0) >= len(points):
        raise BadFileError(path, f"{prim.GetPath()} has faces without corners.", MESH_EXPORT_ADVICE)
    world, turn = _world_points(prim, points)
    flipped = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    flipped ^= turn < 0
    uv, colours = _uv(mesh, corners), _colours(mesh)
    starts = np.cumsum(counts) - counts
    for faces, material in _material_subsets(mesh, len(counts)):
        fans = _fan_triangles(starts[faces], counts[faces])
        if not len(fans):
            continue
        fans = fans[:, ::-1] if flipped else fans
        by_corner = uv is not None  # texture seams: each corner is a vertex of its own
        which = corners[fans.ravel()] if by_corner else slice(None)
        triangles = np.arange(fans.size).reshape(-1, 3) if by_corner else corners[fans]
        yield Surface(
            name=prim.GetDisplayName() or prim.GetName(),
            object=0,
            finish=looks.number(material, mesh),
            vertices=world[which],
            triangles=np.ascontiguousarray(triangles, np.int64),
            uv=None if uv is None else uv[fans.ravel()] * (1, -1) + (0, 1),  # v runs up in USD
            colours=None if colours is None else colours[which],
            extras={NODE_NAMES_KEY: str(prim.GetPath()).strip("/").split("/")},
        )


def _fan_triangles(starts: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return polygons as fans of triangles: numbers of corners (T, 3)."""
    many = np.maximum(counts - 2, 0)
    first = np.repeat(starts, many)
    k = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many) + 1
    return np.stack([first, first + k, first + k + 1], axis=1)


def _material_subsets(mesh: UsdGeom.Mesh, faces: int) -> Iterator[tuple[np.ndarray, UsdShade.Material]]:
    """Yield the faces of each subset with a material, and the rest with the mesh's own."""
    own = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0]
    rest = np.ones(faces, bool)
    for subset in UsdGeom.Subset.GetGeomSubsets(mesh, UsdGeom.Tokens.face, "materialBind"):
        which = np.asarray(subset.GetIndicesAttr().Get(FIRST_TIME_CODE) or [], np.int64)
        which = which[(which >= 0) & (which < faces)]
        which = which[rest[which]]
        rest[which] = False
        bound = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()[0]
        yield which, bound or own
    yield np.flatnonzero(rest), own


def _uv(mesh: UsdGeom.Mesh, corners: np.ndarray) -> np.ndarray | None:
    """Return texture coordinates of every corner (C, 2)."""
    primvars = UsdGeom.PrimvarsAPI(mesh)
    for name in UV_PRIMVAR_NAMES:
        primvar = primvars.FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue():
            continue
        st = np.asarray(primvar.ComputeFlattened(FIRST_TIME_CODE), float)
        if st.ndim != 2 or st.shape[1] != 2 or not np.isfinite(st).all():
            continue
        if primvar.GetInterpolation() == UsdGeom.Tokens.faceVarying and len(st) == len(corners):
            return st
        per_vertex = primvar.GetInterpolation() in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying)
        if per_vertex and corners.max(initial=-1) < len(st):
            return st[corners]
    return None


def _colours(mesh: UsdGeom.Mesh) -> np.ndarray | None:
    """Return displayColor where every vertex has its own, linear RGB (V, 3)."""
    shown = mesh.GetDisplayColorPrimvar()
    per_vertex = shown.GetInterpolation() in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying)
    colours = np.asarray(shown.ComputeFlattened(FIRST_TIME_CODE) or [], float).reshape(-1, 3)
    points = mesh.GetPointsAttr().Get(FIRST_TIME_CODE)
    if not per_vertex or len(colours) != len(points) or len(colours) < 2:
        return None
    return np.clip(colours, 0, 1)


class _UsdFinishes:
    """The finishes of one stage, each read once and numbered in order of use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.finishes: list[Finish] = []
        self.lost: Counter[str] = Counter()
        self._numbers: dict[tuple, int] = {}

    def number(self, material: UsdShade.Material, mesh: UsdGeom.Gprim) -> int:
        """Return the number of the finish of a material, or of a mesh that has none."""
        painted = _constant_colour(mesh)
        key = (str(material.GetPath()) if material else "", painted)
        if key not in self._numbers:
            self.finishes.append(self._finish(material, painted))
            self._numbers[key] = len(self.finishes) - 1
        return self._numbers[key]

    def _finish(self, material: UsdShade.Material, painted: tuple[float, ...] | None) -> Finish:
        prim = material.GetPrim() if material else None
        name = (prim.GetDisplayName() or prim.GetName())[:120] if prim else DEFAULT_FINISH.name
        rgb = painted or DEFAULT_FINISH.colour[:3]
        plain = Finish(name, (rgb[0], rgb[1], rgb[2], 1.0), roughness=DEFAULT_FINISH.roughness)
        shader = material.ComputeSurfaceSource()[0] if material else None
        if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
            self.lost["materials that are no UsdPreviewSurface"] += bool(material)
            return plain
        picture = self._picture(shader.GetInput("diffuseColor"))
        rgb = (1.0, 1.0, 1.0) if picture is not None else _shader_input(shader, "diffuseColor", rgb)
        opacity = float(np.clip(_shader_input(shader, "opacity", 1.0), 0, 1))
        return Finish(
            name,
            colour=(*(float(np.clip(c, 0, 1)) for c in rgb), opacity),
            texture=picture,
            metallic=float(np.clip(_shader_input(shader, "metallic", 0.0), 0, 1)),
            roughness=float(np.clip(_shader_input(shader, "roughness", 0.5), 0, 1)),
            alpha_mode="BLEND" if opacity < 1 else "OPAQUE",
        )

    def _picture(self, entry: UsdShade.Input) -> np.ndarray | None:
        """Return the picture that is connected to an input, from the file's folder only."""
        if not entry or not entry.HasConnectedSource():
            return None
        source = UsdShade.Shader(entry.GetConnectedSources()[0][0].source.GetPrim())
        file = source.GetInput("file").Get() if source and source.GetInput("file") else None
        place = file.resolvedPath if isinstance(file, Sdf.AssetPath) else ""
        try:
            if not place or not _is_inside(place, self.folder):
                raise ValueError("is not there, or outside the folder")
            asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(place))
            if asset is None or asset.GetSize() > MAX_TEXTURE_BYTES:
                raise ValueError("cannot be read")
            return as_reduced_array(Image.open(io.BytesIO(bytes(asset.GetBuffer()))))
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
            self.lost["pictures that are not there or cannot be read"] += 1
            return None


def _shader_input(shader: UsdShade.Shader, name: str, otherwise):
    """Return a constant input, through what it is connected to; ``otherwise`` if it has none."""
    entry = shader.GetInput(name)
    value = None
    if entry:
        found = UsdShade.Utils.GetValueProducingAttributes(entry)
        value = found[0].Get(FIRST_TIME_CODE) if found else None
    number = isinstance(value, float | int) if isinstance(otherwise, float) else value is not None
    return value if number and np.isfinite(np.asarray(value, float)).all() else otherwise


def _constant_colour(mesh: UsdGeom.Gprim) -> tuple[float, ...] | None:
    """Return displayColor where a mesh has one for all, linear RGB."""
    shown = mesh.GetDisplayColorAttr().Get(FIRST_TIME_CODE)
    if not shown or len(shown) != 1 or not np.isfinite(shown[0]).all():
        return None
    return tuple(float(c) for c in np.clip(shown[0], 0, 1))
