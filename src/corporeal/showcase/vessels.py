"""Turned objects: can, vase, mug, floor lamp."""

from dataclasses import replace

import numpy as np

from corporeal.core.types import Finish
from corporeal.showcase import labels, paint, sdf, shape
from corporeal.showcase.mesh import Mesh, Model, Part, cut, pictured, plain, union


def soda_can() -> Model:
    """Model a 330 ml can, 66 × 115 mm, by its outside; wall 0.1 mm and lid 0.25 mm in life."""
    body, lid = _can_body(), _can_lid()
    # Ink on aluminium is half mirror, half paint: one partly metallic finish does for both.
    printed = pictured("printed aluminium", labels.can_label(), 0.30, metallic=0.45)
    bare = plain("bare aluminium", "#c9ccd0", 0.30, metallic=1.0)
    bright = plain("tab aluminium", "#dcdee2", 0.22, metallic=1.0)
    sheet = "aluminium_can_sheet"
    return Model(
        "soda_can",
        (
            Part("body", body, printed, sheet, 0.0001),
            Part("lid", cut(lid, body), bare, sheet, 0.00025),
            Part("tab", cut(_can_tab(), lid, body), bright, sheet),
        ),
    )


def _can_body() -> Mesh:
    foot = [(0.0, 0.010), (0.013, 0.0085), (0.0215, 0.003), (0.0235, 0.0), (0.0235, 0.0)]
    foot += [(0.0255, 0.001), (0.0305, 0.007), (0.0330, 0.0115)]
    wall = [(0.0331, z) for z in np.linspace(0.013, 0.0975, 24)]
    neck = [(0.0331, 0.0985), (0.0328, 0.102), (0.0295, 0.1075), (0.0272, 0.1105), (0.0268, 0.1112)]
    under_lid = [(0.0266, 0.1108), (0.0262, 0.103), (0.0, 0.103)]
    profile = np.concatenate([shape.soften(foot), wall, shape.soften(neck), under_lid])
    body = shape.lathe(profile, 72)
    return replace(body, uv=np.stack([body.uv[:, 0], body.vertices[:, 2] / 0.115], 1))


def _can_lid() -> Mesh:
    seam = [(0.0, 0.1068), (0.0205, 0.1068), (0.0218, 0.1046), (0.0228, 0.1046), (0.0240, 0.1120)]
    seam += [(0.0250, 0.1150), (0.0262, 0.1152), (0.0270, 0.1140), (0.0270, 0.1118)]
    seam += [(0.0266, 0.1110)]
    under = [(0, 0.103), (0.0262, 0.103), (0.0266, 0.1108)]
    return shape.lathe(np.concatenate([under, shape.soften(seam)[::-1]]), 72)


def _can_tab() -> Mesh:
    z = 0.1072
    pull = _ellipse(32, (-0.0005, 0, z + 0.0012), 0.0105, 0.0072)
    score = _ellipse(40, (0.0118, 0, z - 0.0003), 0.0082, 0.0088)
    bridge = shape.Box((0.0068, 0.0138, 0.0016), 0.0007).mesh().moved((0.0040, 0, z + 0.0012))
    rivet = [(0, z - 0.002), (0.0030, z - 0.002), (0.0030, z + 0.0018), (0.0022, z + 0.0026)]
    rivet += [(0, z + 0.0026)]
    pin = shape.lathe(shape.soften(rivet, 2), 24).moved((0.0035, 0, 0))
    return union([shape.ring(pull, 0.0011), bridge, pin, shape.ring(score, 0.0005)])


def vase() -> Model:
    """Model a glazed vase, 28 cm tall, wall 5 mm; it stands on a foot ring."""
    outside = [(0.0, 0.004), (0.044, 0.004), (0.046, 0.0), (0.052, 0.0), (0.056, 0.008)]
    outside += [(0.085, 0.07), (0.098, 0.135), (0.080, 0.195), (0.038, 0.225), (0.034, 0.25)]
    outside += [(0.046, 0.274), (0.050, 0.280)]
    inside = [(0.050, 0.280), (0.046, 0.2815), (0.041, 0.276), (0.029, 0.25), (0.033, 0.222)]
    inside += [(0.075, 0.192), (0.093, 0.135), (0.080, 0.07), (0.050, 0.012), (0.0, 0.010)]
    profile = np.concatenate([shape.soften(outside, 4), shape.soften(inside, 4)[1:]])
    look = pictured("blue-white glaze", labels.vase_glaze(), 0.16)
    return Model("vase", (Part("vase", shape.lathe(profile, 72), look, "ceramic"),))


def mug() -> Model:
    """Model a stoneware mug, 94 mm tall: glazed rim and inside, coloured outside."""
    outer = sdf.both(sdf.cylinder(0.041, 0.0, 0.2, 0.008), lambda p: p[:, 2] - 0.095, k=0.004)
    ring = sdf.torus((0.043, 0, 0.049), 0.0225, 0.0062, 1.22)
    handle = sdf.both(ring, lambda p: 0.038 - p[:, 0])
    inside = sdf.cylinder(0.0365, 0.006, 0.2, 0.008)
    m = sdf.mesh(
        sdf.minus(sdf.join(outer, handle, k=0.008), inside, k=0.004),
        sdf.Sampling((-0.042, -0.042, 0), (0.075, 0.042, 0.095), 0.0012, 22000),
    )
    x, y, z = m.vertices.T
    inward = x * m.normals[:, 0] + y * m.normals[:, 1] <= 0.002
    inner = (np.hypot(x, y) < 0.0388) & inward & (z > 0.004)
    uv = np.stack([x / 0.1 + 0.5, np.where(inner, 1 - z / 0.19, z / 0.19)], 1)
    look = pictured("stoneware glaze", paint.mug_glaze(), 0.2)
    return Model("mug", (Part("mug", replace(m, uv=uv), look, "ceramic"),))


def floor_lamp() -> Model:
    """Model a reading lamp, 1.55 m: brass-plated steel tube, opal glass shade on a spider, bulb."""
    foot = [(0, 0), (0.138, 0), (0.14, 0), (0.14, 0.010), (0.135, 0.014), (0.05, 0.018)]
    foot += [(0.020, 0.028), (0.014, 0.05), (0.0, 0.05)]
    base = shape.lathe(shape.soften(foot), 72)
    stem, spider = _lamp_stem(), union(_lamp_spider())
    metal = union([stem, spider])
    pear = [(0, 1.266), (0.012, 1.266), (0.014, 1.275), (0.017, 1.290), (0.031, 1.325)]
    pear += [(0.030, 1.350), (0.017, 1.368), (0.0, 1.370)]
    bulb = shape.lathe(shape.soften(pear), 40)
    brass = plain("brushed brass", "#c9a45a", 0.30, metallic=1.0)
    return Model(
        "floor_lamp",
        (
            Part("base", base, brass, "steel"),
            Part("stem", cut(stem, base), brass, "steel", 0.0012),
            Part("spider", cut(spider, stem), brass, "steel"),
            Part(
                "bulb",
                cut(bulb, metal),
                plain("lit glass", "#fff0cf", 0.3, glow=3.0),
                "glass",
                1e-3,
            ),
            Part("shade", cut(_lamp_shade(), metal), _opal(), "glass"),
        ),
    )


LAMP_LOW, LAMP_HIGH, LAMP_WIDE, LAMP_NARROW = 1.20, 1.55, 0.215, 0.155
"""The shade: heights of its rims and their radii [m]."""
SHADE_WALL = 0.004
"""How thick its glass is [m]."""
WIRE = LAMP_WIDE - SHADE_WALL - 0.0018
"""Radius of the lowest wires, which press against it [m]."""


def _shade_radius(share: float | np.ndarray) -> float | np.ndarray:
    return LAMP_WIDE + (LAMP_NARROW - LAMP_WIDE) * share


def _lamp_shade() -> Mesh:
    s = np.linspace(0, 1, 13)
    outside = np.stack([_shade_radius(s), LAMP_LOW + (LAMP_HIGH - LAMP_LOW) * s], 1)
    return shape.lathe(np.concatenate([outside, outside[::-1] - [SHADE_WALL, 0]]), 96, loop=True)


def _opal() -> Finish:
    return replace(plain("opal glass", "#f6efe0", 0.25, glow=0.28), translucency=0.5)


def _lamp_stem() -> Mesh:
    rod = [(0.010, 0.045), (0.010, 0.05), (0.010, 1.20), (0.010, 1.20), (0.017, 1.21)]
    rod += [(0.019, 1.225), (0.019, 1.262), (0.0165, 1.268), (0, 1.268)]
    return shape.lathe(np.concatenate([[(0, 0.045)], shape.soften(rod)]), 40)


def _lamp_spider() -> list[Mesh]:
    """Hoops inside the rims, three spokes to the stem, three struts up the shade."""
    rise = LAMP_HIGH - LAMP_LOW
    hoops = []
    for z in (LAMP_LOW + 0.047, LAMP_HIGH - 0.012, LAMP_LOW + 0.012):
        r = float(_shade_radius((z - LAMP_LOW) / rise)) - (LAMP_WIDE - WIRE)
        hoops.append(shape.ring(_ellipse(72, (0, 0, z), r, r), 0.0028))
    bars = []
    s = np.linspace(0.03, 0.97, 6)
    strut = np.stack([WIRE - 0.0602 * s, LAMP_LOW + s * rise], 1)
    spoke = np.array([(0.010, 1.235), (0.07, 1.237), (0.150, 1.243), (WIRE - 0.0075, 1.2466)])
    for angle in 2 * np.pi * np.arange(3) / 3 + 0.4:
        for (r, z), radius in ((spoke.T, 0.003), (strut.T, 0.0024)):
            path = np.stack([r * np.cos(angle), r * np.sin(angle), z], 1)
            bars.append(shape.tube(path, radius, 8))
    return hoops + bars


def _ellipse(n: int, centre: tuple[float, float, float], a: float, b: float) -> np.ndarray:
    """Points round a level ellipse [m]."""
    t = 2 * np.pi * np.arange(n) / n
    return np.asarray(centre) + np.stack([a * np.cos(t), b * np.sin(t), 0 * t], 1)
