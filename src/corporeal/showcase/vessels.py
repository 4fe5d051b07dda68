"""Turned objects: can, vase, mug, floor lamp."""

from dataclasses import replace

import numpy as np

from corporeal.core.types import Finish
from corporeal.showcase import parametric_surfaces, procedural_textures, sdf
from corporeal.showcase.prop_mesh import (
    PropMesh,
    PropModel,
    PropPart,
    mesh_difference,
    mesh_union,
    plain_finish,
    textured_finish,
)


def tumbler() -> PropModel:
    """Model a glass, 10 cm tall and 7 cm across, wall 3 mm: three fifths full of water."""
    outside = [(0.0, 0.0), (0.030, 0.0), (0.034, 0.004), (0.035, 0.098), (0.0345, 0.1)]
    inside = [(0.0325, 0.1), (0.032, 0.098), (0.031, 0.012), (0.027, 0.008), (0.0, 0.008)]
    profile = np.concatenate(
        [parametric_surfaces.soften_corners(outside, 4), parametric_surfaces.soften_corners(inside, 4)]
    )
    pale = plain_finish("clear glass", "#dcecf0", 0.05)
    look = replace(pale, colour=(*pale.colour[:3], 0.1), alpha_mode="BLEND")
    wall = PropPart("glass", parametric_surfaces.lathe_surface(profile, 72), look, "glass", contents="water", fill=0.6)
    return PropModel("tumbler", (wall,))


def honey() -> PropModel:
    """Model what leaves a jar at once: a column of honey, 4 cm across and 9 cm tall."""
    look = plain_finish("honey", "#d98a12", 0.1)
    return PropModel("honey", (PropPart("honey", _upright_cylinder(0.020, 0.09), look, "honey"),))


def ketchup() -> PropModel:
    """Model ketchup as a cup leaves it that is lifted off: 6 cm across and 6 cm tall."""
    look = plain_finish("ketchup", "#b3170f", 0.15)
    return PropModel("ketchup", (PropPart("ketchup", _upright_cylinder(0.030, 0.06), look, "ketchup"),))


def wooden_ball() -> PropModel:
    """Model a ball of beech, 5 cm across."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 37)
    profile = 0.025 * np.stack([np.cos(t), np.sin(t)], 1)
    profile[[0, -1], 0] = 0
    mesh = parametric_surfaces.lathe_surface(profile, 72).moved((0, 0, 0.025))
    return PropModel("wooden_ball", (PropPart("ball", mesh, plain_finish("beech", "#c99a63", 0.5), "hardwood"),))


def _upright_cylinder(radius: float, height: float) -> PropMesh:
    """Turn an upright cylinder with rounded edges."""
    edge = 0.1 * radius
    profile = [(0.0, 0.0), (radius - edge, 0.0), (radius, edge), (radius, height - edge)]
    profile += [(radius - edge, height), (0.0, height)]
    return parametric_surfaces.lathe_surface(parametric_surfaces.soften_corners(profile, 4), 64)


def soda_can() -> PropModel:
    """Model a 330 ml can, 66 × 115 mm, by its outside; wall 0.1 mm and lid 0.25 mm in reality."""
    body, lid = _can_body(), _can_lid()
    # Ink on aluminium is half mirror, half paint: one partly metallic finish does for both.
    printed = textured_finish("printed aluminium", procedural_textures.can_label(), 0.30, metallic=0.45)
    bare = plain_finish("bare aluminium", "#c9ccd0", 0.30, metallic=1.0)
    bright = plain_finish("tab aluminium", "#dcdee2", 0.22, metallic=1.0)
    sheet = "aluminium_can_sheet"
    return PropModel(
        "soda_can",
        (
            PropPart("body", body, printed, sheet, 0.0001),
            PropPart("lid", mesh_difference(lid, body), bare, sheet, 0.00025),
            PropPart("tab", mesh_difference(_can_tab(), lid, body), bright, sheet),
        ),
    )


def _can_body() -> PropMesh:
    foot = [(0.0, 0.010), (0.013, 0.0085), (0.0215, 0.003), (0.0235, 0.0), (0.0235, 0.0)]
    foot += [(0.0255, 0.001), (0.0305, 0.007), (0.0330, 0.0115)]
    wall = [(0.0331, z) for z in np.linspace(0.013, 0.0975, 24)]
    neck = [(0.0331, 0.0985), (0.0328, 0.102), (0.0295, 0.1075), (0.0272, 0.1105), (0.0268, 0.1112)]
    under_lid = [(0.0266, 0.1108), (0.0262, 0.103), (0.0, 0.103)]
    profile = np.concatenate(
        [parametric_surfaces.soften_corners(foot), wall, parametric_surfaces.soften_corners(neck), under_lid]
    )
    body = parametric_surfaces.lathe_surface(profile, 72)
    return replace(body, uv=np.stack([body.uv[:, 0], body.vertices[:, 2] / 0.115], 1))


def _can_lid() -> PropMesh:
    seam = [(0.0, 0.1068), (0.0205, 0.1068), (0.0218, 0.1046), (0.0228, 0.1046), (0.0240, 0.1120)]
    seam += [(0.0250, 0.1150), (0.0262, 0.1152), (0.0270, 0.1140), (0.0270, 0.1118)]
    seam += [(0.0266, 0.1110)]
    under = [(0, 0.103), (0.0262, 0.103), (0.0266, 0.1108)]
    return parametric_surfaces.lathe_surface(
        np.concatenate([under, parametric_surfaces.soften_corners(seam)[::-1]]), 72
    )


def _can_tab() -> PropMesh:
    z = 0.1072
    pull = _ellipse_points(32, (-0.0005, 0, z + 0.0012), 0.0105, 0.0072)
    score = _ellipse_points(40, (0.0118, 0, z - 0.0003), 0.0082, 0.0088)
    bridge = parametric_surfaces.RoundedBox((0.0068, 0.0138, 0.0016), 0.0007).mesh().moved((0.0040, 0, z + 0.0012))
    rivet = [(0, z - 0.002), (0.0030, z - 0.002), (0.0030, z + 0.0018), (0.0022, z + 0.0026)]
    rivet += [(0, z + 0.0026)]
    pin = parametric_surfaces.lathe_surface(parametric_surfaces.soften_corners(rivet, 2), 24).moved((0.0035, 0, 0))
    return mesh_union(
        [parametric_surfaces.ring_surface(pull, 0.0011), bridge, pin, parametric_surfaces.ring_surface(score, 0.0005)]
    )


def vase() -> PropModel:
    """Model a glazed vase, 28 cm tall, wall 5 mm; it stands on a foot ring."""
    outside = [(0.0, 0.004), (0.044, 0.004), (0.046, 0.0), (0.052, 0.0), (0.056, 0.008)]
    outside += [(0.085, 0.07), (0.098, 0.135), (0.080, 0.195), (0.038, 0.225), (0.034, 0.25)]
    outside += [(0.046, 0.274), (0.050, 0.280)]
    inside = [(0.050, 0.280), (0.046, 0.2815), (0.041, 0.276), (0.029, 0.25), (0.033, 0.222)]
    inside += [(0.075, 0.192), (0.093, 0.135), (0.080, 0.07), (0.050, 0.012), (0.0, 0.010)]
    profile = np.concatenate(
        [parametric_surfaces.soften_corners(outside, 4), parametric_surfaces.soften_corners(inside, 4)[1:]]
    )
    look = textured_finish("blue-white glaze", procedural_textures.vase_glaze(), 0.16)
    return PropModel("vase", (PropPart("vase", parametric_surfaces.lathe_surface(profile, 72), look, "ceramic"),))


def mug() -> PropModel:
    """Model a stoneware mug, 94 mm tall: glazed rim and inside, coloured outside."""
    outer = sdf.sdf_smooth_intersection(sdf.sdf_cylinder(0.041, 0.0, 0.2, 0.008), lambda p: p[:, 2] - 0.095, k=0.004)
    ring = sdf.sdf_torus((0.043, 0, 0.049), 0.0225, 0.0062, 1.22)
    handle = sdf.sdf_smooth_intersection(ring, lambda p: 0.038 - p[:, 0])
    inside = sdf.sdf_cylinder(0.0365, 0.006, 0.2, 0.008)
    m = sdf.mesh_sdf(
        sdf.sdf_smooth_difference(sdf.sdf_smooth_union(outer, handle, k=0.008), inside, k=0.004),
        sdf.SdfSampling((-0.042, -0.042, 0), (0.075, 0.042, 0.095), 0.0012, 22000),
    )
    x, y, z = m.vertices.T
    inward = x * m.normals[:, 0] + y * m.normals[:, 1] <= 0.002
    inner = (np.hypot(x, y) < 0.0388) & inward & (z > 0.004)
    uv = np.stack([x / 0.1 + 0.5, np.where(inner, 1 - z / 0.19, z / 0.19)], 1)
    look = textured_finish("stoneware glaze", procedural_textures.mug_glaze_texture(), 0.2)
    return PropModel("mug", (PropPart("mug", replace(m, uv=uv), look, "ceramic"),))


def floor_lamp() -> PropModel:
    """Model a reading lamp, 1.55 m: brass-plated steel tube, opal glass shade on a spider, bulb."""
    foot = [(0, 0), (0.138, 0), (0.14, 0), (0.14, 0.010), (0.135, 0.014), (0.05, 0.018)]
    foot += [(0.020, 0.028), (0.014, 0.05), (0.0, 0.05)]
    base = parametric_surfaces.lathe_surface(parametric_surfaces.soften_corners(foot), 72)
    stem, spider = _lamp_stem(), mesh_union(_lamp_spider())
    metal = mesh_union([stem, spider])
    pear = [(0, 1.266), (0.012, 1.266), (0.014, 1.275), (0.017, 1.290), (0.031, 1.325)]
    pear += [(0.030, 1.350), (0.017, 1.368), (0.0, 1.370)]
    bulb = parametric_surfaces.lathe_surface(parametric_surfaces.soften_corners(pear), 40)
    brass = plain_finish("brushed brass", "#c9a45a", 0.30, metallic=1.0)
    return PropModel(
        "floor_lamp",
        (
            PropPart("base", base, brass, "steel"),
            PropPart("stem", mesh_difference(stem, base), brass, "steel", 0.0012),
            PropPart("spider", mesh_difference(spider, stem), brass, "steel"),
            PropPart(
                "bulb",
                mesh_difference(bulb, metal),
                plain_finish("lit glass", "#fff0cf", 0.3, emission=3.0),
                "glass",
                1e-3,
            ),
            PropPart("shade", mesh_difference(_lamp_shade(), metal), _opal_finish(), "glass"),
        ),
    )


LAMP_SHADE_BOTTOM_M, LAMP_SHADE_TOP_M, LAMP_SHADE_BOTTOM_RADIUS_M, LAMP_SHADE_TOP_RADIUS_M = (1.20, 1.55, 0.215, 0.155)
"""The shade: heights of its rims and their radii [m]."""
LAMP_SHADE_WALL_M = 0.004
"""How thick its glass is [m]."""
LAMP_WIRE_RADIUS_M = LAMP_SHADE_BOTTOM_RADIUS_M - LAMP_SHADE_WALL_M - 0.0018
"""Radius of the lowest wires, which press against it [m]."""


def _shade_radius(share: float | np.ndarray) -> float | np.ndarray:
    return LAMP_SHADE_BOTTOM_RADIUS_M + (LAMP_SHADE_TOP_RADIUS_M - LAMP_SHADE_BOTTOM_RADIUS_M) * share


def _lamp_shade() -> PropMesh:
    s = np.linspace(0, 1, 13)
    outside = np.stack([_shade_radius(s), LAMP_SHADE_BOTTOM_M + (LAMP_SHADE_TOP_M - LAMP_SHADE_BOTTOM_M) * s], 1)
    return parametric_surfaces.lathe_surface(
        np.concatenate([outside, outside[::-1] - [LAMP_SHADE_WALL_M, 0]]), 96, loop=True
    )


def _opal_finish() -> Finish:
    return replace(plain_finish("opal glass", "#f6efe0", 0.25, emission=0.28), translucency=0.5)


def _lamp_stem() -> PropMesh:
    rod = [(0.010, 0.045), (0.010, 0.05), (0.010, 1.20), (0.010, 1.20), (0.017, 1.21)]
    rod += [(0.019, 1.225), (0.019, 1.262), (0.0165, 1.268), (0, 1.268)]
    return parametric_surfaces.lathe_surface(
        np.concatenate([[(0, 0.045)], parametric_surfaces.soften_corners(rod)]), 40
    )


def _lamp_spider() -> list[PropMesh]:
    """Hoops inside the rims, three spokes to the stem, three struts up the shade."""
    rise = LAMP_SHADE_TOP_M - LAMP_SHADE_BOTTOM_M
    hoops = []
    for z in (LAMP_SHADE_BOTTOM_M + 0.047, LAMP_SHADE_TOP_M - 0.012, LAMP_SHADE_BOTTOM_M + 0.012):
        r = float(_shade_radius((z - LAMP_SHADE_BOTTOM_M) / rise)) - (LAMP_SHADE_BOTTOM_RADIUS_M - LAMP_WIRE_RADIUS_M)
        hoops.append(parametric_surfaces.ring_surface(_ellipse_points(72, (0, 0, z), r, r), 0.0028))
    bars = []
    s = np.linspace(0.03, 0.97, 6)
    strut = np.stack([LAMP_WIRE_RADIUS_M - 0.0602 * s, LAMP_SHADE_BOTTOM_M + s * rise], 1)
    spoke = np.array([(0.010, 1.235), (0.07, 1.237), (0.150, 1.243), (LAMP_WIRE_RADIUS_M - 0.0075, 1.2466)])
    for angle in 2 * np.pi * np.arange(3) / 3 + 0.4:
        for (r, z), radius in ((spoke.T, 0.003), (strut.T, 0.0024)):
            path = np.stack([r * np.cos(angle), r * np.sin(angle), z], 1)
            bars.append(parametric_surfaces.tube_surface(path, radius, 8))
    return hoops + bars


def _ellipse_points(n: int, centre: tuple[float, float, float], a: float, b: float) -> np.ndarray:
    """Points round a level ellipse [m]."""
    t = 2 * np.pi * np.arange(n) / n
    return np.asarray(centre) + np.stack([a * np.cos(t), b * np.sin(t), 0 * t], 1)
