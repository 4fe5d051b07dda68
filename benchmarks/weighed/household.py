"""Second batch, turned things: an imitation pear, a flask, a tissue roll, a bottle, a candle."""

from dataclasses import replace

import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures
from corporeal.showcase.prop_mesh import PropPart, mesh_difference, mesh_union, plain_finish, textured_finish
from weighed import labels
from weighed.goods import enclosed
from weighed.labels import dyed
from weighed.piece import Piece, Prop, swept, turned
from weighed.vessels import GLASS, POLYETHYLENE, STAINLESS, by_height

POLYPROPYLENE, SILICONE, CORK, PARAFFIN = 905.0, 1150.0, 170.0, 900.0
"""Densities [kg/m³]: handbook values."""


def pear() -> Prop:
    """Model an imitation pear: a closed wall of polyethylene, and its stalk."""
    outline = parametric_surfaces.soften_corners([
        (0.0, 0.004), (0.012, 0.001), (0.026, 0.004), (0.038, 0.022), (0.037, 0.045),
        (0.026, 0.066), (0.019, 0.082), (0.015, 0.094), (0.005, 0.099), (0.0, 0.096),
    ])  # fmt: skip
    body = parametric_surfaces.lathe_surface(outline, 96)
    stalk = parametric_surfaces.tube_surface([(0, 0, 0.090), (0.002, 0, 0.103), (0.007, 0, 0.115)], 0.0022, 12)
    mesh = mesh_union([body, dyed(stalk, "#5b3a1e")])
    per_area = 2.8
    of = (
        "imitation fruits of the YCB set (Calli et al. 2015), by mass and size: orange 47 g, "
        "73 mm; lemon 29 g, 54 × 68 mm; peach 33 g, 59 mm; plum 25 g, 52 mm: 2.7 to 3.0 kg/m² of "
        "surface"
    )
    return Prop(
        "imitation pear",
        "hollow",
        (PropPart("pear", mesh, textured_finish("pear", labels.pear_skin(), 0.35), "plastics-LDPE"),),
        (
            Piece("wall", swept(outline) * per_area / POLYETHYLENE, POLYETHYLENE, of),
            Piece("stalk", enclosed(mesh_difference(stalk, body)), POLYETHYLENE, "moulded with it"),
        ),
    )


def vacuum_flask() -> Prop:
    """Model a vacuum flask of stainless steel for .75 l, empty, its cup screwed on."""
    neck, top = 0.234, 0.284
    body = np.array([
        [0.0, 0.004], [0.030, 0.004], [0.033, 0.0], [0.0375, 0.004],
        *[(0.0375, z) for z in np.linspace(0.012, 0.212, 9)], [0.036, 0.226], [0.0345, 0.230],
        [0.0345, neck],
    ])  # fmt: skip
    cup = np.array([
        [0.036, neck + 0.002], [0.036, top - 0.008], [0.0335, top], [0.0, top],
    ])  # fmt: skip
    outside = np.concatenate([body, cup])
    inner, deep = 0.0338, 0.208
    inside = 2 * np.pi * inner * deep + np.pi * inner**2
    plug = 2 * np.pi * 0.023**2 + 2 * np.pi * 0.023 * 0.045
    gauge = "sheet of steel tumblers: .35 to 1.2 mm; "
    return Prop(
        "vacuum flask, empty",
        "hollow",
        (
            PropPart(
                "flask",
                by_height(parametric_surfaces.lathe_surface(outside, 96)),
                textured_finish("flask", labels.flask(neck / top), 0.35, 0.7),
                "stainless_steel",
            ),
        ),
        (
            Piece("outer wall", swept(body) * 0.0005, STAINLESS, gauge + ".5 mm"),
            Piece("inner wall", inside * 0.0004, STAINLESS, gauge + ".4 mm; holds .75 l"),
            Piece("cup", swept(cup) * 0.0004, STAINLESS, gauge + ".4 mm"),
            Piece("lining of the cup", swept(cup) * 0.0012, POLYPROPYLENE, "moulded, 1.2 mm"),
            Piece("stopper", plug * 0.002, POLYPROPYLENE, "hollow, 46 × 45 mm, wall 2 mm"),
            Piece("rings", 2.6e-6, SILICONE, "two seals, 1.3 cm³ each"),
        ),
    )


def tissue_roll() -> Prop:
    """Model a roll of toilet tissue: 25 m of three plies, wound on a core."""
    core, radius, wide, length, plies = 0.020, 0.0575, 0.100, 25.0, 3 * 0.0155
    ring = np.array([
        [core, 0.0], [core + 0.0006, 0.0], [radius - 0.003, 0.0], [radius, 0.003],
        [radius, wide - 0.003], [radius - 0.003, wide], [core + 0.0006, wide], [core, wide],
    ])  # fmt: skip
    mesh = parametric_surfaces.lathe_surface(ring, 96, loop=True)
    within = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) < core + 0.0003
    brown = dyed(mesh, "#b09a80").colours
    mesh = mesh.tinted(np.where(within[:, None], brown, 1.0))
    room = np.pi * (radius**2 - (core + 5e-4) ** 2) * wide
    of = (
        "25 m of three plies of 15.5 g/m² (14 to 22 are usual; 25 rolls that the Hong Kong "
        "Consumer Council tested in 2018 have 20 to 42 m and 85 to 196 g)"
    )
    board = 2 * np.pi * core * wide
    return Prop(
        "roll of toilet tissue",
        "solid",
        (PropPart("roll", mesh, textured_finish("roll", labels.tissue(), 0.95), "paper"),),
        (
            Piece("tissue", room, length * wide * plies / room, of),
            Piece("core", board * 5e-4, 0.30 / 5e-4, "two plies of board of 150 g/m²"),
        ),
    )


def wine_bottle() -> Prop:
    """Model a bottle of red wine, .75 l, unopened, by its outside."""
    height, low, high, capsule = 0.301, 0.045, 0.135, 0.243
    outside = np.array([
        [0.0, 0.020], [0.012, 0.016], [0.026, 0.002], [0.032, 0.0], [0.0379, 0.004],
        *[(0.0383, z) for z in np.linspace(0.012, 0.182, 9)],
        [0.036, 0.194], [0.030, 0.207], [0.021, 0.218], [0.0155, 0.228], [0.0148, capsule],
        [0.0140, 0.285], [0.0150, 0.287], [0.0150, height], [0.0, height],
    ])  # fmt: skip
    shares = [z / height for z in (low, high, capsule)]
    empty = "empty bottles of 750 ml weigh 300 to 950 g, about 500 g on average (wineloverspage.com)"
    return Prop(
        "bottle of wine, full",
        "filled",
        (
            PropPart(
                "bottle",
                by_height(parametric_surfaces.lathe_surface(outside, 96)),
                textured_finish("bottle", labels.wine(shares), 0.15),
                "glass",
            ),
        ),
        (
            Piece("bottle", 0.5 / GLASS, GLASS, empty),
            Piece("wine", 0.00075, 990.0, "750 ml; dry wine: .99 g/ml"),
            Piece("cork", np.pi * 0.012**2 * 0.044, CORK, "24 × 44 mm, pressed into the neck"),
            Piece("capsule and label", 3.5e-6, 1000.0, "3.5 g"),
        ),
    )


def candle() -> Prop:
    """Model a pillar candle, 70 × 140 mm, that has burned a little."""
    outline = [
        (0.0, 0.0), (0.0335, 0.0), (0.035, 0.0015), (0.035, 0.1375), (0.0335, 0.140),
        (0.024, 0.136), (0.012, 0.132), (0.0, 0.131),
    ]  # fmt: skip
    body = parametric_surfaces.lathe_surface(outline, 96)
    wick = parametric_surfaces.tube_surface([(0, 0, 0.125), (0, 0, 0.138), (0.002, 0, 0.144)], 0.0012, 10)
    mesh = mesh_union([dyed(body, "#f1e6cc"), dyed(wick, "#2b2622")])
    return Prop(
        "pillar candle",
        "solid",
        (PropPart("candle", mesh, plain_finish("candle", "#ffffff", 0.5), "wax"),),
        (Piece("wax", turned(np.array(outline)), PARAFFIN, "paraffin wax: 900 kg/m³"),),
    )


def sand_bucket() -> Prop:
    """Model a plastic bucket of 14 l with dry sand in its lower half; both faces are drawn."""
    wall, height = 0.0021, 0.300
    side = np.array([[0.120, 0.0], [0.150, height]])
    ring = np.array([
        [0.0, 0.0], side[0], [0.1485, height - 0.015], [0.1535, height - 0.013],
        [0.1535, height], [0.150 - wall, height], [0.120 - wall, wall], [0.0, wall],
    ])  # fmt: skip
    around = np.linspace(0, np.pi, 25)
    bail = [(0.152 * np.cos(a), -0.06 * np.sin(a) - 0.155 * np.sin(a), 0.285) for a in around]
    handle = parametric_surfaces.tube_surface(bail, 0.0045, 12)
    bucket = parametric_surfaces.lathe_surface(ring, 96)
    mesh = mesh_union([dyed(bucket, "#d9dadb"), dyed(handle, "#b3261e")])
    level = 0.136
    edge = 0.120 - wall + (side[1, 0] - side[0, 0]) * (level - wall) / (height - wall)
    heap = np.array([
        [0.0, wall + 1e-4], [0.120 - wall - 2e-4, wall + 1e-4], [edge - 2e-4, level],
        [0.09, level + 0.012], [0.04, level + 0.020], [0.0, level + 0.022],
    ])  # fmt: skip
    sand = parametric_surfaces.lathe_surface(heap, 96)
    grains = procedural_textures.speckle_texture(512, 17, "#a58a5c", "#c9b083", "#e2cfa6", falloff=0.3, contrast=0.25)
    sand = replace(sand, uv=sand.vertices[:, :2] / 0.12)
    relief = "UN relief bucket of 14 l (IOM 4700000060): 300 mm high, 300 and 240 mm wide, of HDPE "
    return Prop(
        "bucket with sand",
        "filled",
        (
            PropPart("bucket", mesh, plain_finish("bucket", "#ffffff", 0.4), "plastics-HDPE"),
            PropPart("sand", sand, textured_finish("sand", grains, 1.0), "sand"),
        ),
        (
            Piece("bucket", turned(ring), POLYETHYLENE, relief + "600 g or more"),
            Piece("handle", enclosed(handle), POLYETHYLENE, relief + "30 g"),
            Piece("sand", turned(heap), 1550.0, "dry sand, poured: 1,440 to 1,600 kg/m³"),
        ),
    )
