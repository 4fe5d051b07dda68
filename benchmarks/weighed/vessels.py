"""Turned props: a flower pot, a can of tomatoes, a jar of jam, a bottle of cola, a frying pan."""

from dataclasses import replace

import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures
from corporeal.showcase.prop_mesh import PropMesh, PropPart, plain_finish, textured_finish
from weighed import pictures
from weighed.piece import Piece, Prop, below, inset, swept, turned

STEEL, GLASS, PET, POLYETHYLENE, RUBBER = 7850.0, 2500.0, 1380.0, 950.0, 1150.0
STAINLESS, ALUMINIUM, PHENOLIC = 7930.0, 2700.0, 1400.0
"""Densities [kg/m³]: handbook values of carbon steel, soda-lime glass, PET, high-density
polyethylene, a rubber compound, steel 1.4301, pure aluminium, moulded phenolic resin."""
PAPER_LABEL = 0.08
"""Of a paper label [kg/m²]."""


def flower_pot() -> Prop:
    """Model a pot of terracotta with a collar and a hole below; both faces are drawn."""
    ring = np.array([
        [0.011, 0.0], [0.050, 0.0], [0.066, 0.108], [0.076, 0.110], [0.079, 0.143],
        [0.071, 0.143], [0.0685, 0.108], [0.0585, 0.105], [0.0435, 0.011], [0.011, 0.011],
    ])  # fmt: skip
    mesh = parametric_surfaces.lathe_surface(ring, 96, loop=True)
    look = textured_finish(
        "pot", procedural_textures.speckle_texture(512, 31, "#9c4f30", "#b9653f", "#cc7d55", contrast=0.1), 0.9
    )
    volume = turned(np.concatenate([ring, ring[:1]]))
    source = (
        "wall 7 to 8 mm; fired clay of a fifth porosity, 1,850 kg/m³, between common red brick "
        "(1,922 kg/m³) and soft earthenware"
    )
    return Prop(
        "terracotta flower pot",
        "hollow",
        (PropPart("pot", mesh, look, "ceramic"),),
        (Piece("pot", volume, 1850.0, source),),
    )


def tomato_can() -> Prop:
    """Model a can of chopped tomatoes, 75 × 110 mm, closed: 8 % of its room is head space."""
    wall, end, height, radius = 0.00017, 0.00022, 0.110, 0.0365
    rim, sunk = radius + 0.001, 0.004
    profile = np.array([
        [0.0, sunk], [radius - 0.002, sunk], [radius - 0.001, 0.0], [rim, 0.0], [rim, 0.003],
        [radius, 0.0045], *[(radius, z) for z in np.linspace(0.006, height - 0.006, 12)],
        [radius, height - 0.0045], [rim, height - 0.003], [rim, height],
        [radius - 0.001, height], [radius - 0.002, height - sunk], [0.0, height - sunk],
    ])  # fmt: skip
    room = np.pi * (radius - wall) ** 2 * (height - 2 * sunk)
    ends = 2 * np.pi * (radius + 0.008) ** 2 * end  # each with its seam, rolled
    body = 2 * np.pi * radius * height * wall
    label = 2 * np.pi * radius * (height - 0.014)
    look = textured_finish("can", pictures.tomato_can(height), 0.45)
    tin = "tinplate of food cans is .15 to .30 mm thick: .17 mm round, .22 mm at the ends"
    return Prop(
        "can of chopped tomatoes",
        "filled",
        (PropPart("can", by_height(parametric_surfaces.lathe_surface(profile, 96)), look, "steel"),),
        (
            Piece("body", body, STEEL, tin),
            Piece("ends", ends, STEEL, tin),
            Piece("label", label * 1e-4, PAPER_LABEL / 1e-4, "paper of 80 g/m²"),
            Piece("tomatoes", 0.92 * room, 1035.0, "tomatoes in their juice: 4 to 6 °Brix"),
        ),
    )


def jam_jar() -> Prop:
    """Model a jar of strawberry jam with a screwed lid, by its outside."""
    lid_low, height, wall, level = 0.090, 0.106, 0.0026, 0.080
    outside = np.array([
        [0.0, 0.003], [0.026, 0.003], [0.029, 0.0], [0.033, 0.001], [0.0365, 0.006],
        *[(0.0365, z) for z in np.linspace(0.012, 0.072, 9)],
        [0.0355, 0.079], [0.0325, 0.085], [0.0315, lid_low], [0.0315, 0.1035], [0.0, 0.1035],
    ])  # fmt: skip
    # The glass has no top: the lid closes it.
    inside = inset(outside, wall)
    inside[-1, 1] = inside[-2, 1] = 0.1035
    inside[:3, 1] = 0.0055  # a thicker bottom
    inside[:4, 0] = np.minimum(inside[:4, 0], 0.030)
    lid = np.array([
        [0.0, lid_low], [0.0345, lid_low], [0.0345, height - 0.002], [0.0335, height],
        [0.029, height], [0.028, height - 0.001], [0.0, height - 0.001],
    ])  # fmt: skip
    glass = turned(outside) - turned(inside)
    tin = (np.pi * 0.0345**2 + 2 * np.pi * 0.0345 * 0.016) * 1.15 * 0.00018
    jar = textured_finish("jar", pictures.jam_jar(0.1035, level), 0.12)
    checks = textured_finish("lid", pictures.gingham(), 0.3)
    top = parametric_surfaces.lathe_surface(lid, 96)
    flat = top.vertices[:, 2] > height - 0.0015
    around = np.stack([2 * top.uv[:, 0], top.vertices[:, 2] / 0.105], 1)
    across = top.vertices[:, :2] / 0.105 + 0.5
    top = replace(top, uv=np.where(flat[:, None], across, around))
    return Prop(
        "jar of strawberry jam",
        "filled",
        (
            PropPart("jar", by_height(parametric_surfaces.lathe_surface(outside, 96)), jar, "glass"),
            PropPart("lid", top, checks, "steel"),
        ),
        (
            Piece("jar", glass, GLASS, "a jar of some 330 ml: wall 2.6 mm"),
            Piece("lid", tin, STEEL, "tinplate .18 mm, a rolled edge and thread of 15 %"),
            Piece("jam", turned(below(inside, level)), 1330.0, "jam: 1,300 to 1,400 kg/m³"),
        ),
    )


def cola_bottle() -> Prop:
    """Model a PET bottle of 1.5 l, by its outside, not quite half full."""
    height, level, low, high, cap = 0.325, 0.135, 0.150, 0.215, 0.306
    side = [(0.0445, z) for z in np.linspace(0.035, 0.200, 12)]
    outside = np.array([
        [0.0, 0.012], [0.020, 0.008], [0.030, 0.0], [0.036, 0.002], [0.042, 0.014], *side,
        [0.0435, 0.225], [0.038, 0.255], [0.026, 0.280], [0.0165, 0.297], [0.0140, cap],
    ])  # fmt: skip
    closed = np.concatenate([outside, [[0.0150, cap], [0.0150, height], [0.0, height]]])
    # The mass of the wall is that of the preform; its mean thickness follows.
    preform = 0.0399
    wall = preform / PET / swept(outside)
    inside = np.concatenate([inset(outside, wall), [[0.0, cap]]])
    shares = [z / height for z in (level, low, high, cap)]
    look = textured_finish("bottle", pictures.cola_bottle(shares), 0.15)
    return Prop(
        "bottle of cola, half full",
        "filled",
        (PropPart("bottle", by_height(parametric_surfaces.lathe_surface(closed, 96)), look, "PET"),),
        (
            Piece("bottle", preform / PET, PET, "a preform of 39.9 g, made for 1.5 l"),
            Piece("cap", 0.0028 / POLYETHYLENE, POLYETHYLENE, "a screw cap of 2.8 g"),
            Piece("label", 0.0012 / 900, 900.0, "a sleeve of polypropylene film, 1.2 g"),
            Piece("cola", turned(below(inside, level)), 1042.0, "cola: 1,030 to 1,045 kg/m³"),
        ),
    )


def frying_pan() -> Prop:
    """Model a pan of stainless steel, 24 cm, on a sandwiched base; both faces are drawn."""
    sheet, disc, cover = 0.0008, 0.0048, 0.0005
    base = disc + cover
    bowl = np.array([
        [0.0, base], [0.088, base], [0.097, base + 0.002], [0.104, base + 0.012],
        [0.116, 0.050], [0.121, 0.0525],
    ])  # fmt: skip
    inner = inset(bowl, sheet)[::-1]
    # The base is drawn with the bowl, as one body.
    foot = np.array([[0.0, 0.0], [0.086, 0.0], [0.088, 0.0015]])
    closed = np.concatenate([foot, bowl[1:], inner])
    handle, grip = pan_handle()
    metal = plain_finish("pan", "#c3c6ca", 0.25, metallic=0.9)
    black = plain_finish("grip", "#151517", 0.45)
    disc_source = "a disc of aluminium under the base, 4.8 mm (makers state 4 to 6 mm)"
    return Prop(
        "frying pan of stainless steel",
        "hollow",
        (
            PropPart("pan", parametric_surfaces.lathe_surface(closed, 128), metal, "stainless_steel"),
            PropPart("handle", handle, black, "bakelite"),
        ),
        (
            Piece("bowl", swept(bowl) * sheet, STAINLESS, "sheet of .8 mm"),
            Piece("disc", np.pi * 0.086**2 * disc, ALUMINIUM, disc_source),
            Piece("cover of the disc", np.pi * 0.087**2 * cover, STAINLESS, "sheet of .5 mm"),
            Piece("handle", grip, PHENOLIC, "moulded all through, but for a bore of 8 mm"),
        ),
    )


def pan_handle() -> tuple[PropMesh, float]:
    """Return a handle that rises from the rim, and the volume of its substance [m³]."""
    along = np.linspace(0, 1, 12)
    path = np.stack([0.116 + 0.185 * along, 0 * along, 0.040 + 0.038 * along], 1)
    radii = 0.0105 + 0.0035 * np.sin(np.pi * along) + 0.001 * along
    mesh = parametric_surfaces.tube_surface(path, radii, 24)
    step = np.linalg.norm(path[1] - path[0])
    a, b = radii[:-1], radii[1:]
    rods = np.pi / 3 * step * (a**2 + a * b + b**2).sum()
    # Ends: two frusta each, from the radius to .7 of it over .4 of it, then to a point.
    ends = sum(np.pi / 3 * r**3 * (0.4 * (1 + 0.7 + 0.49) + 0.2 * 0.49) for r in radii[[0, -1]])
    return mesh, float(rods + ends - np.pi * 0.004**2 * 0.06)


def by_height(mesh: PropMesh) -> PropMesh:
    """Let a picture's v run with the height, not along the profile."""
    z = mesh.vertices[:, 2]
    return replace(mesh, uv=np.stack([mesh.uv[:, 0], (z - z.min()) / np.ptp(z)], 1))
