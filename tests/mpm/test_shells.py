"""Shells by themselves: forces, yield, relaxation, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from laws.shell_meshes import Sheet, sheet_body, sphere, strip

from corporeal.core.errors import SimulationError
from corporeal.core.types import Law
from corporeal.mpm.engines import ENGINES
from corporeal.mpm.physics.maxwell_branches import complex_modulus
from corporeal.mpm.problem import Problem
from corporeal.mpm.reference.engine import ReferenceEngine
from corporeal.mpm.shells.forces import ShellState, shell_energy, shell_forces, shell_step
from corporeal.mpm.shells.mesh import shell_mesh

ELASTIC_LAWS = [Law.NEO_HOOKEAN, Law.COROTATED, Law.VON_MISES]


def shaken(position: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
    return position + np.random.default_rng(seed).normal(0.0, size, position.shape)


def dome(law: Law = Law.NEO_HOOKEAN, **more) -> Sheet:
    position, triangle = strip(0.05, 0.04, 0.012)
    position[:, 2] = 2.0 * position[:, 0] * (0.05 - position[:, 0])
    return Sheet(position, triangle, 0.002, 1e7, 0.3, law=law, **more)


def free_flight(sheet: Sheet, cell: float = 0.01) -> Problem:
    velocity = np.zeros_like(sheet.position)
    velocity[:, 2] = np.cos(np.pi * sheet.position[:, 0] / 0.05) * (1.0 + 10.0 * sheet.position[:, 1])
    none = np.zeros((2, 2))
    return Problem((sheet_body(sheet, velocity, (0.0, 0.0, 1.0)),), cell, none, none, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("law", ELASTIC_LAWS)
def test_forces_are_the_slope_of_the_energy(law):
    sheet = dome(law)
    state = ShellState.start(sheet.mesh)
    x, way = shaken(sheet.position, 8e-4), shaken(np.zeros_like(sheet.position), 1.0, 3)
    step = 1e-8
    low, high = (shell_energy(sheet.mesh, sheet.material, state, x + s * step * way).elastic.sum() for s in (-1.0, 1.0))
    force = shell_forces(sheet.mesh, sheet.material, state, x)
    assert -(high - low) / (2 * step) == pytest.approx(float(np.sum(force * way)), rel=1e-6)


def test_forces_have_no_sum_and_no_moment():
    sheet = dome()
    x = shaken(sheet.position, 8e-4)
    force = sheet.forces(x)
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * scale


def test_a_rigid_motion_costs_nothing():
    sheet = dome()
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = sheet.position @ turn.T + [0.3, -0.2, 0.1]
    scale = np.abs(sheet.forces(shaken(sheet.position, 1e-4))).max()
    assert np.abs(sheet.forces(moved)).max() < 1e-9 * scale


def test_which_way_triangles_wind_does_not_matter():
    sheet = dome()
    turned = sheet.triangle.copy()
    turned[::2] = turned[::2, ::-1]
    other = replace(sheet, triangle=turned)
    x = shaken(sheet.position, 8e-4)
    assert other.forces(x) == pytest.approx(sheet.forces(x), rel=1e-9, abs=1e-12)


def test_three_plates_at_one_edge_stay_at_right_angles():
    """A T junction has stiffness for every pair of plates, and none at rest."""
    position = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1.0]])
    mesh = shell_mesh(position, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), 0.3)
    assert len(mesh.hinge) == 3
    sheet = Sheet(position, mesh.triangle, 0.01, 1e7, 0.3)
    assert np.abs(sheet.forces(position)).max() < 1e-9
    for moved in (2, 3, 4):
        x = position.copy()
        x[moved] += [0.0, 0.0, 0.02] if moved < 4 else [0.0, 0.02, 0.0]
        assert np.sum(sheet.forces(x)[moved] * (x - position)[moved]) < 0.0


def test_a_strip_yields_in_tension_at_its_yield_stress():
    strength = 1e6
    sheet = Sheet(*strip(0.12, 0.04, 0.015), thickness=0.001, young_pa=1e9, law=Law.VON_MISES, yield_stress=strength)
    x = sheet.position * [1.01, 1.0, 1.0]
    done = shell_step(sheet.mesh, sheet.material, ShellState.start(sheet.mesh), x, 1e-4)
    end = sheet.position[:, 0] < 1e-9
    # Held in its width, the stress along it is 2/√3 of the strength; forces are per length at rest.
    pull = 1.01 * done.force[end, 0].sum() / (0.04 * 0.001)
    assert pull == pytest.approx(strength * 2 / np.sqrt(3.0), rel=5e-3)
    lost = pull * (np.log(1.01) - pull / 1e9) * 0.12 * 0.04 * 0.001
    assert done.plastic_loss == pytest.approx(lost, rel=0.05)
    again = shell_step(sheet.mesh, sheet.material, done.state, x, 1e-4)
    assert again.plastic_loss < 1e-6 * done.plastic_loss


def test_a_plastic_hinge_bears_its_moment_and_no_more():
    strength, thick, radius = 1e6, 0.001, 0.1
    sheet = Sheet(*strip(0.06, 0.03, 0.006), thickness=thick, young_pa=1e9, law=Law.VON_MISES, yield_stress=strength)
    angle = sheet.position[:, 0] / radius
    x = np.column_stack([radius * np.sin(angle), sheet.position[:, 1], radius * (1.0 - np.cos(angle))])
    done = shell_step(sheet.mesh, sheet.material, ShellState.start(sheet.mesh), x, 1e-4)
    held = shell_energy(sheet.mesh, sheet.material, done.state, x).elastic.sum()
    limit = strength * thick**2 / 4
    stiffness = 1e9 * thick**3 / 12
    assert held < 1.1 * 0.06 * 0.03 * limit**2 / (2 * stiffness)
    assert done.plastic_loss == pytest.approx(limit * (1 / radius - limit / stiffness) * 0.06 * 0.03, rel=0.15)


def test_cyclic_strain_loses_what_the_loss_factor_says():
    loss, rate = 0.2, 200.0
    sheet = Sheet(*strip(0.06, 0.03, 0.015), thickness=0.001, young_pa=1e7, loss=loss, vibration=rate)
    state, size, work, steps = ShellState.start(sheet.mesh), 1e-3, 0.0, 200
    dt = 2 * np.pi / rate / steps
    for k in range(3 * steps):
        x, after = (sheet.position * [1 + size * np.sin(rate * t), 1, 1] for t in (k * dt, (k + 1) * dt))
        done = shell_step(sheet.mesh, sheet.material, state, 0.5 * (x + after), dt)
        state = done.state
        work -= np.sum(done.force * (after - x)) if k >= 2 * steps else 0.0
    stored = 0.5 * 1e7 * size**2 * 0.06 * 0.03 * 0.001
    strength, time = sheet.material.branch_strength[0], sheet.material.branch_time[0]
    modulus = complex_modulus(strength, time, np.array([rate]))[0]
    assert work / (2 * np.pi * stored) == pytest.approx(modulus.imag, rel=0.02)
    assert modulus.imag / modulus.real == pytest.approx(loss, rel=0.05)


def test_the_reference_engine_keeps_momentum_and_energy():
    engine = ReferenceEngine(free_flight(dome()))
    before = engine.measure()
    engine.advance(0.006)
    after = engine.measure()
    assert after.momentum == pytest.approx(before.momentum, abs=1e-12)
    # As of solids: what points keep beside the grid's velocity does not carry them along.
    assert after.angular_momentum == pytest.approx(
        before.angular_momentum, abs=5e-4 * np.linalg.norm(before.angular_momentum)
    )
    total = [float((m.kinetic + m.elastic).sum()) for m in (before, after)]
    assert 0.85 * total[0] < total[1] <= 1.001 * total[0]


def test_the_reference_engine_goes_on_exactly_from_a_checkpoint():
    sheet = dome(Law.VON_MISES, yield_stress=1e3, loss=0.1, vibration=300.0)
    problem = free_flight(sheet)
    whole, half = ReferenceEngine(problem), ReferenceEngine(problem)
    whole.advance(0.002)
    half.advance(0.002)
    saved = half.save()
    other = ReferenceEngine(problem)
    other.restore(saved)
    for engine in (whole, other):
        engine.advance(0.004)
    assert whole.measure().plastic_loss > 0.0
    for name, value in whole.save().items():
        assert np.array_equal(value, other.save()[name], equal_nan=True), name


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"thickness": np.zeros(1)}, "no thickness"),
        ({"law": np.array([Law.DRUCKER_PRAGER.value])}, "no thin wall follows"),
        ({"triangle": np.array([[0, 1, 1]])}, "degenerate"),
    ],
)
def test_what_cannot_be_a_shell_is_refused_in_one_sentence(change, words):
    sheet = Sheet(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]]), 0.01, 1e7)
    body = sheet_body(sheet, np.zeros((3, 3)), (0.0, 0.0, 1.0))
    assert body.shell is not None
    wrong = replace(body, shell=replace(body.shell, **change))
    none = np.zeros((2, 2))
    with pytest.raises(SimulationError, match=words):
        ReferenceEngine(Problem((wrong,), 0.1, none, none))


def test_a_sheet_comes_to_rest_half_its_wall_above_the_floor():
    cell, thick = 0.01, 0.001
    sheet = Sheet(*strip(0.03, 0.03, cell / 2), thickness=thick, young_pa=7e6, poisson=0.3)
    table = np.full((2, 2), 0.5)
    body = sheet_body(sheet, np.zeros_like(sheet.position), (0.003, 0.001, 0.003))
    engine = ReferenceEngine(Problem((body,), cell, table, np.zeros((2, 2))))
    engine.advance(0.05)
    height = engine.snapshot().position[:, 2]
    assert np.abs(height - thick / 2).max() < 0.06 * cell
    assert np.abs(engine.snapshot().velocity).max() < 1e-3


def test_a_sphere_is_as_heavy_as_its_wall():
    ball = Sheet(*sphere(0.03, 4), thickness=0.002, young_pa=1e7)
    assert ball.mass.sum() == pytest.approx(4 * np.pi * 0.03**2 * 0.002 * ball.density, rel=5e-3)
    assert "reference" in ENGINES
