"""Where a face lies, which way it looks, and what a node solve may never do."""

import numpy as np
import pytest

from corporeal.mpm.physics import contact, contact_impulses

RNG = np.random.default_rng


def spline(u):
    u = np.abs(u)
    return np.where(u < 0.5, 0.75 - u**2, np.where(u < 1.5, 0.5 * (1.5 - u) ** 2, 0.0))


@pytest.mark.parametrize("face", [-1.3, -0.7, -0.5, -0.2, 0.0, 0.3, 0.5, 0.9, 1.4, 2.0])
def test_the_mean_of_a_half_space_is_its_weighted_integral(face):
    u = np.linspace(-1.5, min(face, 1.5), 200_001)
    w = spline(u)
    expected = np.trapezoid(u * w, u) / np.trapezoid(w, u)
    assert float(contact.half_space_mean(np.array(face))) == pytest.approx(expected, abs=1e-7)


def test_the_face_is_found_again_from_its_mean():
    face = np.linspace(-1.4, 0.9, 50)
    assert contact.half_space_face(contact.half_space_mean(face)) == pytest.approx(face, abs=1e-5)


@pytest.mark.parametrize("face", [-1.4, -0.7, -0.5, 0.0, 0.4, 0.9, 2.0])
def test_the_deviation_of_a_half_space_is_its_weighted_integral(face):
    u = np.linspace(-1.5, min(face, 1.5), 200_001)
    w = spline(u) / np.trapezoid(spline(u), u)
    expected = np.sqrt(np.trapezoid(u**2 * w, u) - np.trapezoid(u * w, u) ** 2)
    assert float(contact.half_space_deviation(np.array(face))) == pytest.approx(expected, abs=1e-6)


def test_the_face_of_a_half_space_is_found_from_mean_and_deviation():
    face = np.linspace(-1.4, 1.2, 50)
    mean, deviation = contact.half_space_mean(face), contact.half_space_deviation(face)
    assert contact.face_of_spread(mean, deviation) == pytest.approx(face, abs=1e-3)


def test_a_layer_ends_where_it_is():
    place = np.linspace(-1.4, 1.4, 15)
    assert contact.face_of_spread(place, np.zeros(15)) == pytest.approx(place, abs=1e-9)


def spread(*deviations):
    return np.diag(np.square(deviations))[None]


@pytest.mark.parametrize("lean", [0.0, 0.2, 0.4])
def test_a_contact_with_a_layer_is_along_its_normal(lean):
    leaning = np.array([[np.sin(lean), 0.0, np.cos(lean)]])
    across = contact.layer_normals(leaning, spread(0.5, 0.5, 0.0))
    assert across == pytest.approx(np.array([[0.0, 0.0, 1.0]]), abs=0.02)
    assert contact.layer_normals(-leaning, spread(0.5, 0.5, 0.0)) == pytest.approx(-across)


@pytest.mark.parametrize("lean", [0.0, 0.1, 0.3])
def test_a_contact_with_the_rim_of_a_layer_keeps_its_normal(lean):
    along = np.array([[np.cos(lean), 0.0, np.sin(lean)], [0.0, 0.0, 0.0]])
    given = np.concatenate([spread(0.5, 0.5, 0.0)] * 2)
    assert contact.layer_normals(along, given) == pytest.approx(along)


def test_what_is_no_layer_keeps_its_normal():
    leaning = contact.unit(RNG(5).normal(size=(1, 3)))
    assert contact.layer_normals(leaning, spread(0.4, 0.4, 0.4)) == pytest.approx(leaning)
    assert np.array_equal(contact.layer_normals(leaning), leaning)


def test_the_touching_distance_has_its_measured_values():
    t = contact.touching_distance(np.array([0.0, 0.5, 1.0]))
    assert t == pytest.approx([0.86, 0.95, 1.27], abs=0.03)
    assert np.array_equal(t, contact.touching_distance(-np.array([0.0, 0.5, 1.0])))
    assert contact.touching_distance(np.array([1.25, 3.0])).std() == 0.0


def slab_means(face, opening, spacing, cell):
    """Mean offsets from a node at 0 of two slabs of particles, ``opening`` apart."""
    layer = (np.arange(400) + 0.5) * spacing
    means = []
    for x in (face - layer, face + opening + layer):
        w = spline(x / cell)
        means.append([[w @ x / w.sum(), 0.0, 0.0]])
    return np.array(means[0]), np.array(means[1])


@pytest.mark.parametrize("place", [-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75])
def test_two_slabs_that_touch_have_no_gap_wherever_the_face_lies(place):
    """Averaged over where the particles' layers happen to fall, with two per cell."""
    cell, normal = 0.1, np.array([[1.0, 0.0, 0.0]])
    gaps = [
        contact.gap_between(*slab_means((place + s) * cell, 0.0, cell / 2, cell), normal, cell)[0]
        for s in np.linspace(-0.05, 0.05, 5)
    ]
    assert abs(np.mean(gaps)) < 0.08 * cell


def test_an_open_gap_is_measured_as_open():
    cell, normal = 0.1, np.array([[1.0, 0.0, 0.0]])
    closed = contact.gap_between(*slab_means(0.0, 0.0, cell / 2, cell), normal, cell)[0]
    opened = contact.gap_between(*slab_means(-0.02, 0.04, cell / 2, cell), normal, cell)[0]
    assert opened - closed == pytest.approx(0.04, rel=0.5)
    assert opened > 0.01


def test_a_wall_is_a_half_space_that_touches_like_one():
    cell, normal = 0.1, np.array([[0.0, 0.0, -1.0]])
    for h in (-0.5, -0.25, 0.0, 0.25, 0.45):
        layer = (np.arange(400) + 0.5) * cell / 2 - h * cell
        w = spline(layer / cell)
        mean = np.array([[0.0, 0.0, w @ layer / w.sum()]])
        gap = contact.gap_to_wall(mean, np.array([h * cell]), normal, cell)[0]
        assert abs(gap) < 0.12 * cell
    high = contact.gap_to_wall(mean, np.array([0.8 * cell]), normal, cell)[0]
    assert np.isinf(high)


@pytest.mark.parametrize("height", [-1.1, -0.7, -0.3, 0.0, 0.2, 0.4, 0.5])
def test_a_field_at_rest_touches_a_thin_body_where_it_is(height):
    """Taken for two fields, up to .13 cells too early."""
    layer = height - (np.arange(40) + 0.5) / 2
    w = spline(layer)
    mean, up = np.array([[0.0, 0.0, w @ layer / w.sum()]]), np.array([[0.0, 0.0, 1.0]])
    at = np.array([height])
    assert contact.gap_to_thin(mean, at, up, 1.0) == pytest.approx(0.0, abs=1e-12)
    above = contact.gap_to_thin(mean, at + 0.01, up, 1.0)[0]
    assert 0.003 < above < 0.011


@pytest.mark.parametrize(("far", "begins"), [(-2.9, -2.9), (-3.1, 0.5), (None, 0.5)])
def test_a_thin_body_begins_no_farther_behind_a_node_than_that_sees(far, begins):
    points = np.array([[0.2, 0.0, 0.5], [0.0, 0.3, 0.7]] + [[0.0, 0.1, far]] * (far is not None))
    node, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    assert contact.surface_begins(points, node, up, 1.0, 3.0) == pytest.approx(begins)
    beyond = points - np.array([5.0, 0.0, 9.0])
    assert contact.surface_begins(beyond, node, up, 1.0, 3.0) == np.inf


def test_of_three_candidates_the_one_that_separates_is_chosen():
    outward_a = np.array([[1.0, 0.0, 1.0]])  # an edge of a small block
    outward_c = np.array([[0.0, 0.0, -1.0]])  # the flat floor below it
    candidates = contact.candidate_normals(outward_a, outward_c)
    reach_a = np.array([[0.5, 0.6, 0.0]])
    reach_c = np.array([[0.1, 0.1, 0.05]])
    normal = contact.take_candidate(candidates, contact.widest_candidate(candidates, reach_a, reach_c, 0.1))
    assert normal == pytest.approx(np.array([[0.0, 0.0, 1.0]]))


def test_an_absent_candidate_is_never_chosen():
    candidates = np.array([[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]])
    normal = contact.take_candidate(
        candidates, contact.widest_candidate(candidates, np.full((1, 3), 1.0), np.zeros((1, 3)), 0.1)
    )
    assert normal[0].tolist() == [0.0, 1.0, 0.0]


def test_smoothing_keeps_a_flat_face_flat_and_heals_one_wrong_normal():
    index = np.array([[i, j, 0] for i in range(5) for j in range(5)])
    normal = np.tile([0.0, 0.0, 1.0], (25, 1))
    assert contact.smooth_normals(normal, np.ones(25), index) == pytest.approx(normal)
    normal[12] = [1.0, 0.0, 0.0]
    healed = contact.smooth_normals(normal, np.ones(25), index)
    assert healed[12, 2] > 0.98
    far = np.array([[0, 0, 0], [5, 0, 0]])
    two = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    assert contact.smooth_normals(two, np.ones(2), far) == pytest.approx(two)


# ---------------------------------------------------------------- impulses


def some_movers(count, rng, rigid=False):
    """Bodies of very different masses with random velocities; the last one is the wall."""
    inertia = np.zeros((count + 1, 3, 3))
    if rigid:
        for b in range(count):
            a = rng.standard_normal((3, 3))
            inertia[b] = a @ a.T + 0.1 * np.eye(3)
    velocity, spin = rng.standard_normal((2, count + 1, 3))
    velocity[-1], spin[-1] = 0.0, 0.0
    if not rigid:
        spin[:] = 0.0
    return contact_impulses.Movers(
        np.append(1.0 / 10 ** rng.uniform(-2, 2, count), 0.0),
        inertia,
        rng.standard_normal((count + 1, 3)),
        velocity,
        spin,
    )


def some_contacts(movers, rng, wall=False, friction=0.6):
    count = len(movers.inverse_mass) - 1
    pairs = [(a, c) for a in range(count) for c in range(a + 1, count)]
    pairs += [(a, count) for a in range(count)] if wall else []
    a, c = np.array(pairs).T
    n = len(pairs)
    normal = contact.unit(rng.standard_normal((n, 3)))
    point = np.tile(rng.standard_normal(3), (n, 1))
    return contact_impulses.ContactList(a, c, point, normal, np.zeros(n), np.full(n, friction))


def kinetic(movers):
    mass = 1.0 / movers.inverse_mass[:-1]
    energy = 0.5 * np.sum(mass[:, None] * movers.velocity[:-1] ** 2)
    for inverse, spin in zip(movers.inverse_inertia[:-1], movers.spin[:-1], strict=True):
        if inverse.any():
            energy += 0.5 * spin @ np.linalg.solve(inverse, spin)
    return energy


def momentum(movers):
    return (movers.velocity[:-1] / movers.inverse_mass[:-1, None]).sum(axis=0)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("count", [2, 3, 5])
def test_any_bodies_in_one_node_conserve_momentum_and_never_gain_energy(count, seed):
    rng = RNG(seed)
    movers = some_movers(count, rng)
    contacts = some_contacts(movers, rng)
    before, energy = momentum(movers), kinetic(movers)
    scale = np.sum(np.abs(movers.velocity[:-1]) / movers.inverse_mass[:-1, None])
    impulse = contact_impulses.solve(contacts, movers, np.zeros(len(contacts.a)), 10)
    assert np.abs(momentum(movers) - before).max() < 1e-12 * scale
    assert kinetic(movers) <= energy * (1 + 1e-12)
    normal = np.sum(impulse * contacts.normal, axis=1)
    tangential = np.linalg.norm(impulse - normal[:, None] * contacts.normal, axis=1)
    assert np.all(normal >= 0.0)
    assert np.all(tangential <= 0.6 * normal + 1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_rigid_bodies_and_a_wall_solved_together_never_gain_energy(seed):
    rng = RNG(seed)
    movers = some_movers(3, rng, rigid=True)
    contacts = some_contacts(movers, rng, wall=True)
    energy = kinetic(movers)
    contact_impulses.solve(contacts, movers, np.zeros(len(contacts.a)), 50)
    assert kinetic(movers) <= energy * (1 + 1e-12)
    assert np.all(movers.velocity[-1] == 0.0) and np.all(movers.spin[-1] == 0.0)


def test_rigid_bodies_keep_their_angular_momentum_together():
    rng = RNG(5)
    movers = some_movers(3, rng, rigid=True)
    contacts = some_contacts(movers, rng)

    def angular():
        total = np.cross(movers.centre[:-1], movers.velocity[:-1] / movers.inverse_mass[:-1, None])
        own = [np.linalg.solve(i, w) for i, w in zip(movers.inverse_inertia[:-1], movers.spin[:-1], strict=True)]
        return total.sum(axis=0) + np.sum(own, axis=0)

    before = angular()
    contact_impulses.solve(contacts, movers, np.zeros(len(contacts.a)), 20)
    assert np.abs(angular() - before).max() < 1e-11 * np.abs(before).max()


def test_a_pair_shares_velocity_along_the_normal_as_their_masses_say():
    """J_n = m_r u·n, J_t = min(μ J_n, m_r |u_t|)."""
    movers = contact_impulses.Movers(
        np.array([1.0, 0.25, 0.0]),
        np.zeros((3, 3, 3)),
        np.zeros((3, 3)),
        np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        np.zeros((3, 3)),
    )
    contacts = contact_impulses.ContactList(
        np.array([0]), np.array([1]), np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), np.zeros(1), np.array([0.5])
    )
    impulse = contact_impulses.solve(contacts, movers, np.zeros(1), 1)
    reduced = 4.0 / 5.0
    assert impulse[0] == pytest.approx([reduced, 0.5 * reduced, 0.0])
    assert movers.velocity[0, 0] == pytest.approx(movers.velocity[1, 0])


def test_bodies_that_move_apart_are_left_alone():
    rng = RNG(0)
    movers = some_movers(2, rng)
    contacts = some_contacts(movers, rng)
    apart = contacts._replace(normal=-contact.unit(contacts.approach(movers)))
    before = movers.velocity.copy()
    assert not contact_impulses.solve(apart, movers, np.zeros(1), 5).any()
    assert np.array_equal(movers.velocity, before)


def test_an_open_gap_may_close_but_not_overlap():
    contacts = contact_impulses.ContactList(
        np.zeros(3, int),
        np.ones(3, int),
        np.zeros((3, 3)),
        np.tile([1.0, 0.0, 0.0], (3, 1)),
        np.array([0.01, -0.005, 0.5]),
        np.zeros(3),
    )
    soft = contact_impulses.ReboundRules(np.zeros(3, int), *np.zeros((3, 3)))
    target, hit = contact_impulses.target_speeds(contacts, np.full(3, 2.0), soft, 0.1, 0.01)
    assert target == pytest.approx([1.0, 0.0, 50.0])
    assert not hit.any()


def test_one_impact_is_one_event_for_all_near_contacts_of_a_rigid_pair():
    cell, dt, e = 0.1, 0.01, 0.8
    contacts = contact_impulses.ContactList(
        np.zeros(4, int),
        np.ones(4, int),
        np.zeros((4, 3)),
        np.tile([1.0, 0.0, 0.0], (4, 1)),
        np.array([0.0, 0.009, 0.05, 0.0]),
        np.zeros(4),
    )
    rebound = contact_impulses.ReboundRules(np.array([0, 0, 0, 1]), np.full(4, e), *np.zeros((2, 4)))
    approach = np.array([0.5, 0.5, 0.5, 0.04])  # the other pair is too slow to bounce
    target, hit = contact_impulses.target_speeds(contacts, approach, rebound, cell, dt)
    assert hit.tolist() == [True, True, True, False]
    assert target == pytest.approx([-0.4, -0.4, 5.0, 0.0])


def test_nothing_rebounds_from_the_gravity_of_a_single_step():
    contacts = contact_impulses.ContactList(
        np.zeros(1, int), np.ones(1, int), np.zeros((1, 3)), np.array([[0.0, 0.0, -1.0]]), np.zeros(1), np.zeros(1)
    )
    rebound = contact_impulses.ReboundRules(np.zeros(1, int), np.ones(1), np.array([0.3]), np.zeros(1))
    target, hit = contact_impulses.target_speeds(contacts, np.array([0.33]), rebound, 0.1, 0.01)
    assert not hit.any() and target[0] == 0.0


def test_what_rolls_on_its_points_does_not_bounce_on_the_next_one():
    contacts = contact_impulses.ContactList(
        np.zeros(1, int), np.ones(1, int), *np.zeros((1, 1, 3)), np.array([[0.0, 0.0, -1.0]]),
        np.zeros(1), np.zeros(1),
    )  # fmt: skip
    for feigned, rebounds in ((0.2, True), (0.3, False)):
        rebound = contact_impulses.ReboundRules(np.zeros(1, int), *np.ones((1, 1)), np.zeros(1), np.array([feigned]))
        _, hit = contact_impulses.target_speeds(contacts, np.array([0.3]), rebound, 0.1, 0.01)
        assert hit[0] == rebounds


def balls_that_touch(count):
    """Balls of 1 kg side by side along x, contacts between neighbours, and how they rebound."""
    still = np.zeros((count, 3))
    movers = contact_impulses.Movers(np.ones(count), np.zeros((count, 3, 3)), still, still.copy(), still.copy())
    first, n = np.arange(count - 1), count - 1
    along = np.tile([1.0, 0.0, 0.0], (n, 1))
    contacts = contact_impulses.ContactList(first, first + 1, np.zeros((n, 3)), along, np.zeros(n), np.zeros(n))
    return movers, contacts


@pytest.mark.parametrize("e", [1.0, 0.8])
def test_an_impact_runs_through_a_row_of_touching_balls_to_the_last(e):
    """Each hits the next by itself: u_k = ((1 + e)/2)^(k-1) (1 - e)/2, the last ((1 + e)/2)^(n-1).

    Where e < 1 those behind are a little faster than those in front and hit them again; so only
    e = 1 is exact, and else what is left is that no ball approaches the next one.
    """
    count = 6
    movers, contacts = balls_that_touch(count)
    movers.velocity[0, 0] = 2.0
    rebound = contact_impulses.ReboundRules(np.arange(count - 1), np.full(count - 1, e), *np.zeros((2, count - 1)))
    impulse = contact_impulses.solve_impacts(contacts, movers, rebound, 0.1, 1e-3)
    u = movers.velocity[:, 0] / 2.0
    assert u.sum() == pytest.approx(1.0, rel=1e-12)
    assert np.diff(u).min() * 2.0 > -0.05
    assert u[-1] == pytest.approx(((1.0 + e) / 2.0) ** (count - 1), rel=1e-12)
    assert impulse[-1, 0] == pytest.approx(2.0 * u[-1], rel=1e-12)
    if e == 1.0:
        assert np.abs(u[:-1]).max() < 1e-12


def test_solved_at_once_a_row_of_touching_balls_would_share_the_impact():
    """The control: all five balls rebound in one solve."""
    movers, contacts = balls_that_touch(5)
    movers.velocity[0, 0] = 1.0
    contact_impulses.solve(contacts, movers, np.array([-1.0, 0.0, 0.0, 0.0]), 2000)
    assert movers.velocity[:, 0] == pytest.approx([-0.6, 0.4, 0.4, 0.4, 0.4], abs=1e-6)


def test_a_ball_that_hits_two_at_once_pushes_both_alike():
    """Symmetry: with contacts at ±30° both go off at 2 v cos 30° / (1 + 2 cos² 30°)."""
    movers, contacts = balls_that_touch(3)
    angle = np.radians(30.0)
    normal = np.array([[np.cos(angle), s * np.sin(angle), 0.0] for s in (1, -1)])
    contacts = contacts._replace(a=np.zeros(2, int), normal=normal)
    movers.velocity[0, 0] = 1.0
    rebound = contact_impulses.ReboundRules(np.arange(2), np.ones(2), *np.zeros((2, 2)))
    contact_impulses.solve_impacts(contacts, movers, rebound, 0.1, 1e-3)
    size = np.linalg.norm(movers.velocity[1:], axis=1)
    expected = 2.0 * np.cos(angle) / (1.0 + 2.0 * np.cos(angle) ** 2)
    assert size == pytest.approx([expected] * 2, rel=1e-9)
    assert np.sum(movers.velocity**2) == pytest.approx(1.0, rel=1e-9)


def test_the_friction_loss_is_the_energy_that_is_missing():
    rng = RNG(1)
    movers = some_movers(2, rng)
    contacts = some_contacts(movers, rng)
    contacts = contacts._replace(normal=contact.unit(contacts.approach(movers) + rng.standard_normal((1, 3)) * 0.3))
    before, energy = contacts.approach(movers), kinetic(movers)
    impulse = contact_impulses.solve(contacts, movers, np.zeros(1), 5)
    after = contacts.approach(movers)
    tangential = contact_impulses.friction_loss(impulse, contacts.normal, before, after)
    along = np.sum(impulse * contacts.normal) * np.sum((before + after) * contacts.normal) / 2
    assert impulse.any() and tangential > 0
    assert energy - kinetic(movers) == pytest.approx(tangential + along, rel=1e-12)
