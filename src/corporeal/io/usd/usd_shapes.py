"""Shapes that USD states by numbers (a cube, a sphere …) as triangles.

Facts: OpenUSD 26.11, UsdGeom: ``size``, ``radius``, ``height``, ``axis``; a capsule's height is
that of its cylinder alone, all stand about the origin, a cone's tip points along its axis.
"""

# usd-core comes without types.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import trimesh
from pxr import Usd, UsdGeom

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
    return np.asarray(made.vertices) @ ROTATION_FROM_Z_TO_AXIS[str(axis)].T, np.asarray(
        made.faces, np.int64
    )


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
        lambda radius, height: trimesh.creation.capsule(
            height, radius, count=[CIRCLE_SEGMENTS, CIRCLE_SEGMENTS]
        ),
    ),
    "Cone": (("radius", "height"), _cone),
}
"""Type of a prim → the attributes that say its size, and what makes it along +Z."""
