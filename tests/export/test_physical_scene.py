"""Solids at one instant: frames, masses, velocities, names."""

from dataclasses import replace

import numpy as np
import pytest
from export_helpers import asked_of, rigid, soft

import corporeal as co
from corporeal.export.physical_scene import identifiers
from corporeal.export.scene_motion import frame_at
from corporeal.export.surface_friction import surface_friction


def test_the_frame_of_a_solid_is_its_centre_of_mass(asked, played):
    particles = played.prepared.particles
    for solid in asked.scene.solids:
        own = particles.object == solid.number
        centre = particles.mass[own] @ particles.position[own] / particles.mass[own].sum()
        np.testing.assert_allclose(solid.origin, centre, atol=1e-7)
        assert solid.mass == pytest.approx(particles.mass[own].sum())


def test_a_block_has_the_inertia_of_a_block(asked):
    (block,) = rigid(asked)
    a, b, c = 0.06, 0.04, 0.03
    wanted = block.mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(np.diag(block.inertia), np.diag(wanted), rtol=0.05)


def test_surfaces_stand_where_the_scene_has_them(asked, played):
    for solid in asked.scene.solids:
        for number, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
            there = played.prepared.scene.surfaces[number].vertices
            np.testing.assert_allclose(surface.vertices + solid.origin, there, atol=1e-6)


def test_velocities_are_those_of_the_scene(asked, played):
    for solid, thing in zip(asked.scene.solids, played.prepared.scene.objects, strict=True):
        np.testing.assert_allclose(solid.velocity, thing.velocity, atol=1e-6)


def test_at_the_end_everything_is_where_it_went(played):
    end = asked_of(played, at="end")
    last = played.trajectory.frames[-1].position
    assert end.scene.time == pytest.approx(0.1)
    particles = played.prepared.particles
    for solid in end.scene.solids:
        own = particles.object == solid.number
        np.testing.assert_allclose(solid.origin, particles.mass[own] @ last[own] / particles.mass[own].sum(), atol=1e-6)
    (block,) = rigid(end)
    # Without contact it falls freely from 1 m/s.
    np.testing.assert_allclose(block.velocity, [0.5, 0.0, -1.0 - 0.1 * 9.81], atol=2e-3)


def test_a_turned_solid_keeps_its_principal_moments(played):
    start, end = (rigid(asked_of(played, at=at))[0] for at in ("start", "end"))
    moments = [np.linalg.eigvalsh(s.inertia) for s in (start, end)]
    np.testing.assert_allclose(*moments, rtol=1e-5)


def test_what_is_soft_has_all_of_its_matter(asked, played):
    for solid in soft(asked):
        assert solid.grains is not None
        assert solid.grains.mass.sum() == pytest.approx(solid.mass, rel=1e-12)
        back = solid.grains.position + solid.origin
        np.testing.assert_allclose(back, played.trajectory.frames[0].position[solid.grains.number], atol=1e-7)


def test_colliders_hold_the_surface(asked):
    (block,) = rigid(asked)
    assert block.pieces and block.hull is not None
    high = np.max([c.shape.vertices.max(axis=0) for c in block.pieces], axis=0)
    np.testing.assert_allclose(high, block.surfaces[0].vertices.max(axis=0), atol=1e-6)


def test_pushes_and_winds_are_reported_to_be_left_out(settled):
    scene = settled.motion.scene
    pushed = replace(scene.objects[0], push=co.Push((1.0, 0.0, 0.0)))
    blown = replace(scene.objects[1], wind=co.Wind((1.0, 0.0, 0.0)))
    from corporeal.export.unsupported_features import unsupported_features

    scene = replace(scene, objects=(pushed, blown, scene.objects[2]))
    told = unsupported_features(scene, settled.motion.source, settled.motion)
    assert [s.split(" ")[0] for s in told] == ["board", "Wind"]


@pytest.mark.parametrize(("at", "frame"), [("start", 0), ("end", 4), ("0.05", 2), ("0.06", 2), ("0.1", 4)])
def test_the_nearest_frame_is_exported(at, frame):
    assert frame_at(at, np.arange(5) / 40) == frame


@pytest.mark.parametrize("at", ["soon", "-1", "0.2", "nan"])
def test_an_instant_that_is_not_there_is_refused(at):
    with pytest.raises(co.UserError, match="--at is"):
        frame_at(at, np.arange(5) / 40)


def test_names_become_identifiers_that_are_distinguished():
    names = identifiers(["мяч", "Büste 1", "Büste_1", "7up", "World", "a/b"], ["World"])
    assert names == ["thing", "Buste_1", "Buste_2", "thing_7up", "World_1", "a_b"]


PAIRS = np.array([[0.0, 0.4, 0.6], [0.4, 0.0, 0.9], [0.6, 0.9, 0.0]])


def test_three_frictions_are_fitted_exactly_where_three_numbers_can_be():
    found = surface_friction(PAIRS, np.array([0, 1]), "multiply")
    a, b, floor = found.coefficient
    assert found.misfit < 1e-12
    np.testing.assert_allclose([a * b, a * floor, b * floor], [0.4, 0.6, 0.9])
    mean = surface_friction(PAIRS, np.array([0, 1]), "average")
    assert mean.misfit < 1e-12
    assert mean.coefficient.sum() == pytest.approx(0.4 + 0.6 + 0.9)


def test_with_the_larger_of_two_no_pair_is_rougher_than_ours():
    found = surface_friction(PAIRS, np.array([0, 1]), "larger")
    single = found.coefficient
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert max(single[i], single[j]) <= PAIRS[i, j]
    assert found.misfit == pytest.approx(0.3)
