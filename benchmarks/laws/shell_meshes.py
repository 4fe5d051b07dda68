"""Meshes of shells for the validation, and the linear stiffness of a mesh by itself."""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import trimesh
from jaxtyping import Float, Int
from scipy import sparse
from scipy.spatial import Delaunay

from corporeal.core.types import Law
from corporeal.mpm.problem import Body, Shell
from corporeal.mpm.shells.assemble import shell_material, vertex_volume
from corporeal.mpm.shells.forces import ShellState, shell_forces
from corporeal.mpm.shells.mesh import ShellMesh, shell_mesh
from corporeal.mpm.shells.stress import ShellMaterial

RELAXATIONS = 60
"""Iterations that even out a random mesh."""


@dataclass(frozen=True)
class Sheet:
    """A shell at rest, and what it is made of."""

    position: Float[np.ndarray, "V 3"]
    triangle: Int[np.ndarray, "T 3"]
    thickness: float
    young_pa: float
    poisson: float = 0.0
    density: float = 1220.0
    law: Law = Law.NEO_HOOKEAN
    yield_stress: float = np.inf
    loss: float = 0.0
    vibration: float = 1.0
    mesh: ShellMesh = field(init=False)
    material: ShellMaterial = field(init=False)

    def __post_init__(self) -> None:
        """Measure the mesh."""
        object.__setattr__(self, "mesh", shell_mesh(self.position, self.triangle, self.poisson))
        object.__setattr__(self, "material", shell_material(self.shell))

    @property
    def shell(self) -> Shell:
        """As a body has it."""
        ones = np.ones(len(self.triangle))
        return Shell(
            triangle=self.triangle,
            thickness=self.thickness * ones,
            law=np.full(len(ones), self.law.value),
            young_pa=self.young_pa * ones,
            membrane_young_pa=self.young_pa * ones,
            poisson=self.poisson * ones,
            yield_stress=self.yield_stress * ones,
            hardening=0.0 * ones,
            loss=self.loss * ones,
            vibration=self.vibration * ones,
        )

    @property
    def mass(self) -> Float[np.ndarray, " V"]:
        """Of each vertex [kg]."""
        volume = vertex_volume(self.position, self.triangle, np.full(len(self.triangle), self.thickness))
        return self.density * volume

    def forces(self, position: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "V 3"]:
        """Elastic forces with the vertices elsewhere [N]."""
        return shell_forces(self.mesh, self.material, ShellState.start(self.mesh), position)

    def stiffness(self, position: Float[np.ndarray, "V 3"] | None = None) -> sparse.csc_matrix:
        """-∂f/∂x by central differences [N/m]; vertices that do not share a force are moved together."""
        at = self.position if position is None else position
        near = _force_stencil(self.mesh, len(at))
        colour, step = _colours(near), 1e-5 * float(np.sqrt(self.mesh.area.mean()))
        rows, columns, values = [], [], []
        for c in range(max(colour) + 1):
            moved = [v for v, found in enumerate(colour) if found == c]
            owner = {j: v for v in moved for j in near[v]}
            seen, of = np.array(list(owner)), np.array(list(owner.values()))
            for d in range(3):
                shift = np.zeros_like(at)
                shift[moved, d] = step
                slope = (self.forces(at - shift) - self.forces(at + shift)) / (2.0 * step)
                for e in range(3):
                    rows.append(3 * seen + e)
                    columns.append(3 * of + d)
                    values.append(slope[seen, e])
        size = 3 * len(at)
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return sparse.csc_matrix(entries, shape=(size, size))


def sheet_body(sheet: Sheet, velocity: Float[np.ndarray, "V 3"], at: tuple[float, float, float]) -> Body:
    """Return a body that is nothing but the shell, moved to ``at`` [m]."""
    none = np.zeros(len(sheet.position))
    return Body(
        name="sheet",
        position=sheet.position + np.array(at),
        velocity=velocity,
        volume=sheet.mass / sheet.density,
        density=none + sheet.density,
        law=np.full(len(none), Law.COROTATED.value),
        young_pa=none + sheet.young_pa,
        poisson=none + sheet.poisson,
        yield_stress=none,
        hardening=none,
        friction_angle=none,
        cohesion=none,
        loss=none,
        vibration=none,
        shell=sheet.shell,
    )


def _force_stencil(mesh: ShellMesh, count: int) -> list[set[int]]:
    """Vertices on which the place of each has a force: those of its triangles and of their neighbours."""
    patch = [set(corners) for corners in mesh.triangle.tolist()]
    for corners, pair in zip(mesh.hinge.tolist(), mesh.hinge_triangle.tolist(), strict=True):
        for t in pair:
            patch[t].update(corners)
    near: list[set[int]] = [set() for _ in range(count)]
    for together in patch:
        for v in together:
            near[v] |= together
    return near


def _colours(near: list[set[int]]) -> list[int]:
    colour: list[int] = []
    touched: dict[int, set[int]] = defaultdict(set)
    for around in near:
        taken = set().union(*(touched[j] for j in around))
        colour.append(next(c for c in range(len(near)) if c not in taken))
        for j in around:
            touched[j].add(colour[-1])
    return colour


def strip(length: float, width: float, spacing: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Mesh a rectangle from (0, 0, 0) to (length, width, 0) irregularly, with edges of about the spacing [m]."""
    random = np.random.default_rng(seed)
    across, along = max(round(width / spacing), 1), max(round(length / spacing), 1)
    sides = [(length * i / along, y) for i in range(along + 1) for y in (0.0, width)]
    sides += [(x, width * j / across) for j in range(1, across) for x in (0.0, length)]
    count = max(int(length * width / (spacing**2 * np.sqrt(0.75))) - len(sides) // 2, 1)
    inner = random.uniform(0, 1, (count, 2)) * [length - spacing, width - spacing] + spacing / 2
    for _ in range(RELAXATIONS):
        inner = _centred(np.array(sides), inner)
    points = np.concatenate([np.array(sides), inner])
    triangle = Delaunay(points, qhull_options="QJ Pp").simplices
    double = _double_area(points, triangle)
    triangle = triangle[np.abs(double) > 1e-3 * np.median(np.abs(double))]
    turned = _double_area(points, triangle) < 0
    triangle[turned] = triangle[turned][:, ::-1]
    return np.column_stack([points, np.zeros(len(points))]), triangle.astype(np.int64)


def _centred(sides: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Put every inner point into the middle of its triangles."""
    points = np.concatenate([sides, inner])
    triangle = Delaunay(points).simplices
    middle, area = points[triangle].mean(axis=1), np.abs(_double_area(points, triangle))
    total, weight = np.zeros_like(points), np.zeros(len(points))
    np.add.at(total, triangle, (area[:, None] * middle)[:, None])
    np.add.at(weight, triangle, area[:, None])
    return (total / weight[:, None])[len(sides) :]


def _double_area(points: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    u, v = (points[triangle[:, k]] - points[triangle[:, 0]] for k in (1, 2))
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def sphere(radius: float, subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Mesh a sphere about the origin: an icosahedron, subdivided."""
    ball = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(ball.vertices), np.array(ball.faces, np.int64)


def tube(radius: float, length: float, around: int) -> tuple[np.ndarray, np.ndarray]:
    """Mesh a tube about the z axis by nearly equilateral triangles."""
    pitch = 2.0 * np.pi / around
    rows = max(round(length / (radius * pitch * np.sqrt(0.75))), 2)
    angle = pitch * (np.arange(around)[None] + 0.5 * (np.arange(rows + 1) % 2)[:, None])
    height = np.repeat(length * np.arange(rows + 1) / rows, around)
    points = np.column_stack([radius * np.cos(angle).ravel(), radius * np.sin(angle).ravel(), height])
    triangle = []
    for j in range(rows):
        for i in range(around):
            k = (i + 1) % around
            a, b, c, d = around * j + i, around * j + k, around * (j + 1) + k, around * (j + 1) + i
            triangle += [(a, b, c), (a, c, d)] if j % 2 else [(a, b, d), (b, c, d)]
    return points, np.array(triangle, np.int64)


def slit_tube(radius: float, length: float, around: int) -> tuple[np.ndarray, np.ndarray]:
    """Mesh a tube about the z axis that is slit all along: a rolled strip, meshed irregularly."""
    flat, triangle = strip(2.0 * np.pi * radius, length, 2.0 * np.pi * radius / around)
    angle = flat[:, 0] / radius
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), flat[:, 1]]), triangle
