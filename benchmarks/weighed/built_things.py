"""Second batch, things put together: toolbox, loaf, helmet, side table, hammer, cool box."""

from dataclasses import replace

import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures
from corporeal.showcase.prop_mesh import (
    PropMesh,
    PropPart,
    concatenate_meshes,
    make_mesh,
    mesh_difference,
    mesh_union,
    plain_finish,
    textured_finish,
)
from weighed import labels
from weighed.goods import enclosed
from weighed.household import POLYPROPYLENE
from weighed.labels import dyed
from weighed.piece import Piece, Prop
from weighed.vessels import POLYETHYLENE, STEEL

ASH, BEECH, BIRCH_PLY = 670.0, 690.0, 680.0
HARDBOARD, CHIPBOARD, ACETATE = 850.0, 650.0, 1220.0
"""Densities [kg/m³] of woods and birch plywood at 12 % moisture, of high-density fibreboard, of
particle board, of cellulose acetate (handles of tools)."""
Size = tuple[float, float, float]


def block(size: Size, at: Size, radius: float = 0.0015) -> PropMesh:
    """Put a box with its middle at a place [m]."""
    return parametric_surfaces.RoundedBox(size, radius, corner=2).mesh().moved(at)


def hammer_pieces() -> tuple[PropMesh, PropMesh]:
    """Return head and handle of a cross-peen hammer that lies on its side, handle along x."""
    long, thick = 0.118, 0.027
    head = block((thick, long, thick), (0, 0, 0), 0.002)
    for side in (1, -1):  # the peen: both cheeks are cut off aslant
        cheek = block((0.08, 0.08, 0.06), (side * 0.04, 0.038, 0), 0.001)
        head = mesh_difference(head, cheek.moved((side * thick / 2, 0.020, 0), (0, 0, side * 15)))
    x = np.linspace(-0.016, 0.302, 14)
    swell = 0.0098 + 0.0052 * np.clip((x - 0.02) / 0.16, 0, 1) + 0.0012 * np.sin(22 * x)
    handle = parametric_surfaces.tube_surface(np.stack([x, 0 * x - 0.004, 0 * x], 1), swell, 24)
    return mesh_difference(head, handle), handle


def hammer() -> Prop:
    """Model an engineer's hammer: a forged head on a handle of ash."""
    head, handle = hammer_pieces()
    mesh = mesh_union([dyed(head, "#4d5054"), dyed(handle, "#d2a86a")])
    forged = "forged steel; heads of this shape and size are sold as 500 g (DIN 1041)"
    return Prop(
        "hammer",
        "solid",
        (PropPart("hammer", mesh, plain_finish("hammer", "#ffffff", 0.5), "steel"),),
        (Piece("head", enclosed(head), STEEL, forged), Piece("handle", enclosed(handle), ASH, "ash: 670 kg/m³")),
    )


def loaf() -> Prop:
    """Model a loaf of white bread that was baked in a tin."""
    long, wide, tall = 0.230, 0.105, 0.090
    box = parametric_surfaces.RoundedBox((long, wide, tall), 0.012, corner=3, inner=20, tile=0.2)
    mesh = box.mesh().moved((0, 0, tall / 2))
    x, y, z = mesh.vertices.T
    up = np.clip(z / tall, 0, 1)
    crown = (1 - (2 * x / long) ** 6) * (1 - (2 * y / wide) ** 4).clip(0)
    risen = np.clip((up - 0.7) / 0.3, 0, 1)
    lumps = 0.0012 * np.sin(70 * x + 1) * np.sin(90 * y + 60 * z)
    v = np.stack([x, y * (1 + 0.06 * np.sin(np.pi * risen)), z + 0.026 * crown * up**3], 1)
    v += mesh.normals * (lumps * up)[:, None]
    brown = np.clip((v[:, 2:] - 0.085) / 0.03, 0, 1)
    shade = 1 - brown * (1 - np.array([0.55, 0.40, 0.28]))
    made = make_mesh(v, mesh.faces, uv=mesh.uv).tinted(shade)
    return Prop(
        "loaf of white bread",
        "solid",
        (PropPart("loaf", made, textured_finish("loaf", labels.crust(), 0.9), "bread"),),
        (Piece("bread", enclosed(made), 1000 / 3.9, "white bread: 3.5 to 5.0 cm³/g; 3.9 here"),),
    )


def side_table() -> Prop:
    """Model a white side table whose top and legs are thin boards about paper and air."""
    top, thick, leg, tall, skin, strip = 0.50, 0.050, 0.050, 0.40, 0.003, 0.025
    at = top / 2 - leg / 2
    corners = [(x, y) for x in (-at, at) for y in (-at, at)]
    slab = block((top, top, thick), (0, 0, tall + thick / 2))
    legs = [block((leg, leg, tall + 0.001), (x, y, tall / 2), 0.001) for x, y in corners]
    mesh = mesh_union([slab, *legs])
    core = thick - 2 * skin
    frame = (top**2 - (top - 2 * strip) ** 2) * core
    sides = (leg**2 - (leg - 2 * skin) ** 2) * tall
    plug = (leg - 2 * skin) ** 2 * 0.10
    comb = (top - 2 * strip) ** 2 * core
    skins = "faces of flush boards: 1.8 to 6 mm of fibreboard (mdf-info.eu); 3 mm of 850 kg/m³"
    return Prop(
        "side table of hollow board",
        "hollow",
        (PropPart("table", mesh, plain_finish("table", "#eeeeec", 0.45), "chipboard"),),
        (
            Piece("faces of the top", 2 * top**2 * skin, HARDBOARD, skins),
            Piece("frame of the top", frame, CHIPBOARD, "strips of particle board, 25 × 44 mm"),
            Piece("honeycomb", comb, 22.0, "expanded paper, 20 to 25 kg/m³ as it stands"),
            Piece("legs", 4 * sides, HARDBOARD, "four folded boards each, 3 mm"),
            Piece("plugs of the legs", 4 * plug, CHIPBOARD, "10 cm of each leg is filled"),
        ),
    )


def cool_box() -> Prop:
    """Model a cool box of 22 l with a lid and a handle: foam between two skins of plastic."""
    out, room, lid = (0.44, 0.30, 0.30), (0.37, 0.23, 0.255), (0.452, 0.312, 0.05)
    body = block(out, (0, 0, out[2] / 2), 0.018)
    cover = block(lid, (0, 0, out[2] + lid[2] / 2 + 0.002), 0.014)
    seam = block((0.43, 0.29, 0.02), (0, 0, out[2]), 0.005)
    rise = [(0.232, 0.24), (0.234, 0.36), (0.215, 0.395), (0, 0.400)]
    bent = parametric_surfaces.soften_corners([*rise, *[(-x, z) for x, z in rise[-2::-1]]], 2)
    path = np.stack([bent[:, 0], 0 * bent[:, 0], bent[:, 1]], 1)
    handle = parametric_surfaces.tube_surface(path, 0.010, 16)
    white = dyed(mesh_union([cover, handle]), "#eceef0")
    mesh = mesh_union([dyed(body, "#1f5fae"), dyed(seam, "#1b1c1e"), white])
    shell = 2 * (out[0] + out[1]) * out[2] + out[0] * out[1]
    lining = 2 * (room[0] + room[1]) * room[2] + room[0] * room[1]
    skins = shell * 0.002 + lining * 0.0015
    faces = 2 * lid[0] * lid[1] + 2 * (lid[0] + lid[1]) * lid[2]
    foam, filled = float(np.prod(out) - np.prod(room)) - skins, float(np.prod(lid))
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    tube = np.pi * (0.010**2 - 0.0075**2) * length
    made = "injection-moulded skins; chosen: 2 mm without, 1.5 mm within"
    rigid = "rigid polyurethane foam for insulation, 40 kg/m³ (38 to 45 are usual)"
    return Prop(
        "cool box, empty",
        "hollow",
        (PropPart("box", mesh, plain_finish("box", "#ffffff", 0.45), "plastics-HDPE"),),
        (
            Piece("skins of the box", skins, POLYETHYLENE, made),
            Piece("foam of the box", foam, 40.0, rigid),
            Piece("skin of the lid", faces * 0.0018, POLYETHYLENE, "moulded, 1.8 mm"),
            Piece("foam of the lid", filled - faces * 0.0018, 40.0, rigid),
            Piece("handle", tube, POLYPROPYLENE, "a tube of 20 mm, wall 2.5 mm"),
        ),
    )


OUTER, INNER = np.array([0.138, 0.106, 0.128]), np.array([0.110, 0.081, 0.102])
"""Half axes of a helmet's outer and inner face [m]."""


def ellipsoid(axes: np.ndarray) -> PropMesh:
    """Return a closed ellipsoid about the origin; axes [m]."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 41)
    half = np.stack([np.cos(t), np.sin(t)], 1)
    half[[0, -1], 0] = 0
    ball = parametric_surfaces.lathe_surface(half, 80)
    return make_mesh(ball.vertices * axes, ball.faces, uv=ball.uv)


def helmet_foam() -> PropMesh:
    """Cut a helmet's liner with its shell: two half ellipsoids and ten openings."""
    floor = block((0.4, 0.4, 0.2), (0, 0, -0.108), 0.001)
    slots = [
        dyed(block((long, 0.017, 0.12), (x, y, 0.10), 0.006), "#1a1a1c").moved(turn=(-tilt, 0, 0))
        for y, tilt in ((0.0, 0.0), (0.022, 18.0), (-0.022, -18.0))
        for x, long in ((0.056, 0.062), (-0.050, 0.070))
    ]
    slots += [
        dyed(block((0.050, 0.12, 0.016), (x, side * 0.10, 0.045), 0.006), "#1a1a1c")
        for x in (0.045, -0.035)
        for side in (1, -1)
    ]
    hollow = dyed(ellipsoid(INNER), "#2a2a2d").moved((0, 0, -0.004))
    return mesh_difference(dyed(ellipsoid(OUTER), "#c8352b"), hollow, floor, *slots)


def helmet() -> Prop:
    """Model a bicycle helmet: polystyrene foam in a thin shell, with straps."""
    foam = helmet_foam()
    straps = [
        parametric_surfaces.tube_surface([(x, side * 0.088, 0.002), (0.01, side * 0.004, -0.115)], 0.004, 10)
        for x in (0.05, -0.045)
        for side in (1, -1)
    ]
    mesh = mesh_union([foam, *[dyed(s, "#141416") for s in straps]])
    corners = foam.vertices[foam.faces]
    outside = (np.abs((corners**2 / OUTER**2).sum(2) - 1) < 0.02).all(1)
    edges = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    shell = float(np.linalg.norm(edges[outside], axis=1).sum() / 2)
    liner = "63 helmets of ten models: 58 to 100 kg/m³ (Kroeker et al. 2016); 74 here"
    return Prop(
        "bicycle helmet",
        "solid",
        (PropPart("helmet", mesh, plain_finish("helmet", "#ffffff", 0.45), "packaging_foam"),),
        (
            Piece("liner", enclosed(foam) - shell * 5e-4, 74.0, liner),
            Piece("shell", shell * 5e-4, 1200.0, "polycarbonate film, formed with the foam, .5 mm"),
            Piece("straps", 1.3 * 0.015 * 0.0016, 600.0, "1.3 m of webbing, 15 × 1.6 mm"),
            Piece("band", 0.60 * 0.022 * 0.0016, POLYPROPYLENE, "round the head, 60 cm, within"),
            Piece("buckle and dial", 14e-6, 1000.0, "14 g"),
            Piece("pads", 60e-6, 60.0, "60 cm³ of soft foam with cloth"),
        ),
    )


def screwdriver(at: Size) -> tuple[PropMesh, PropMesh]:
    """Return blade and grip of a screwdriver that lies along x."""
    blade = parametric_surfaces.tube_surface([(-0.125, 0, 0), (0.004, 0, 0)], 0.0030, 12).moved(at)
    grip = parametric_surfaces.tube_surface([(0.012, 0, 0), (0.05, 0, 0), (0.095, 0, 0)], (0.011, 0.0135, 0.0125), 16)
    grip = grip.moved(at)
    return mesh_difference(blade, grip), grip


def spanner(at: Size, size: float) -> PropMesh:
    """Return an open-ended spanner that lies along x; ``size`` scales it."""
    bar = block((0.15, 0.014, 0.006), (0, 0, 0), 0.001)
    jaws = []
    for end in (-1, 1):
        disc = parametric_surfaces.lathe_surface([(0, -0.004), (0.018, -0.004), (0.018, 0.004), (0, 0.004)], 32)
        slot = block((0.022, 0.015, 0.02), (end * 0.092, 0, 0), 0.0005)
        jaws.append(mesh_difference(disc.moved((end * 0.082, 0, 0)), slot))
    mesh = mesh_union([bar, *jaws])
    return replace(mesh, vertices=mesh.vertices * size).moved(at)


def toolbox() -> Prop:
    """Model an open carrier of plywood with tools in it, all of them drawn."""
    long, wide, tall, ply = 0.42, 0.20, 0.12, 0.009
    floor = block((long, wide, ply), (0, 0, ply / 2), 0.0005)
    sides = [block((long, ply, tall), (0, s * (wide - ply) / 2, tall / 2), 0.0005) for s in (1, -1)]
    ends = [block((ply, wide, tall), (s * (long - ply) / 2, 0, tall / 2), 0.0005) for s in (1, -1)]
    posts = [block((ply, 0.09, 0.26), (s * (long - ply) / 2, 0, 0.13), 0.0005) for s in (1, -1)]
    bar = parametric_surfaces.tube_surface([(-long / 2 + 0.004, 0, 0.235), (long / 2 - 0.004, 0, 0.235)], 0.0125, 20)
    ply_box = mesh_union([floor, *sides, *ends, *posts])
    rod = mesh_difference(bar, ply_box)
    on = ply + 0.0002
    head, shaft = (m.moved((-0.15, 0.035, on + 0.0153)) for m in hammer_pieces())
    blades, grips = zip(*(screwdriver((0.02, y, on + 0.0137)) for y in (-0.045, -0.078)), strict=True)
    keys = [spanner((x, y, on + 0.0045), s) for x, y, s in ((0.06, 0.075, 1.0), (0.06, -0.014, 0.8))]
    metal = concatenate_meshes([head, *blades, *keys])
    grain = procedural_textures.wood_texture(512, 11, "#c9a877", "#dcc197", "#e8d3ae")
    carrier = mesh_union([ply_box, rod])
    lying = np.abs(carrier.normals[:, 2:]) > 0.5
    v = carrier.vertices
    carrier = replace(carrier, uv=np.where(lying, v[:, :2], v[:, [0, 2]] + v[:, [1, 1]]) / 0.25)
    box = textured_finish("box", grain, 0.7)
    return Prop(
        "carrier with tools",
        "filled",
        (
            PropPart("box", carrier, box, "plywood"),
            PropPart("metal", metal, plain_finish("metal", "#6b6f75", 0.4, metallic=0.6), "steel"),
            PropPart("shaft", shaft, plain_finish("shaft", "#d2a86a", 0.6), "hardwood"),
            PropPart("grips", concatenate_meshes(grips), plain_finish("grips", "#d98a1f", 0.3), "hard_plastic"),
        ),
        (
            Piece("boards", enclosed(ply_box), BIRCH_PLY, "birch plywood of 9 mm: 680 kg/m³"),
            Piece("rod", enclosed(rod), BEECH, "beech, 25 mm"),
            Piece("metal", enclosed(metal), STEEL, "hammer, two spanners, two blades, all steel"),
            Piece("shaft", enclosed(shaft), ASH, "ash: 670 kg/m³"),
            Piece("grips", enclosed(concatenate_meshes(grips)), ACETATE, "cellulose acetate, solid"),
        ),
    )
