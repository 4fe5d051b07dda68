"""A snowman: three rolled balls of snow with coal, a carrot and twigs."""

import numpy as np

from corporeal.showcase import paint, sdf, shape
from corporeal.showcase.mesh import Mesh, Model, Part, Point, cut, pictured, plain, together, union

TWIG_SHARE = np.linspace(0, 1, 7)[:, None]


def snowman() -> Model:
    """Model a snowman, 1.20 m tall."""
    snow = _balls()
    bark = paint.bark(512, 3, "#3b2a1e", "#6b4c35", "#8f6e52")
    return Model(
        "snowman",
        (
            Part("snow", snow, plain("snow", "#f3f7fc", 0.85), "snow"),
            Part("coal", cut(_coal(), snow), plain("coal", "#1b1a1c", 0.7), "granite"),
            Part("nose", cut(_carrot(), snow), plain("carrot", "#ee7416", 0.6), "apple"),
            Part("arms", cut(_arms(), snow), pictured("twig bark", bark, 0.9), "hardwood"),
        ),
    )


def _balls() -> Mesh:
    balls = sdf.join(
        sdf.ellipsoid((0, 0, 0.27), (0.34, 0.34, 0.30)),
        sdf.sphere((0, 0, 0.70), 0.235),
        sdf.sphere((0.01, 0, 1.03), 0.165),
        k=0.05,
    )
    lumpy = sdf.rough(balls, sdf.noise3(5, 2.4), 0.0075, 0.30)
    grainy = sdf.rough(lumpy, sdf.noise3(6, 1.6), 0.0008, 0.05)
    return sdf.mesh(
        sdf.both(grainy, sdf.above(0.0), 0.02),
        sdf.Sampling((-0.38, -0.38, 0), (0.38, 0.38, 1.21), 0.0105, 18000),
    )


def _coal() -> Mesh:
    """Two eyes, three buttons, five pieces of a smile."""
    spots = [(0.160, 0.058, 1.080, 0.021), (0.160, -0.058, 1.080, 0.021)]
    spots += [(0.235, 0, 0.79, 0.020), (0.243, 0, 0.70, 0.021), (0.236, 0, 0.61, 0.020)]
    spots += [
        (0.163 - 0.9 * y * y, y, 0.975 + 3.2 * y * y, 0.0105) for y in np.linspace(-0.06, 0.06, 5)
    ]
    return together([_lump((x, y, z), r, seed) for seed, (x, y, z, r) in enumerate(spots)])


def _lump(centre: Point, radius: float, seed: int) -> Mesh:
    """Model one rough piece of coal."""
    c = np.array(centre)
    return sdf.mesh(
        sdf.rough(sdf.sphere(c, radius), sdf.noise3(seed), 0.12 * radius, 1.6 * radius),
        sdf.Sampling(c - 1.4 * radius, c + 1.4 * radius, radius / 6, 260),
    )


def _carrot() -> Mesh:
    t = np.linspace(0, 1, 9)
    path = np.stack([0.13 + 0.20 * t, 0 * t, 1.03 - 0.02 * t**2], 1)
    return shape.tube(path, 0.026 * (1 - 0.85 * t) * (1 + 0.06 * np.sin(25 * t)), 14)


def _arms() -> Mesh:
    twigs = []
    for s in (-1, 1):
        twigs += [
            _twig((0.02, s * 0.14, 0.74), (0.08, s * 0.56, 0.97), 0.03, 0.013),
            _twig((0.060, s * 0.43, 0.917), (0.03, s * 0.52, 1.03), 0.01, 0.008),
            _twig((0.067, s * 0.48, 0.94), (0.15, s * 0.57, 0.99), 0.0, 0.007),
        ]
    return union(twigs)


def _twig(start: Point, end: Point, lift: float, radius: float) -> Mesh:
    """Bend a twig upwards by ``lift`` [m]; it tapers to half its radius."""
    a, b = np.array(start), np.array(end)
    path = a + TWIG_SHARE * (b - a) + lift * np.sin(np.pi * TWIG_SHARE) * [0, 0, 1]
    return shape.tube(path, np.linspace(radius, 0.5 * radius, 7), 8)
