"""Seats: armchair and couch, facing +x."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from corporeal.core.types import Finish
from corporeal.showcase import parametric_surfaces, procedural_textures
from corporeal.showcase.parametric_surfaces import CushionShape, RoundedBox
from corporeal.showcase.prop_mesh import (
    ZERO_OFFSET,
    PropMesh,
    PropModel,
    PropPart,
    PropPoint,
    concatenate_meshes,
    mesh_difference,
    mesh_union,
    textured_finish,
    welded_vertex_normals,
)


def armchair() -> PropModel:
    """Model a lounge chair, 0.79 × 0.71 × 0.92 m: oak frame, two foam cushions.

    A stretcher ties the front legs together 0.11 m above the floor.
    """
    frame = mesh_union([*_chair_sides(), *_chair_rails(), *_chair_slats()])
    seat = CushionShape((0.60, 0.575, 0.105), 0.028, 0.035, 0.006, 11).mesh()
    seat = mesh_difference(seat.moved((0.035, 0, 0.385), (0, -4, 0)), frame)
    back = CushionShape((0.50, 0.555, 0.105), 0.030, 0.035, 0.006, 11).mesh()
    back = mesh_difference(back.moved(turn=(0, 73, 0)).moved((-0.262, 0, 0.672)), frame, seat)
    oak = procedural_textures.wood_texture(512, 31, "#6f4320", "#a86c38", "#d19a5e")
    fabric = _weave("teal weave", 41, "#123f44", "#2b7a7d", "#63adab")
    return PropModel(
        "armchair",
        (
            PropPart("frame", frame, textured_finish("oiled oak", oak, 0.5), "hardwood"),
            PropPart("seat_cushion", seat, fabric, "seat_foam"),
            PropPart("back_cushion", back, fabric, "seat_foam"),
        ),
    )


def _chair_sides() -> list[PropMesh]:
    """Legs, armrests, side rails and back posts."""
    pieces = []
    x = np.linspace(-0.34, 0.37, 15)
    k = np.linspace(0, 1, 6)
    for side in (-1, 1):
        y = side * 0.325
        post = np.stack([-0.235 - 0.165 * k, 0 * k + side * 0.25, 0.27 + 0.53 * k], 1)
        pieces += [
            _leg((0.30, y, 0.555), (0.335, y * 1.03, 0.0), 0.021, 0.014),
            _leg((-0.27, y, 0.545), (-0.37, y * 1.03, 0.0), 0.021, 0.014),
            _armrest(x, y, 0.555 + 0.05 * ((x + 0.34) / 0.71) ** 2),
            _board((0.62, 0.024, 0.07), (0.0, y, 0.292), (0, -4, 0)),
            parametric_surfaces.tube_surface(post, 0.017, 14, 2),
        ]
    return pieces


def _chair_rails() -> list[PropMesh]:
    """Front and rear rail, front stretcher, top of the back."""
    return [
        _board((0.026, 0.66, 0.065), (0.29, 0, 0.312)),
        _board((0.026, 0.66, 0.06), (-0.235, 0, 0.275)),
        _board((0.024, 0.655, 0.056), (0.328, 0, 0.11), (0, 3.6, 0)),
        _board((0.022, 0.56, 0.055), (-0.402, 0, 0.80), (0, -17, 0), 0.009),
    ]


def _chair_slats() -> list[PropMesh]:
    """Boards across the back posts and under the seat."""
    back = [
        _board((0.016, 0.52, 0.04), (-0.235 - 0.165 * k, 0, 0.27 + 0.53 * k), (0, -17, 0), 0.006)
        for k in (0.25, 0.45, 0.65, 0.83)
    ]
    under = [
        _board((0.05, 0.64, 0.014), (x, 0, 0.309 + 0.05 * x), (0, -4, 0), 0.005)
        for x in (-0.15, -0.05, 0.05, 0.15, 0.23)
    ]
    return back + under


def _leg(top: PropPoint, foot: PropPoint, upper: float, lower: float) -> PropMesh:
    """Turn a leg between two points [m] with radii above and below [m], flat on the floor."""
    t = np.linspace(0, 1, 8)[:, None]
    path = np.asarray(foot, float) * (1 - t) + np.asarray(top, float) * t
    m = parametric_surfaces.tube_surface(path, lower + (upper - lower) * t[:, 0] ** 0.8, 16, uv_per_metre=2)
    v = m.vertices.copy()
    v[:, 2] = np.maximum(v[:, 2], 0)
    return replace(m, uv=m.uv[:, ::-1], vertices=v)


def _board(size: PropPoint, at: ArrayLike, turn: PropPoint = ZERO_OFFSET, radius: float = 0.008) -> PropMesh:
    return RoundedBox(size, radius, tile=0.5).mesh().moved(at, turn)


def _armrest(x: np.ndarray, y: float, z: np.ndarray) -> PropMesh:
    """Bend a flat board so that it rises towards the front."""
    m = RoundedBox((x[-1] - x[0], 0.062, 0.026), 0.011, inner=14, tile=0.5).mesh()
    middle = (x[0] + x[-1]) / 2
    v = m.vertices.copy()
    share = np.clip((v[:, 0] + middle - x[0]) / (x[-1] - x[0]), 0, 1)
    v[:, 1] *= 0.75 + 0.25 * np.sin(share * np.pi * 0.75)
    v[:, 2] += np.interp(v[:, 0] + middle, x, z)
    return replace(m, vertices=v + np.array([middle, y, 0]), normals=welded_vertex_normals(v, m.faces))


def couch() -> PropModel:
    """Model a two-seat couch, 1.75 × 0.90 × 0.84 m: walnut legs, padded body, loose cushions."""
    legs, plinth, body = _couch_legs(), RoundedBox((0.82, 1.60, 0.15), 0.03, inner=6), _couch_body()
    base = mesh_difference(plinth.mesh().moved((0.0, 0, 0.225)), body, legs)
    seat = mesh_difference(_pair((0.66, 0.70, 0.145), 0.024, (0.095, 0.378), 0), body, base)
    back = mesh_difference(_pair((0.40, 0.68, 0.12), 0.040, (-0.195, 0.635), 79), body, seat)
    pillow = CushionShape((0.42, 0.42, 0.03), 0.06, 0.0145, 0.005, 10, pinch=0.07, seams=(0,)).mesh()
    pillow = pillow.moved(turn=(0, 66, 0)).moved((-0.005, 0.44, 0.637), (0, 0, 12))
    walnut = textured_finish("walnut", procedural_textures.wood_texture(512, 33, "#3a2214", "#65401f", "#8d6137"), 0.45)
    oat = _weave("oat weave", 51, "#8b7f70", "#c9bda9", "#eee5d6")
    rust = _weave("rust weave", 52, "#70301d", "#bf5b39", "#e59468")
    return PropModel(
        "couch",
        (
            PropPart("legs", mesh_difference(legs, body), walnut, "hardwood"),
            PropPart("base", base, oat, "plywood", 0.012),
            PropPart("upholstery", mesh_difference(body, legs), oat, "seat_foam"),
            PropPart("seat_cushions", seat, oat, "seat_foam"),
            PropPart("back_cushions", back, oat, "seat_foam"),
            PropPart("throw_pillow", mesh_difference(pillow, back, seat), rust, "fibre_fill"),
        ),
    )


def _couch_legs() -> PropMesh:
    return mesh_union(
        [_leg((x, y, 0.17), (1.1 * x, 1.02 * y, 0), 0.026, 0.015) for x in (-0.34, 0.34) for y in (-0.74, 0.74)]
    )


def _couch_body() -> PropMesh:
    """Arms and rear in one."""
    arm = CushionShape((0.84, 0.15, 0.44), 0.008, 0.05, 0.0, 5).mesh()
    rear = CushionShape((0.17, 1.50, 0.55), 0.01, 0.05, 0.0, 5).mesh()
    arms = [arm.moved((0.005, side * 0.80, 0.375)) for side in (-1, 1)]
    return mesh_union([*arms, rear.moved((-0.345, 0, 0.48), (0, -7, 0))])


def _pair(size: PropPoint, puff: float, at: tuple[float, float], tilt: float) -> PropMesh:
    """Lay two cushions side by side at (x, z) [m], tilted about y [degrees]."""
    pinch = 0.02 if tilt else 0.0
    m = CushionShape(size, puff, 0.045, 0.0065, 8, pinch=pinch).mesh().moved(turn=(0, tilt, 0))
    return concatenate_meshes([m.moved((at[0], side * 0.362, at[1])) for side in (-1, 1)])


def _weave(name: str, seed: int, *colours: str) -> Finish:
    return textured_finish(name, procedural_textures.weave_texture(512, seed, *colours), 0.95)
