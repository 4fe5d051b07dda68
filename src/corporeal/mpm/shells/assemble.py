"""The shells of a problem as one mesh, over the particles of all bodies."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.errors import SimulationError
from corporeal.core.types import Law
from corporeal.mpm.constants import BRANCHES, MIN_LOSS_FACTOR, MIN_TRIANGLE_QUALITY
from corporeal.mpm.laws import GRANULAR_LAWS, LIQUID_LAWS
from corporeal.mpm.physics.maxwell_branches import fit_branches
from corporeal.mpm.problem import Body, Problem, Shell
from corporeal.mpm.shells.mesh import ShellMesh, join_meshes, shell_mesh
from corporeal.mpm.shells.stress import ShellMaterial


@dataclass(frozen=True)
class Shells:
    """All triangles of a problem; their vertices are numbers among all its particles."""

    mesh: ShellMesh
    material: ShellMaterial
    body: Int[np.ndarray, " T"]
    """Body of each triangle."""
    density: Float[np.ndarray, " T"]
    """[kg/m³]"""
    is_vertex: Bool[np.ndarray, " P"]
    """Which particles are vertices."""

    @classmethod
    def of(cls, problem: Problem) -> "Shells":
        """Gather the shells of all bodies.

        Raises:
            SimulationError: A shell has no thickness, a degenerate triangle, or a law that shells cannot follow.
        """
        meshes, materials, body, density, first = [], [], [], [], 0
        vertex = np.zeros(sum(len(b.position) for b in problem.bodies), bool)
        for b, one in enumerate(problem.bodies):
            if one.shell is not None and not one.rigid:
                check_shell(one)
                mesh = shell_mesh(one.position, one.shell.triangle, float(np.mean(one.shell.poisson)))
                meshes.append(replace(mesh, triangle=mesh.triangle + first, hinge=mesh.hinge + first))
                materials.append(shell_material(one.shell))
                body.append(np.full(len(mesh.triangle), b))
                density.append(one.density[one.shell.triangle[:, 0]])
                vertex[mesh.triangle.ravel() + first] = True
            first += len(one.position)
        if not meshes:
            return cls(join_meshes([]), _join_materials([]), np.zeros(0, np.int64), np.zeros(0), vertex)
        joined = np.concatenate(body), np.concatenate(density), vertex
        return cls(join_meshes(meshes), _join_materials(materials), *joined)

    def __bool__(self) -> bool:
        """Whether there are any."""
        return len(self.body) > 0

    @cached_property
    def wave_speed(self) -> Float[np.ndarray, " T"]:
        """Speed of waves in the plane, of what is resisted at once [m/s]: √(E (1 + Σg)/(ρ (1 - ν²)))."""
        stiffer = 1.0 + self.material.branch_strength.sum(axis=1)
        return np.sqrt(self.material.membrane_stiffness * stiffer / self.density)


def longest_shell_step(shells: Shells, courant: float, cell: float, speed: float) -> float:
    """Largest stable step [s] of waves in the plane and of bending: dt = s dx/(c + |v|) in the plane.

    Args:
        shells: All.
        courant: s [-].
        cell: dx [m].
        speed: Largest |v| of their vertices [m/s].
    """
    if not shells:
        return np.inf
    in_plane = courant * cell / (shells.wave_speed.max() + speed)
    return float(min(in_plane, longest_bending_step(shells, courant, cell)))


def longest_bending_step(shells: Shells, courant: float, cell: float) -> float:
    """Largest stable step [s] of bending.

    What the grid sees of it has wave numbers up to π/dx, so that ω = (π/dx)² √(D/(ρ t)), and dt = 2 s/ω.
    """
    m = shells.material
    stiffer = 1.0 + m.branch_strength.sum(axis=1)
    rate = (np.pi / cell) ** 2 * np.sqrt(m.bending_stiffness * stiffer / (shells.density * m.thickness))
    return float(2.0 * courant / rate.max())


def check_shell(body: Body) -> None:
    """Reject what cannot be simulated.

    Raises:
        SimulationError: It says what and why.
    """
    shell = body.shell
    if shell is None:
        return
    if not np.all(np.isfinite(shell.thickness) & (shell.thickness > 0.0)):
        raise SimulationError(f"A wall of {body.name!r} has no thickness. Give one above 0 m.")
    corner = body.position[shell.triangle]
    edge = corner - np.roll(corner, 1, axis=1)
    area = 0.5 * np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    longest = (edge**2).sum(axis=2).max(axis=1)
    if not np.all(area > MIN_TRIANGLE_QUALITY * longest):
        raise SimulationError(f"The shell of {body.name!r} has degenerate triangles. Remesh its middle surface.")
    loose = np.isin(shell.law, [*GRANULAR_LAWS, *LIQUID_LAWS])
    if loose.any():
        law = Law(int(shell.law[loose][0])).name.lower()
        raise SimulationError(f"The shell of {body.name!r} has the law {law}, which no thin wall follows.")


def shell_material(shell: Shell) -> ShellMaterial:
    """Return what its triangles are made of, with the Maxwell branches of their loss factor."""
    strength = np.zeros((len(shell.triangle), BRANCHES))
    time = np.ones_like(strength)
    for loss in np.unique(shell.loss[shell.loss >= MIN_LOSS_FACTOR]).tolist():
        mine, share = shell.loss == loss, fit_branches(loss)
        strength[mine] = share.strength
        time[mine] = np.array(share.time) / (shell.vibration[mine, None] * sqrt(share.stiffening))
    return ShellMaterial(
        law=np.asarray(shell.law, np.int64),
        thickness=np.asarray(shell.thickness, float),
        young_pa=np.asarray(shell.young_pa, float),
        membrane_young_pa=np.asarray(shell.membrane_young_pa, float),
        poisson=np.asarray(shell.poisson, float),
        yield_stress=np.asarray(shell.yield_stress, float),
        hardening=np.asarray(shell.hardening, float),
        branch_strength=strength,
        branch_time=time,
    )


def _join_materials(parts: list[ShellMaterial]) -> ShellMaterial:
    none = np.zeros(0)
    pair = np.zeros((0, BRANCHES))
    parts = parts or [ShellMaterial(np.zeros(0, np.int64), none, none, none, none, none, none, pair, pair)]
    return ShellMaterial(*(np.concatenate(rows) for rows in zip(*(vars(p).values() for p in parts), strict=True)))


def vertex_half_wall(
    triangle: Int[np.ndarray, "T 3"], thickness: Float[np.ndarray, " T"], count: int
) -> Float[np.ndarray, " P"]:
    """Half the thickness of the wall at each of ``count`` particles [m]; 0 where one is no vertex."""
    out = np.zeros(count)
    np.maximum.at(out, triangle.ravel(), np.repeat(0.5 * thickness, 3))
    return out


def vertex_volume(
    position: Float[np.ndarray, "V 3"], triangle: Int[np.ndarray, "T 3"], thickness: Float[np.ndarray, " T"]
) -> Float[np.ndarray, " V"]:
    """Volume of wall that each vertex stands for [m³]: a third of its triangles'."""
    corner = position[triangle]
    area = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return np.bincount(triangle.ravel(), np.repeat(area * thickness / 3.0, 3), len(position))
