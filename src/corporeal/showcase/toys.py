"""Small objects: duck, balls, book, cushion."""

from dataclasses import replace

import manifold3d as m3
import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures, sdf
from corporeal.showcase.prop_mesh import (
    PropMesh,
    PropModel,
    PropPart,
    make_mesh,
    mesh_difference,
    mesh_union,
    plain_finish,
    textured_finish,
)
from corporeal.showcase.sdf import SdfSampling


def rubber_duck() -> PropModel:
    """Model a bath duck, 126 mm long, of soft vinyl 2 mm thick."""
    body = _duck_body()
    black = plain_finish("eye black", "#0d0c0e", 0.12)
    orange = plain_finish("beak orange", "#ee5a0c", 0.32)
    duck = PropModel(
        "rubber_duck",
        (
            PropPart("body", body, plain_finish("duck yellow vinyl", "#fbb80f", 0.30), "soft_PVC", 0.002),
            PropPart("beak", mesh_difference(_beak(), body), orange, "soft_PVC"),
            PropPart("eye_left", mesh_difference(_eye(1), body), black, "soft_PVC"),
            PropPart("eye_right", mesh_difference(_eye(-1), body), black, "soft_PVC"),
        ),
    )
    return duck.moved((0, 0, -duck.bounds()[0, 2]))


def _duck_body() -> PropMesh:
    trunk = sdf.sdf_smooth_union(
        sdf.sdf_ellipsoid((-0.004, 0, 0.031), (0.047, 0.036, 0.031)),
        sdf.sdf_ellipsoid((0.016, 0, 0.038), (0.031, 0.032, 0.031)),
        k=0.015,
    )
    tail = sdf.sdf_capsule((-0.026, 0, 0.040), (-0.056, 0, 0.068), 0.021, 0.0035)
    left, right = (
        sdf.sdf_ellipsoid((-0.010, s * 0.0335, 0.040), (0.025, 0.0075, 0.0165), (s * -14, -16, s * 8)) for s in (1, -1)
    )
    head = sdf.sdf_ellipsoid((0.024, 0, 0.086), (0.0275, 0.0262, 0.0260))
    bird = sdf.sdf_smooth_union(sdf.sdf_smooth_union(trunk, tail, k=0.024), head, k=0.019)
    winged = sdf.sdf_smooth_union(bird, sdf.sdf_smooth_union(right, left, k=1e-6), k=0.005)
    return sdf.mesh_sdf(
        sdf.sdf_smooth_intersection(winged, sdf.sdf_half_space_above(0.0015), k=0.004),
        SdfSampling((-0.066, -0.045, 0), (0.056, 0.045, 0.115), 0.0011, 14000),
    )


def _beak() -> PropMesh:
    upper = sdf.sdf_smooth_union(
        sdf.sdf_ellipsoid((0.0525, 0, 0.0845), (0.0150, 0.0135, 0.0042), (0, -14, 0)),
        sdf.sdf_ellipsoid((0.049, 0, 0.0870), (0.0085, 0.0075, 0.0045)),
        k=0.005,
    )
    lower = sdf.sdf_ellipsoid((0.0495, 0, 0.0785), (0.0125, 0.0108, 0.0034), (0, 10, 0))
    return sdf.mesh_sdf(
        sdf.sdf_smooth_union(upper, lower, k=0.0018),
        SdfSampling((0.032, -0.017, 0.07), (0.07, 0.017, 0.097), 0.0006, 3000),
    )


def _eye(side: int) -> PropMesh:
    y = side * 0.0155
    return sdf.mesh_sdf(
        sdf.sdf_ellipsoid((0.0425, y, 0.0955), (0.0028, 0.0046, 0.0056), (0, -22, side * 38)),
        SdfSampling((0.034, y - 0.009, 0.087), (0.051, y + 0.009, 0.104), 0.0007, 900),
    )


def play_ball() -> PropModel:
    """Model a play ball, 0.22 m across, of EVA foam.

    Not an inflated one: it is the air in it that makes that stiff, and a wall of 3 mm of rubber alone would sag under
    its own weight.
    """
    look = textured_finish("ball foam skin", procedural_textures.ball_stripes(), 0.38)
    return PropModel("ball", (PropPart("ball", _ball_of_radius(0.11), look, "EVA_foam"),))


def rubber_ball() -> PropModel:
    """Model a solid bouncy ball, 0.10 m across."""
    look = textured_finish(
        "swirled rubber", procedural_textures.swirl_texture(512, 12, "#c2185b", "#ff5a36", "#ffb347"), 0.3
    )
    return PropModel("rubber_ball", (PropPart("ball", _ball_of_radius(0.05), look, "rubber"),))


def steel_ball() -> PropModel:
    """Model a bearing ball, 0.10 m across."""
    look = plain_finish("polished steel", "#d3d6da", 0.14, metallic=1.0)
    return PropModel("steel_ball", (PropPart("ball", _ball_of_radius(0.05), look, "steel"),))


def _ball_of_radius(radius: float, segments: int = 96) -> PropMesh:
    t = np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1)
    profile = radius * np.stack([np.cos(t), np.sin(t)], 1)
    profile[[0, -1], 0] = 0
    return parametric_surfaces.lathe_surface(profile, segments).moved(turn=(24, -18, 0)).moved((0, 0, radius))


def cloth_bound_book() -> PropModel:
    """Model a cloth-bound book, 21 × 15 × 3 cm, lying flat."""
    wide, tall, thick, board = 0.15, 0.21, 0.032, 0.003
    boards = [
        parametric_surfaces.RoundedBox((wide, tall, board), 0.0012, corner=4).mesh().moved((0, 0, z))
        for z in (board / 2, thick - board / 2)
    ]
    a = np.radians(np.linspace(90, 270, 13))
    outer, inner = (
        np.stack([-wide / 2 + bulge * np.cos(a), thick / 2 + half * np.sin(a)], 1)
        for bulge, half in ((0.008, thick / 2), (0.005, thick / 2 - board))
    )
    cover = mesh_union([*boards, _extrude_outline(np.concatenate([outer, inner[::-1]]), tall)])
    v, n = cover.vertices, cover.normals
    # Only the two boards carry the picture; edges and spine take the plain cloth of its corner.
    on_board = np.abs(n[:, 2:]) > 0.9
    uv = np.where(on_board, np.stack([0.5 + v[:, 1] / tall, 0.5 - v[:, 0] / wide], 1), 0.02)
    cover = replace(cover, uv=np.stack([1 - uv[:, 0], uv[:, 1]], 1))
    size = (wide - 0.008, tall - 0.008, thick - 2 * board)
    block = parametric_surfaces.RoundedBox(size, 0.0008, tile=0.05, grain=1).mesh().moved((-0.002, 0, thick / 2))
    return PropModel(
        "book",
        (
            PropPart(
                "cover", cover, textured_finish("book cloth", procedural_textures.book_cover(), 0.65), "cardboard"
            ),
            PropPart(
                "pages",
                mesh_difference(block, cover),
                textured_finish("paper edges", procedural_textures.pages_texture(), 0.9),
                "paper",
            ),
        ),
    )


def _extrude_outline(outline: np.ndarray, depth: float) -> PropMesh:
    """Draw a polygon in the xz plane out along y."""
    solid = m3.CrossSection([outline], m3.FillRule.NonZero).extrude(depth).to_mesh()
    v = np.asarray(solid.vert_properties, float)[:, :3]
    return make_mesh(np.stack([v[:, 0], depth / 2 - v[:, 2], v[:, 1]], 1), solid.tri_verts)


def throw_pillow() -> PropModel:
    """Model a throw pillow, 0.45 m."""
    pillow = parametric_surfaces.CushionShape((0.45, 0.45, 0.03), 0.062, 0.0145, 0.005, 20, pinch=0.07, seams=(0,))
    look = textured_finish(
        "mustard weave", procedural_textures.weave_texture(512, 21, "#7d5512", "#d79a2b", "#f2c766"), 0.95
    )
    return PropModel("cushion", (PropPart("cushion", pillow.mesh().moved((0, 0, 0.077)), look, "fibre_fill"),))
