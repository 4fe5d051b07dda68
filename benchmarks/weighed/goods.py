"""Other props: a play ball, a wooden stool, a dictionary, a cushion, a brick with holes."""

from dataclasses import replace

import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures
from corporeal.showcase.prop_mesh import PropMesh, PropPart, mesh_difference, mesh_union, textured_finish
from weighed import pictures
from weighed.piece import Piece, Prop
from weighed.vessels import RUBBER


def play_ball() -> Prop:
    """Model a rubber ball of 8.5 inches, full of air."""
    radius, wall = 0.108, 0.0021
    t = np.linspace(-np.pi / 2, np.pi / 2, 49)
    profile = radius * np.stack([np.cos(t), np.sin(t)], 1)
    profile[[0, -1], 0] = 0
    mesh = parametric_surfaces.lathe_surface(profile, 96).moved(turn=(24, -18, 0))
    volume = 4 / 3 * np.pi * (radius**3 - (radius - wall) ** 3)
    source = "utility balls of 220 mm weigh 330 to 380 g: a wall of 2.1 mm"
    return Prop(
        "rubber play ball",
        "hollow",
        (PropPart("ball", mesh, textured_finish("ball", pictures.play_ball(), 0.55), "rubber"),),
        (Piece("ball", volume, RUBBER, source),),
    )


SEAT, LEG = (0.165, 0.034), (0.021, 0.014)
"""Of the stool: radius and thickness of the seat; radii of a leg above and below [m]."""

EDGE = 0.008
"""Radius of the rounded edge of the seat [m]."""


def stool() -> Prop:
    """Model a round stool of beech, 46 cm high: four splayed legs and four rungs."""
    radius, thick = SEAT
    t = np.linspace(-np.pi / 2, np.pi / 2, 13)
    half = EDGE * np.stack([np.cos(t), np.sin(t)], 1)
    rim = half + np.where(t[:, None] < 0, [radius - EDGE, EDGE], [radius - EDGE, thick - EDGE])
    profile = np.concatenate([[[0.0, 0.0]], rim, [[0.0, thick]]])
    seat = parametric_surfaces.lathe_surface(profile, 96).moved((0, 0, 0.43))
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / np.sqrt(2)
    tops, feet = corners * 0.105, corners * 0.165
    legs = [
        parametric_surfaces.tube_surface([(*top, 0.435), (*foot, 0.013)], LEG, 20)
        for top, foot in zip(tops, feet, strict=True)
    ]
    knots = [(tops + (feet - tops) * share, z) for share, z in ((0.62, 0.173), (0.72, 0.131))]
    rungs = []
    for k in range(4):
        at, z = knots[k % 2]
        ends = [(*at[k], z), (*at[(k + 1) % 4], z)]
        rungs.append(parametric_surfaces.tube_surface(ends, 0.009, 14))
    mesh = mesh_union([seat, *legs, *rungs])
    grain = procedural_textures.wood_texture(512, 7, "#b98a55", "#d3a873", "#e0bc8b")
    across = np.stack([mesh.vertices[:, 0] / 0.4, mesh.vertices[:, 1] / 0.4], 1)
    upright = np.stack([mesh.vertices[:, 2] / 0.4, mesh.uv[:, 0]], 1)
    lying = np.abs(mesh.normals[:, 2:]) > 0.5
    mesh = replace(mesh, uv=np.where(lying, across, upright))
    source = "European beech at 12 % moisture: 690 kg/m³"
    return Prop(
        "beech stool",
        "solid",
        (PropPart("stool", mesh, textured_finish("stool", grain, 0.5), "hardwood"),),
        (Piece("stool", enclosed(mesh), 690.0, source),),
    )


def dictionary() -> Prop:
    """Model a hard-bound dictionary: leaves of 60 g/m² in boards of 3 mm."""
    wide, tall, board, leaves, leaf = 0.150, 0.225, 0.003, 640, 0.000078
    block = leaves * leaf
    thick = block + 2 * board
    size = (wide - 0.006, tall - 0.008, block)
    pages = parametric_surfaces.RoundedBox(size, 0.0006, tile=0.05, grain=1).mesh().moved((0.0005, 0, thick / 2))
    slabs = [
        parametric_surfaces.RoundedBox((wide, tall, board), 0.001, corner=3).mesh().moved((0, 0, z))
        for z in (board / 2, thick - board / 2)
    ]
    spine = parametric_surfaces.RoundedBox((board, tall, thick), 0.001, corner=3).mesh()
    cover = mesh_union([*slabs, spine.moved((-wide / 2 + board / 2, 0, thick / 2))])
    v, n = cover.vertices, cover.normals
    on_board = np.abs(n[:, 2:]) > 0.9
    turned_over = np.sign(n[:, 2:])
    uv = np.stack([0.5 + v[:, 0] / wide, 0.5 + v[:, 1] / tall], 1)
    uv = np.where(on_board, np.stack([0.5 + turned_over[:, 0] * (uv[:, 0] - 0.5), uv[:, 1]], 1), 0.02)
    cover = replace(cover, uv=uv)
    pages = mesh_difference(pages, cover)
    sheets = leaves * size[0] * size[1]
    return Prop(
        "dictionary",
        "solid",
        (
            PropPart("cover", cover, textured_finish("cover", pictures.dictionary(), 0.7), "cardboard"),
            PropPart("pages", pages, textured_finish("pages", procedural_textures.pages_texture(), 0.9), "paper"),
        ),
        (
            Piece("pages", sheets * leaf, 0.060 / leaf, "640 leaves of 60 g/m², .078 mm each"),
            Piece("boards", enclosed(cover), 615.0, "grey board: 3 mm of it are 1,845 g/m²"),
            Piece("cloth", (2 * wide + thick) * tall * 3e-4, 0.2 / 3e-4, "book cloth and end papers of 200 g/m²"),
        ),
    )


def cushion() -> Prop:
    """Model a sofa cushion, 45 × 30 cm, stuffed with polyester fibre."""
    pillow = parametric_surfaces.CushionShape((0.45, 0.30, 0.03), 0.055, 0.0145, 0.004, 24, pinch=0.06, seams=(0,))
    mesh = pillow.mesh()
    v = mesh.vertices
    mesh = replace(mesh, uv=np.stack([v[:, 0] / 0.45 + 0.5, v[:, 1] / 0.3 + 0.5], 1))
    look = textured_finish("cushion", pictures.stripes("#284b7a", "#e9e2d0", "#8fa9c6", count=15), 0.95)
    cover = 2 * 0.45 * 0.30 * 1.1
    return Prop(
        "sofa cushion",
        "filled",
        (PropPart("cushion", mesh, look, "cotton"),),
        (
            Piece("cover", cover * 5e-4, 0.38 / 5e-4, "outer and inner cloth, 380 g/m² together"),
            Piece("fibre", enclosed(mesh), 24.0, "hollow fibre, stuffed firmly: 24 kg/m³"),
        ),
    )


def brick() -> Prop:
    """Model a facing brick, 240 × 115 × 71 mm, with three rows of holes."""
    size, hole = (0.240, 0.115, 0.071), 0.013
    body = parametric_surfaces.RoundedBox(size, 0.0015, corner=2, tile=0.12).mesh().moved((0, 0, size[2] / 2))
    holes = [
        parametric_surfaces.lathe_surface([(0, -0.01), (hole, -0.01), (hole, 0.09), (0, 0.09)], 40).moved((x, y, 0))
        for x in np.linspace(-0.085, 0.085, 5)
        for y in (-0.031, 0.0, 0.031)
    ]
    mesh = mesh_difference(body, *holes)
    clay = procedural_textures.speckle_texture(512, 61, "#7e3325", "#a24a33", "#b9644a", falloff=0.5, contrast=0.16)
    source = "fired clay of facing bricks: 1,950 kg/m³ (solid clay bricks: about 2,000)"
    return Prop(
        "brick with holes",
        "solid",
        (PropPart("brick", mesh, textured_finish("brick", clay, 0.95), "brick"),),
        (Piece("brick", enclosed(mesh), 1950.0, source),),
    )


def enclosed(mesh: PropMesh) -> float:
    """Return the volume that a closed surface encloses, by the divergence theorem [m³]."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
