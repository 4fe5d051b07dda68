"""Small bodies that are shells, and what they are made of."""

import numpy as np

from corporeal.core.types import Law
from corporeal.mpm.problem import Body, Problem, Shell
from corporeal.mpm.shells.assemble import vertex_volume

CELL = 0.01
"""Grid spacing [m]."""
PVC = {
    "law": Law.NEO_HOOKEAN,
    "thickness": 2e-3,
    "young_pa": 2e6,
    "poisson": 0.4,
    "yield_stress": np.inf,
    "hardening": 0.0,
    "loss": 0.0,
    "vibration": 300.0,
}
"""Soft PVC, in SI units."""
DENSITY = 1300.0
"""[kg/m³]"""


def sheet_triangles(rows, columns):
    """Triangles of a grid of vertices, row by row, whose diagonals alternate."""
    found = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a, b, c, d = i * columns + j, i * columns + j + 1, (i + 1) * columns + j, (i + 1) * columns + j + 1
            found += [(a, c, b), (b, c, d)] if (i + j) % 2 else [(a, c, d), (a, d, b)]
    return np.array(found)


def strip(length=0.1, width=0.03, spacing=CELL / 2):
    """Vertices and triangles of a flat strip."""
    x, y = np.arange(0, length + 1e-9, spacing), np.arange(0, width + 1e-9, spacing)
    points = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), -1).reshape(-1, 3)
    return points, sheet_triangles(len(x), len(y))


def tube(radius=0.03, length=0.06, spacing=CELL / 2):
    """Vertices and triangles of an open cylinder along z."""
    around = int(np.ceil(2 * np.pi * radius / spacing / 2)) * 2
    z = np.arange(0, length + 1e-9, spacing)
    angle = 2 * np.pi * np.arange(around) / around
    points = np.stack(
        [np.tile(radius * np.cos(angle), len(z)), np.tile(radius * np.sin(angle), len(z)), np.repeat(z, around)], axis=1
    )
    triangles = sheet_triangles(len(z), around + 1)
    return points, triangles // (around + 1) * around + triangles % (around + 1) % around


def shell_body(points, triangle, velocity=(0.0, 0.0, 0.0), **given):
    """One body that is a shell; ``given`` replaces numbers of ``PVC``."""
    one, many = np.ones(len(triangle)), np.ones(len(points))
    numbers = PVC | given
    law = np.full(len(triangle), numbers.pop("law").value)
    values = {name: one * value for name, value in numbers.items()}
    shell = Shell(triangle=triangle, law=law, membrane_young_pa=values["young_pa"], **values)
    return Body(
        name="shell",
        position=points,
        velocity=np.broadcast_to(np.asarray(velocity, float), points.shape).copy(),
        volume=vertex_volume(points, triangle, shell.thickness),
        density=many * DENSITY,
        law=np.full(len(points), Law.NEO_HOOKEAN.value),
        young_pa=many * numbers["young_pa"],
        poisson=many * numbers["poisson"],
        yield_stress=many * np.inf,
        hardening=0 * many,
        friction_angle=0 * many,
        cohesion=0 * many,
        loss=0 * many,
        vibration=many,
        shell=shell,
    )


def free(*bodies, **given):
    """Bodies in free flight, without gravity."""
    count = len(bodies)
    return Problem(
        bodies=bodies,
        cell=CELL,
        friction=np.zeros((count, count)),
        restitution=np.zeros((count, count)),
        **({"planes": (), "gravity": (0.0, 0.0, 0.0)} | given),
    )


def ringing_strip(speed=2.0, **given):
    """A strip in its first free mode of bending, about."""
    points, triangle = strip()
    along = points[:, 0] / points[:, 0].max()
    rise = speed * np.stack([0 * along, 0 * along, np.cos(2 * np.pi * along)], axis=1)
    return shell_body(points, triangle, rise, **given)
