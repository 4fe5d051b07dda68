"""Shells: cases 21 to 28 of the mesh by itself, and 29 on a grid."""

from math import pi, sqrt

import igl
import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve

from corporeal.mpm.engines import build_engine
from corporeal.mpm.physics.time_step_limits import thin_wall_factors
from laws.bodies import problem
from laws.outcome import Check, Outcome, relative
from laws.shell_meshes import Sheet, sheet_body, slit_tube, sphere, strip, tube
from laws.watching import crossing

PVC = 7e6
"""E of soft PVC [Pa]."""
FREE_FREE = 4.73004
"""k L of a free bar's first bending mode."""
ROARK_PATCH = {1.0: 0.337, 1.4: 0.286}
"""Deflection E t² w/(F R √(1 - ν²)) of a spherical shell under a load on a small circle, by its radius
r (12 (1 - ν²))^¼/√(R t) (Reissner 1946; Young and Budynas 2002, Roark's Formulas for Stress and Strain, table 13.3)."""


def free_bar_shape(place: np.ndarray, length: float) -> np.ndarray:
    """Deflection of a free bar's first bending mode at some places along it [m]: 2 at the first end [-]."""
    x = place * FREE_FREE / length
    k = (np.cosh(FREE_FREE) - np.cos(FREE_FREE)) / (np.sinh(FREE_FREE) - np.sin(FREE_FREE))
    return np.cosh(x) + np.cos(x) - k * (np.sinh(x) + np.sin(x))


def free_bar_frequency(sheet: Sheet, length: float) -> float:
    """Angular frequency of the first bending mode of a strip that nothing holds [rad/s]."""
    mass, shape = sheet.mass, free_bar_shape(sheet.position[:, 0], length)
    root = np.repeat(1.0 / np.sqrt(mass), 3)
    square, modes = eigh(root[:, None] * sheet.stiffness().toarray() * root)
    wanted = np.zeros((len(mass), 3))
    wanted[:, 2] = shape * np.sqrt(mass)
    return float(np.sqrt(square[np.argmax(np.abs(wanted.ravel() @ modes))]))


def bending_strip(quick: bool = False) -> Outcome:
    """Case 21: the first bending mode of a free strip, at several meshes."""
    length, width, thick = 0.12, 0.04, 0.002
    checks = []
    for spacing in (0.01,) if quick else (0.01, 0.005):
        sheet = Sheet(*strip(length, width, spacing), thickness=thick, young_pa=PVC)
        theory = (FREE_FREE / length) ** 2 * sqrt(PVC * thick**2 / (12.0 * sheet.density))
        found = free_bar_frequency(sheet, length)
        checks.append(relative(f"period, {length / spacing:.0f} edges long [s]", 2 * pi / found, 2 * pi / theory, 5.0))
    return Outcome(
        "21", "A shell's strip rings in bending", "irregular mesh by itself; Euler and Bernoulli", tuple(checks)
    )


def stretched_strip(quick: bool = False) -> Outcome:
    """Case 22: a strip in uniaxial tension, and its contraction."""
    E, nu, strain = 1e9, 0.35, 1e-4
    sheet = Sheet(*strip(0.12, 0.04, 0.01), thickness=0.001, young_pa=E, poisson=nu)
    x = sheet.position.copy()
    x[:, 0] *= 1.0 + strain
    x[:, 1] *= 1.0 - nu * strain
    force = sheet.forces(x)
    end = sheet.position[:, 0] < 1e-9
    pull = force[end, 0].sum() / (0.04 * 0.001)
    inner = np.abs(force[~end & (sheet.position[:, 0] < 0.12 - 1e-9)]).max() / abs(force[end, 0].sum())
    checks = (
        relative("stress over strain [Pa]", pull / strain, E, 2.0),
        Check("largest force elsewhere, of the pull", 0.0, inner, 100 * inner, 2.0),
    )
    return Outcome("22", "A shell in tension", "irregular mesh by itself, 1e-4 of strain", checks)


def twist_stiffness(sheet: Sheet, length: float) -> float:
    """Torque per twist of a tube whose ends turn as rigid circles and may warp [N m/rad · m]."""
    x, (bottom, top) = sheet.position, (np.abs(sheet.position[:, 2] - z) < 1e-9 for z in (0.0, length))
    turn = np.zeros_like(x)
    turn[top] = np.cross([0.0, 0.0, 1.0], x[top])
    held = np.zeros((len(x), 3), bool)
    held[bottom | top, :2] = True
    held[np.argmax(bottom), 2] = True
    fixed, free = np.flatnonzero(held.ravel()), np.flatnonzero(~held.ravel())
    K, u = sheet.stiffness(), turn.ravel()
    u[free] = spsolve(K[free][:, free].tocsc(), -K[free][:, fixed] @ u[fixed])
    force = (K @ u).reshape(-1, 3)[top]
    return float(np.cross(x[top], force)[:, 2].sum() * length)


def twisted_tubes(quick: bool = False) -> Outcome:
    """Case 23: torsion of a closed and of a slit tube; the control is a wall thickened as E r³ keeps bending."""
    radius, thick, length, E, around = 0.02, 0.001, 0.12, 1e9, 20 if quick else 32
    shear = E / 2.0
    closed, slit = (
        twist_stiffness(Sheet(*mesh(radius, length, around), thickness=thick, young_pa=E), length)
        for mesh in (tube, slit_tube)
    )
    wide = 0.01  # two cells of 5 mm
    factor = thin_wall_factors(thick / wide)[0]
    section, thickened = 2 * pi * radius**3 * shear, 3.0 * (radius / wide) ** 2
    checks = (
        relative("closed: G J [N m²]", closed, section * thick, 5.0, section * wide * factor),
        relative("slit: G J [N m²]", slit, 2 * pi * radius * thick**3 / 3 * shear, 10.0),
        relative("closed over slit", closed / slit, 3 * (radius / thick) ** 2, 10.0, thickened),
    )
    words = f"{around} edges around; control: the wall thickened to 10 mm with its bending stiffness kept"
    return Outcome("23", "Torsion of closed and slit tubes", words, checks)


def buckling_strip(quick: bool = False) -> Outcome:
    """Case 24: the strain at which a strip between hinges buckles (Euler)."""
    length, thick = 0.12, 0.002
    sheet = Sheet(*strip(length, 0.02, 0.01 if quick else 0.006), thickness=thick, young_pa=PVC)
    ends = (sheet.position[:, 0] < 1e-9) | (sheet.position[:, 0] > length - 1e-9)
    free = np.ones((len(ends), 3), bool)
    free[ends, 0] = free[ends, 2] = False
    free[np.argmax(ends), 1] = False
    rows = np.flatnonzero(free.ravel())
    theory = (pi * thick / length) ** 2 / 12.0

    def least(strain: float) -> float:
        x = sheet.position * [1.0 - strain, 1.0, 1.0]
        return float(eigh(sheet.stiffness(x)[rows][:, rows].toarray(), eigvals_only=True, subset_by_index=[0, 0])[0])

    low, high = 0.5 * theory, 1.5 * theory
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if least(middle) > 0.0 else (low, middle)
    checks = (relative("strain at which it buckles", 0.5 * (low + high), theory, 10.0),)
    return Outcome("24", "A strip under compression buckles", "ends on hinges, mesh by itself", checks)


def pinched_sphere(quick: bool = False) -> Outcome:
    """Case 25: a closed spherical shell is pinched on two opposite patches."""
    radius, thick, nu = 0.03, 0.0005, 0.3
    sheet = Sheet(*sphere(radius, 4 if quick else 5), thickness=thick, young_pa=PVC, poisson=nu)
    x, K = sheet.position, sheet.stiffness()
    K = K + 1e-9 * abs(K).max() * sparse.identity(K.shape[0])  # it floats
    checks = []
    for size, theory in ROARK_PATCH.items():
        patch = size * sqrt(radius * thick) / (12.0 * (1.0 - nu**2)) ** 0.25
        load = np.zeros_like(x)
        for sign in (1.0, -1.0):
            load[:, 2] -= sign * _patch_load(sheet, patch, sign)
        moved = spsolve(K.tocsc(), load.ravel()).reshape(-1, 3)
        dent = 0.5 * (moved[np.argmin(x[:, 2]), 2] - moved[np.argmax(x[:, 2]), 2])
        stiffness = PVC * thick**2 / (theory * radius * sqrt(1.0 - nu**2))
        checks.append(relative(f"load per dent, patch {size} [N/m]", 1.0 / dent, stiffness, 5.0))
    edge = float(np.sqrt(sheet.mesh.area.mean() / np.sqrt(0.1875)))
    words = f"R/t = 60, √(R t) = {sqrt(radius * thick) / edge:.1f} edges, mesh by itself; Reissner"
    return Outcome("25", "A pinched spherical shell", words, tuple(checks))


def _patch_load(sheet: Sheet, patch: float, sign: float) -> np.ndarray:
    """Spread a unit load evenly over a cap of a sphere about the z axis; give it on the vertices [N]."""
    radius = float(np.linalg.norm(sheet.position[0]))
    ring = patch * np.sqrt((np.arange(4000) + 0.5) / 4000)
    angle = pi * (3.0 - sqrt(5.0)) * np.arange(4000)
    points = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), sign * np.sqrt(radius**2 - ring**2)])
    _, face, near = igl.point_mesh_squared_distance(points, sheet.position, sheet.triangle)
    corner = sheet.triangle[face]
    share = igl.barycentric_coordinates(near, *(np.ascontiguousarray(sheet.position[corner[:, k]]) for k in range(3)))
    return np.bincount(corner.ravel(), share.ravel() / len(points), len(sheet.position))


def inflated_sphere(quick: bool = False) -> Outcome:
    """Case 26: pressure in a rubber membrane, p = 2 μ t/R (λ⁻¹ - λ⁻⁷) where it is incompressible."""
    radius, thick, E, nu = 0.03, 0.0003, 1e6, 0.49999
    sheet = Sheet(*sphere(radius, 3), thickness=thick, young_pa=E, poisson=nu)
    checks = []
    for stretch in (1.1, 1.4, 2.5):
        x = stretch * sheet.position
        inward = -np.sum(sheet.forces(x) * x, axis=1).sum() / (stretch * radius)
        pressure = inward / (4.0 * pi * (stretch * radius) ** 2)
        theory = 2.0 * E / (2.0 * (1.0 + nu)) * thick / radius * (1.0 / stretch - stretch**-7)
        checks.append(relative(f"pressure at λ = {stretch} [Pa]", pressure, theory, 3.0))
    return Outcome("26", "An inflated rubber membrane", "642 vertices, by itself; neo-Hookean", tuple(checks))


def own_weight(quick: bool = False) -> Outcome:
    """Case 27: a cantilever under its own weight: half of a strip that is held up along its middle."""
    length, thick, pull = 0.12, 0.002, 1e-3
    position, triangle = strip(length, 0.04, 0.01 if quick else 0.006)
    seam = position[:, 0] < 1e-9
    other = np.where(seam, np.arange(len(seam)), len(seam) + np.cumsum(~seam) - 1)
    both = np.concatenate([position, position[~seam] * [-1.0, 1.0, 1.0]])
    sheet = Sheet(both, np.concatenate([triangle, other[triangle[:, ::-1]]]), thickness=thick, young_pa=PVC)
    held = np.abs(both[:, 0]) < 1e-9
    free = np.flatnonzero(~held)
    down = 3 * free + 2
    moved = spsolve(sheet.stiffness()[down][:, down].tocsc(), -pull * sheet.mass[free])
    tip = float(-moved[np.abs(both[free, 0]) > length - 1e-9].mean())
    theory = 12.0 * sheet.density * pull * length**4 / (8.0 * PVC * thick**2)
    words = "irregular mesh by itself, small deflection; Euler and Bernoulli"
    return Outcome("27", "A shell sags as a cantilever", words, (relative("tip [m]", tip, theory, 5.0),))


def pressed_plate(quick: bool = False) -> Outcome:
    """Case 28: a square plate on supports under pressure, w = 0.00406 p a⁴/D with ν = 0.3 (Navier)."""
    side, thick, nu = 0.1, 0.001, 0.3
    sheet = Sheet(*strip(side, side, 0.006 if quick else 0.004), thickness=thick, young_pa=PVC, poisson=nu)
    x = sheet.position
    edge = np.any((x[:, :2] < 1e-9) | (x[:, :2] > side - 1e-9), axis=1)
    free = np.flatnonzero(~edge)
    down, area = 3 * free + 2, sheet.mass / (sheet.density * thick)
    moved = spsolve(sheet.stiffness()[down][:, down].tocsc(), area[free])
    middle = np.argmin(np.linalg.norm(x[free, :2] - side / 2, axis=1))
    stiffness = PVC * thick**3 / (12.0 * (1.0 - nu**2))
    at = x[free[middle]]
    theory = _navier(at[0] / side, at[1] / side) * side**4 / stiffness
    words = f"{17 if quick else 25} edges a side, irregular mesh by itself, next to the middle; Navier's series"
    return Outcome("28", "A pressed plate", words, (relative("deflection [m/Pa]", float(moved[middle]), theory, 5.0),))


def _navier(x: float, y: float) -> float:
    """Deflection w D/(p a⁴) of a square plate on supports at (x, y), from one corner, over its side [-]."""
    odd = np.arange(1, 60, 2)
    m, n = np.meshgrid(odd, odd)
    return float(np.sum(16.0 * np.sin(m * pi * x) * np.sin(n * pi * y) / (pi**6 * m * n * (m**2 + n**2) ** 2)))


def strip_on_grid(walls: tuple[float, ...], cells: int = 12) -> list[float]:
    """Period over theory's of a free strip's first mode on a grid, for some walls [cells]; ``cells`` along it."""
    length = 0.12
    cell, found = length / cells, []
    position, triangle = strip(length, length / 3, cell / 2)
    for wall in walls:
        sheet = Sheet(position, triangle, thickness=wall * cell, young_pa=PVC)
        shape = free_bar_shape(position[:, 0], length)
        velocity = np.zeros_like(position)
        velocity[:, 2] = 0.02 * shape
        posed = problem(sheet_body(sheet, velocity, (0.0, 0.0, 1.0)), cell=cell)
        engine = build_engine(posed, "cpu", threads=1)
        theory = 2 * pi / ((FREE_FREE / length) ** 2 * sqrt(PVC / (12.0 * sheet.density)) * sheet.thickness)
        times = np.linspace(0.0, 1.7 * theory, 300)[1:]
        moved = []
        for time in times.tolist():
            engine.advance(time)
            moved.append(float(sheet.mass * shape @ (engine.snapshot().position[:, 2] - 1.0)))
        found.append(float(np.diff(crossing(times, np.array(moved)))[0]) / theory)
    return found


def shells_on_grid(quick: bool = False) -> Outcome:
    """Case 29: the first bending mode of a free strip on a grid, by its wall over a cell."""
    walls = (0.1, 0.5) if quick else (0.05, 0.1, 0.2, 0.5)
    ratios = strip_on_grid(walls)
    checks = [relative(f"period over theory, t = {w} dx", r, 1.0, 5.0) for w, r in zip(walls, ratios, strict=True)]
    words = "12 cells along it, the CPU engine; the control of thin walls is case 23"
    return Outcome("29", "A strip of a shell on a grid", words, tuple(checks))
