"""Forces of a shell on its vertices, and the history of its triangles."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.mpm.constants import TINY_DOUBLE
from corporeal.mpm.physics.maxwell_branches import branch_decay
from corporeal.mpm.shells.mesh import ShellMesh, dihedral_angle
from corporeal.mpm.shells.stress import (
    ShellMaterial,
    Sym,
    contract,
    membrane_flow,
    membrane_response,
    moment_return,
    plane_stress,
)


@dataclass(frozen=True)
class ShellState:
    """History of T triangles."""

    inverse_rest: Float[np.ndarray, "T 2 2"]
    """B [1/m] of the stress-free triangle: F = D_s B is elastic."""
    plastic_strain: Float[np.ndarray, " T"]
    """Equivalent, of the membrane [-]."""
    plastic_curvature: Sym
    """[1/m]"""
    green: Sym
    """Green's strain of the mesh at rest, plastic part included, at the last step [-]."""
    bend: Sym
    """The same of curvature [1/m]."""
    branch_strain: Float[np.ndarray, "T 2 3"]
    """Strain of either Maxwell branch [-]."""
    branch_bend: Float[np.ndarray, "T 2 3"]
    """Curvature of either Maxwell branch [1/m]."""

    @classmethod
    def start(cls, mesh: ShellMesh) -> "ShellState":
        """Nothing has yielded, and nothing moved."""
        count = len(mesh.triangle)
        none, branches = np.zeros((count, 3)), np.zeros((count, 2, 3))
        return cls(mesh.inverse_rest, np.zeros(count), none, none, none, branches, branches)


@dataclass(frozen=True)
class ShellStep:
    """What a shell does in one step."""

    force: Float[np.ndarray, "V 3"]
    """On its vertices [N]."""
    state: ShellState
    plastic_loss: float
    """[J]"""
    branch_work: float
    """Work done on Maxwell branches since the last step [J]."""


@dataclass(frozen=True)
class ShellEnergy:
    """What triangles hold [J]."""

    elastic: Float[np.ndarray, " T"]
    relaxing: Float[np.ndarray, " T"]
    """In Maxwell branches."""


def deformation(
    mesh: ShellMesh, inverse_rest: Float[np.ndarray, "T 2 2"], x: Float[np.ndarray, "V 3"]
) -> Float[np.ndarray, "T 3 2"]:
    """F = D_s B of every triangle [-]."""
    corner = x[mesh.triangle]
    return np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2) @ inverse_rest


def vertex_deformation(
    mesh: ShellMesh, rest: Float[np.ndarray, "V 3"], x: Float[np.ndarray, "V 3"]
) -> Float[np.ndarray, "V 3 3"]:
    """Deformation gradient of the wall at each vertex [-]: area-weighted mean of its triangles'; 1 elsewhere.

    A triangle's takes its edges to where they are now, and its unit normal to the present one.
    """
    frames = []
    for place in (rest, x):
        corner = place[mesh.triangle]
        u, v = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        n = np.cross(u, v)
        frames.append(np.stack([u, v, n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), TINY_DOUBLE)], axis=2))
    F = frames[1] @ np.linalg.inv(frames[0])
    total, weight = np.zeros((len(x), 3, 3)), np.zeros(len(x))
    np.add.at(total, mesh.triangle, (mesh.area[:, None, None] * F)[:, None])
    np.add.at(weight, mesh.triangle, mesh.area[:, None])
    is_vertex = (weight > 0.0)[:, None, None]
    return np.where(is_vertex, total / np.maximum(weight, TINY_DOUBLE)[:, None, None], np.eye(3))


def metric(F: Float[np.ndarray, "T 3 2"]) -> Sym:
    """C = FᵀF."""
    u, v = F[:, :, 0], F[:, :, 1]
    return np.stack([(u * u).sum(axis=1), (v * v).sum(axis=1), (u * v).sum(axis=1)], axis=1)


def curvature(mesh: ShellMesh, angle: Float[np.ndarray, " H"]) -> Sym:
    """Curvature of every triangle from all dihedral angles, less that at rest [1/m]."""
    change = angle - mesh.rest_angle
    change = (change + np.pi) % (2.0 * np.pi) - np.pi
    out = np.zeros((len(mesh.triangle), 3))
    for s in (0, 1):
        np.add.at(out, mesh.hinge_triangle[:, s], mesh.curvature_of_angle[:, s] * change[:, None])
    return out


def shell_step(
    mesh: ShellMesh, material: ShellMaterial, state: ShellState, x: Float[np.ndarray, "V 3"], dt: float
) -> ShellStep:
    """Let triangles yield and relax where their vertices are now, and return the forces.

    f = -∂W/∂x with W = Σ A (t ψ(C) + ½ D κ : ((1-ν) κ + ν tr κ 1)), and what the Maxwell branches add.

    Args:
        mesh: At rest.
        material: Of its triangles.
        state: Their history.
        x: Vertices now [m].
        dt: Of the step [s].
    """
    state, plastic_loss = yielded(mesh, material, state, x)
    state, work = relaxed(mesh, material, state, x, dt)
    return ShellStep(shell_forces(mesh, material, state, x), state, plastic_loss, work)


def shell_forces(
    mesh: ShellMesh, material: ShellMaterial, state: ShellState, x: Float[np.ndarray, "V 3"]
) -> Float[np.ndarray, "V 3"]:
    """Return the forces on the vertices [N], at the present history."""
    pull = np.zeros((len(mesh.triangle), 3, 2))
    strain = np.einsum("tb,tbi->ti", material.branch_strength, state.branch_strain)
    relaxing = material.membrane_stiffness[:, None] * plane_stress(material.poisson, strain)
    elastic = membrane_response(material, metric(deformation(mesh, state.inverse_rest, x))).stress
    for S, rest in ((elastic, state.inverse_rest), (relaxing, mesh.inverse_rest)):
        pull -= deformation(mesh, rest, x) @ S[:, [0, 2, 2, 1]].reshape(-1, 2, 2) @ np.swapaxes(rest, 1, 2)
    pull *= (mesh.area * material.thickness)[:, None, None]
    force = np.zeros_like(x)
    np.add.at(force, mesh.triangle[:, 1], pull[:, :, 0])
    np.add.at(force, mesh.triangle[:, 2], pull[:, :, 1])
    np.add.at(force, mesh.triangle[:, 0], -pull.sum(axis=2))
    bend = elastic_bend(mesh, state, x) + np.einsum("tb,tbi->ti", material.branch_strength, state.branch_bend)
    moment = material.bending_stiffness[:, None] * plane_stress(material.poisson, bend)
    np.add.at(force, mesh.hinge, -hinge_moment(mesh, moment)[:, None, None] * angle_gradient(x[mesh.hinge]))
    return force


def elastic_bend(mesh: ShellMesh, state: ShellState, x: Float[np.ndarray, "V 3"]) -> Sym:
    """Elastic curvature κ - κ_p [1/m]."""
    return curvature(mesh, dihedral_angle(x[mesh.hinge])) - state.plastic_curvature


def shell_energy(
    mesh: ShellMesh, material: ShellMaterial, state: ShellState, x: Float[np.ndarray, "V 3"]
) -> ShellEnergy:
    """Return what triangles hold, with their vertices at x [m]."""
    weight, bend = mesh.area * material.thickness, elastic_bend(mesh, state, x)
    half_bending = 0.5 * mesh.area * material.bending_stiffness
    elastic = weight * membrane_response(material, metric(deformation(mesh, state.inverse_rest, x))).energy
    elastic = elastic + half_bending * contract(plane_stress(material.poisson, bend), bend)
    relaxing = np.zeros(len(weight))
    for b in range(material.branch_strength.shape[1]):
        strain, turned, share = state.branch_strain[:, b], state.branch_bend[:, b], material.branch_strength[:, b]
        held = 0.5 * weight * material.membrane_stiffness * contract(plane_stress(material.poisson, strain), strain)
        relaxing += share * (held + half_bending * contract(plane_stress(material.poisson, turned), turned))
    return ShellEnergy(elastic, relaxing)


def relaxed(
    mesh: ShellMesh, material: ShellMaterial, state: ShellState, x: Float[np.ndarray, "V 3"], dt: float
) -> tuple[ShellState, float]:
    """Strain and relax the Maxwell branches; give the work done on them [J].

    e ← k e + f Δε with k and f as in ``maxwell_branches``; the work is that of the mean of old and new stress.
    """
    green = 0.5 * (metric(deformation(mesh, mesh.inverse_rest, x)) - np.array([1.0, 1.0, 0.0]))
    bend = curvature(mesh, dihedral_angle(x[mesh.hinge]))
    if not material.branch_strength.any():
        return replace(state, green=green, bend=bend), 0.0
    kept, fresh = branch_decay(dt, material.branch_time)
    grown = (green - state.green)[:, None], (bend - state.bend)[:, None]
    new = [
        kept[:, :, None] * old + fresh[:, :, None] * step
        for old, step in zip((state.branch_strain, state.branch_bend), grown, strict=True)
    ]
    scale = (mesh.area * material.thickness * material.membrane_stiffness, mesh.area * material.bending_stiffness)
    work = 0.0
    for b in range(material.branch_strength.shape[1]):
        for old, after, step, stiffness in zip(
            (state.branch_strain, state.branch_bend), new, grown, scale, strict=True
        ):
            mean = plane_stress(material.poisson, 0.5 * (old[:, b] + after[:, b]))
            work += float(np.sum(material.branch_strength[:, b] * stiffness * contract(mean, step[:, 0])))
    return replace(state, green=green, bend=bend, branch_strain=new[0], branch_bend=new[1]), work


def hinge_moment(mesh: ShellMesh, moment: Sym) -> Float[np.ndarray, " H"]:
    """∂W/∂θ of every hinge [N m]: the moments of both triangles by what the angle curves them."""
    total = np.zeros(len(mesh.hinge))
    for s in (0, 1):
        t = mesh.hinge_triangle[:, s]
        total += mesh.area[t] * contract(moment[t], mesh.curvature_of_angle[:, s])
    return total


def angle_gradient(corner: Float[np.ndarray, "H 4 3"]) -> Float[np.ndarray, "H 4 3"]:
    """∂θ/∂x of the four vertices of each hinge [rad/m]: a couple without force or torque (Bridson et al. 2003)."""
    a, b, o, q = (corner[:, k] for k in range(4))
    edge = b - a
    first, second = np.cross(edge, o - a), np.cross(q - a, edge)
    length2 = np.sum(edge * edge, axis=1, keepdims=True)
    length = np.sqrt(length2)
    up_o = first * length / np.maximum(np.sum(first * first, axis=1, keepdims=True), TINY_DOUBLE)
    up_q = second * length / np.maximum(np.sum(second * second, axis=1, keepdims=True), TINY_DOUBLE)
    foot_o = np.sum((o - a) * edge, axis=1, keepdims=True) / length2
    foot_q = np.sum((q - a) * edge, axis=1, keepdims=True) / length2
    on_a = -(1.0 - foot_o) * up_o - (1.0 - foot_q) * up_q
    on_b = -foot_o * up_o - foot_q * up_q
    return np.stack([on_a, on_b, up_o, up_q], axis=1)


def yielded(
    mesh: ShellMesh, material: ShellMaterial, state: ShellState, x: Float[np.ndarray, "V 3"]
) -> tuple[ShellState, float]:
    """Let triangles yield where their vertices are now; give the plastic work [J].

    Membrane and bending yield by themselves: the one at σ_y, the other at the moment of the plastic hinge.
    """
    flow = membrane_flow(material, metric(deformation(mesh, state.inverse_rest, x)), state.plastic_strain)
    bend = elastic_bend(mesh, state, x)
    moment = material.bending_stiffness[:, None] * plane_stress(material.poisson, bend)
    factor = moment_return(material, moment)[:, None]
    after = replace(
        state,
        inverse_rest=state.inverse_rest @ flow.rest_factor,
        plastic_strain=state.plastic_strain + flow.plastic_strain,
        plastic_curvature=state.plastic_curvature + (1.0 - factor) * bend,
    )
    bending_loss = mesh.area * contract(factor * moment, (1.0 - factor) * bend)
    return after, float(np.sum(mesh.area * material.thickness * flow.loss + bending_loss))
