"""Small objects: duck, balls, book, cushion."""

from dataclasses import replace

import manifold3d as m3
import numpy as np

from corporeal.showcase import labels, paint, sdf, shape
from corporeal.showcase.mesh import Mesh, Model, Part, cut, make, pictured, plain, union
from corporeal.showcase.sdf import Sampling


def duck() -> Model:
    """Model a bath duck, 126 mm long, of soft vinyl 2 mm thick."""
    body = _duck_body()
    black = plain("eye black", "#0d0c0e", 0.12)
    orange = plain("beak orange", "#ee5a0c", 0.32)
    duck = Model(
        "rubber_duck",
        (
            Part("body", body, plain("duck yellow vinyl", "#fbb80f", 0.30), "soft_PVC", 0.002),
            Part("beak", cut(_beak(), body), orange, "soft_PVC"),
            Part("eye_left", cut(_eye(1), body), black, "soft_PVC"),
            Part("eye_right", cut(_eye(-1), body), black, "soft_PVC"),
        ),
    )
    return duck.moved((0, 0, -duck.bounds()[0, 2]))


def _duck_body() -> Mesh:
    trunk = sdf.join(
        sdf.ellipsoid((-0.004, 0, 0.031), (0.047, 0.036, 0.031)),
        sdf.ellipsoid((0.016, 0, 0.038), (0.031, 0.032, 0.031)),
        k=0.015,
    )
    tail = sdf.capsule((-0.026, 0, 0.040), (-0.056, 0, 0.068), 0.021, 0.0035)
    left, right = (
        sdf.ellipsoid((-0.010, s * 0.0335, 0.040), (0.025, 0.0075, 0.0165), (s * -14, -16, s * 8))
        for s in (1, -1)
    )
    head = sdf.ellipsoid((0.024, 0, 0.086), (0.0275, 0.0262, 0.0260))
    bird = sdf.join(sdf.join(trunk, tail, k=0.024), head, k=0.019)
    winged = sdf.join(bird, sdf.join(right, left, k=1e-6), k=0.005)
    return sdf.mesh(
        sdf.both(winged, sdf.above(0.0015), k=0.004),
        Sampling((-0.066, -0.045, 0), (0.056, 0.045, 0.115), 0.0011, 14000),
    )


def _beak() -> Mesh:
    upper = sdf.join(
        sdf.ellipsoid((0.0525, 0, 0.0845), (0.0150, 0.0135, 0.0042), (0, -14, 0)),
        sdf.ellipsoid((0.049, 0, 0.0870), (0.0085, 0.0075, 0.0045)),
        k=0.005,
    )
    lower = sdf.ellipsoid((0.0495, 0, 0.0785), (0.0125, 0.0108, 0.0034), (0, 10, 0))
    return sdf.mesh(
        sdf.join(upper, lower, k=0.0018),
        Sampling((0.032, -0.017, 0.07), (0.07, 0.017, 0.097), 0.0006, 3000),
    )


def _eye(side: int) -> Mesh:
    y = side * 0.0155
    return sdf.mesh(
        sdf.ellipsoid((0.0425, y, 0.0955), (0.0028, 0.0046, 0.0056), (0, -22, side * 38)),
        Sampling((0.034, y - 0.009, 0.087), (0.051, y + 0.009, 0.104), 0.0007, 900),
    )


def ball() -> Model:
    """Model a play ball, 0.22 m across, of EVA foam.

    Not an inflated one: it is the air in it that makes that stiff, and a wall of 3 mm of rubber
    alone would sag under its own weight.
    """
    look = pictured("ball foam skin", labels.ball_stripes(), 0.38)
    return Model("ball", (Part("ball", _ball(0.11), look, "EVA_foam"),))


def rubber_ball() -> Model:
    """Model a solid bouncy ball, 0.10 m across."""
    look = pictured("swirled rubber", paint.swirl(512, 12, "#c2185b", "#ff5a36", "#ffb347"), 0.3)
    return Model("rubber_ball", (Part("ball", _ball(0.05), look, "rubber"),))


def steel_ball() -> Model:
    """Model a bearing ball, 0.10 m across."""
    look = plain("polished steel", "#d3d6da", 0.14, metallic=1.0)
    return Model("steel_ball", (Part("ball", _ball(0.05), look, "steel"),))


def _ball(radius: float, segments: int = 96) -> Mesh:
    t = np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1)
    profile = radius * np.stack([np.cos(t), np.sin(t)], 1)
    profile[[0, -1], 0] = 0
    return shape.lathe(profile, segments).moved(turn=(24, -18, 0)).moved((0, 0, radius))


def book() -> Model:
    """Model a cloth-bound book, 21 × 15 × 3 cm, lying flat."""
    wide, tall, thick, board = 0.15, 0.21, 0.032, 0.003
    boards = [
        shape.Box((wide, tall, board), 0.0012, corner=4).mesh().moved((0, 0, z))
        for z in (board / 2, thick - board / 2)
    ]
    a = np.radians(np.linspace(90, 270, 13))
    outer, inner = (
        np.stack([-wide / 2 + bulge * np.cos(a), thick / 2 + half * np.sin(a)], 1)
        for bulge, half in ((0.008, thick / 2), (0.005, thick / 2 - board))
    )
    cover = union([*boards, _extrude(np.concatenate([outer, inner[::-1]]), tall)])
    v, n = cover.vertices, cover.normals
    # Only the two boards carry the picture; edges and spine take the plain cloth of its corner.
    on_board = np.abs(n[:, 2:]) > 0.9
    uv = np.where(on_board, np.stack([0.5 + v[:, 1] / tall, 0.5 - v[:, 0] / wide], 1), 0.02)
    cover = replace(cover, uv=np.stack([1 - uv[:, 0], uv[:, 1]], 1))
    size = (wide - 0.008, tall - 0.008, thick - 2 * board)
    block = shape.Box(size, 0.0008, tile=0.05, grain=1).mesh().moved((-0.002, 0, thick / 2))
    return Model(
        "book",
        (
            Part("cover", cover, pictured("book cloth", labels.book_cover(), 0.65), "cardboard"),
            Part("pages", cut(block, cover), pictured("paper edges", paint.pages(), 0.9), "paper"),
        ),
    )


def _extrude(outline: np.ndarray, depth: float) -> Mesh:
    """Draw a polygon in the xz plane out along y."""
    solid = m3.CrossSection([outline], m3.FillRule.NonZero).extrude(depth).to_mesh()
    v = np.asarray(solid.vert_properties, float)[:, :3]
    return make(np.stack([v[:, 0], depth / 2 - v[:, 2], v[:, 1]], 1), solid.tri_verts)


def cushion() -> Model:
    """Model a throw pillow, 0.45 m."""
    pillow = shape.Cushion((0.45, 0.45, 0.03), 0.062, 0.0145, 0.005, 20, pinch=0.07, seams=(0,))
    look = pictured("mustard weave", paint.weave(512, 21, "#7d5512", "#d79a2b", "#f2c766"), 0.95)
    return Model(
        "cushion", (Part("cushion", pillow.mesh().moved((0, 0, 0.077)), look, "fibre_fill"),)
    )
