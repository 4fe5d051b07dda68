"""A snowman: three rolled balls of snow with coal, a carrot and twigs."""

import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures, sdf
from corporeal.showcase.prop_mesh import (
    PropMesh,
    PropModel,
    PropPart,
    PropPoint,
    concatenate_meshes,
    mesh_difference,
    mesh_union,
    plain_finish,
    textured_finish,
)

TWIG_PATH_FRACTIONS = np.linspace(0, 1, 7)[:, None]


def snowman() -> PropModel:
    """Model a snowman, 1.20 m tall."""
    snow = _snow_balls()
    bark = procedural_textures.bark_texture(512, 3, "#3b2a1e", "#6b4c35", "#8f6e52")
    return PropModel(
        "snowman",
        (
            PropPart("snow", snow, plain_finish("snow", "#f3f7fc", 0.85), "snow"),
            PropPart("coal", mesh_difference(_coal_pieces(), snow), plain_finish("coal", "#1b1a1c", 0.7), "granite"),
            PropPart("nose", mesh_difference(_carrot(), snow), plain_finish("carrot", "#ee7416", 0.6), "apple"),
            PropPart("arms", mesh_difference(_arms(), snow), textured_finish("twig bark", bark, 0.9), "hardwood"),
        ),
    )


def _snow_balls() -> PropMesh:
    balls = sdf.sdf_smooth_union(
        sdf.sdf_ellipsoid((0, 0, 0.27), (0.34, 0.34, 0.30)),
        sdf.sdf_sphere((0, 0, 0.70), 0.235),
        sdf.sdf_sphere((0.01, 0, 1.03), 0.165),
        k=0.05,
    )
    lumpy = sdf.sdf_displaced(balls, sdf.periodic_noise_3d(5, 2.4), 0.0075, 0.30)
    grainy = sdf.sdf_displaced(lumpy, sdf.periodic_noise_3d(6, 1.6), 0.0008, 0.05)
    return sdf.mesh_sdf(
        sdf.sdf_smooth_intersection(grainy, sdf.sdf_half_space_above(0.0), 0.02),
        sdf.SdfSampling((-0.38, -0.38, 0), (0.38, 0.38, 1.21), 0.0105, 18000),
    )


def _coal_pieces() -> PropMesh:
    """Two eyes, three buttons, five pieces of a smile."""
    spots = [(0.160, 0.058, 1.080, 0.021), (0.160, -0.058, 1.080, 0.021)]
    spots += [(0.235, 0, 0.79, 0.020), (0.243, 0, 0.70, 0.021), (0.236, 0, 0.61, 0.020)]
    spots += [(0.163 - 0.9 * y * y, y, 0.975 + 3.2 * y * y, 0.0105) for y in np.linspace(-0.06, 0.06, 5)]
    return concatenate_meshes([_coal_lump((x, y, z), r, seed) for seed, (x, y, z, r) in enumerate(spots)])


def _coal_lump(centre: PropPoint, radius: float, seed: int) -> PropMesh:
    """Model one rough piece of coal."""
    c = np.array(centre)
    return sdf.mesh_sdf(
        sdf.sdf_displaced(sdf.sdf_sphere(c, radius), sdf.periodic_noise_3d(seed), 0.12 * radius, 1.6 * radius),
        sdf.SdfSampling(c - 1.4 * radius, c + 1.4 * radius, radius / 6, 260),
    )


def _carrot() -> PropMesh:
    t = np.linspace(0, 1, 9)
    path = np.stack([0.13 + 0.20 * t, 0 * t, 1.03 - 0.02 * t**2], 1)
    return parametric_surfaces.tube_surface(path, 0.026 * (1 - 0.85 * t) * (1 + 0.06 * np.sin(25 * t)), 14)


def _arms() -> PropMesh:
    twigs = []
    for s in (-1, 1):
        twigs += [
            _twig((0.02, s * 0.14, 0.74), (0.08, s * 0.56, 0.97), 0.03, 0.013),
            _twig((0.060, s * 0.43, 0.917), (0.03, s * 0.52, 1.03), 0.01, 0.008),
            _twig((0.067, s * 0.48, 0.94), (0.15, s * 0.57, 0.99), 0.0, 0.007),
        ]
    return mesh_union(twigs)


def _twig(start: PropPoint, end: PropPoint, lift: float, radius: float) -> PropMesh:
    """Bend a twig upwards by ``lift`` [m]; it tapers to half its radius."""
    a, b = np.array(start), np.array(end)
    path = a + TWIG_PATH_FRACTIONS * (b - a) + lift * np.sin(np.pi * TWIG_PATH_FRACTIONS) * [0, 0, 1]
    return parametric_surfaces.tube_surface(path, np.linspace(radius, 0.5 * radius, 7), 8)
