"""An impact reaches the last of a row: sent from the heavy end, as fast as masses and friction ask."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from bodies import ball, box

from corporeal.scene.arrange_bodies import arrange_bodies
from corporeal.scene.collision_chain import (
    LAST_IMPACT_SPEED_RATIO_RANGE,
    MAX_START_SPEED_RATIO,
    PreviewContact,
    chain_start_speed,
    find_collision_chain,
    impact_hops,
    preview_contacts,
)
from corporeal.scene.interactions import begin_interaction
from corporeal.scene.settled_bodies import SettledBodies
from corporeal.scene.settling_body import UNKNOWN_FRICTION, BodyPose

SIDE, GAP, G = 0.2, 0.06, 9.81


def row(*masses, gap=GAP):
    """Cubes of one size in a line along x, each as heavy as said [kg]."""
    cubes = [replace(box(SIDE, SIDE, SIDE, name=f"cube_{k}"), density=m / SIDE**3) for k, m in enumerate(masses)]
    poses = [BodyPose((k * (SIDE + gap), 0.0, SIDE / 2)) for k in range(len(masses))]
    return SettledBodies(cubes, poses)


def test_a_sliding_cube_meets_its_neighbour_when_friction_lets_it():
    """Way d at v0 against friction: d = v0 t - mu g t²/2; slower, it stops before."""
    still, start = row(1.0, 1.0), 1.2
    (meeting,) = preview_contacts(still, {0: np.array([start, 0.0])}, 1.0)
    slow = UNKNOWN_FRICTION * G
    expected = (start - sqrt(start**2 - 2 * slow * GAP)) / slow
    assert (meeting.a, meeting.b) == (0, 1)
    assert meeting.instant == pytest.approx(expected, abs=5e-3)
    assert preview_contacts(still, {0: np.array([0.7, 0.0])}, 1.0) == []  # 0.84 m/s would do


def test_what_touches_at_the_start_has_not_met():
    still = row(1.0, 1.0, 1.0, gap=0.0)
    assert preview_contacts(still, {0: np.array([1.0, 0.0])}, 0.2) == []


def test_the_speed_asked_for_is_that_of_impacts_without_a_bounce():
    still, last = row(4.0, 2.0, 1.0), 0.5
    leaving = sqrt(last**2 + 2 * UNKNOWN_FRICTION * G * GAP)
    arriving = leaving * (4.0 + 2.0) / 4.0
    start = sqrt(arriving**2 + 2 * UNKNOWN_FRICTION * G * GAP)
    assert chain_start_speed(still, [0, 1, 2], 0.0, last) == pytest.approx(start)
    swift = sqrt(9.0 + 2 * UNKNOWN_FRICTION * G * GAP)
    assert chain_start_speed(still, [0, 1, 2], 3.0, last) == pytest.approx(swift)


@pytest.mark.parametrize("masses", [(8.0, 2.0, 0.5), (0.5, 2.0, 8.0), (3.0, 3.0, 3.0, 3.0)])
def test_a_chain_begins_at_the_heavy_end_and_reaches_the_other(masses):
    still, rng = row(*masses), np.random.default_rng(0)
    chain = find_collision_chain(still, 0.5, rng)
    assert chain is not None
    heaviest = int(np.argmax(masses))
    assert masses[chain.mover] == masses[heaviest] and chain.mover in (0, len(masses) - 1)
    assert np.linalg.norm(chain.velocity) <= MAX_START_SPEED_RATIO * sqrt(G * SIDE)
    met = preview_contacts(still, {chain.mover: chain.velocity}, 2.0)
    assert impact_hops([(m.a, m.b) for m in met], [chain.mover]) == {
        abs(chain.mover - k): k for k in range(len(masses))
    }
    assert chain.arrives == pytest.approx(met[-1].instant)


def test_where_no_speed_allowed_reaches_the_last_there_is_no_chain():
    assert find_collision_chain(row(1.0, 1.0, 1.0, gap=1.5), 0.5, np.random.default_rng(0)) is None
    assert find_collision_chain(row(0.01, 30.0, 0.01), 0.5, np.random.default_rng(0)) is None


def test_how_fast_the_last_is_struck_scales_with_the_scene():
    assert LAST_IMPACT_SPEED_RATIO_RANGE[0] > 0 and LAST_IMPACT_SPEED_RATIO_RANGE[1] < 1
    large = SettledBodies(
        [b.scaled(4.0) for b in row(2.0, 1.0, 1.0).bodies],
        [BodyPose((4 * p.position[0], 0.0, 4 * p.position[2])) for p in row(2.0, 1.0, 1.0).poses],
    )
    small, blown_up = (
        find_collision_chain(s, 0.5 * sqrt(f), np.random.default_rng(1))
        for s, f in ((row(2.0, 1.0, 1.0), 1.0), (large, 4.0))
    )
    assert np.allclose(blown_up.velocity, 2 * small.velocity, rtol=1e-6)


def test_the_video_lasts_until_the_last_was_struck():
    still = row(4.0, 2.0, 1.0, gap=0.1)
    action = begin_interaction(still.bodies, still.poses, "chain", np.random.default_rng(0))
    assert action.entries[0].name == "cube_0" and "into cube_1" in action.words
    met = preview_contacts(still, {0: np.array(action.entries[0].velocity[:2])}, 2.0)
    assert met[-1].instant + 0.5 < action.duration


def test_an_impact_is_counted_from_what_was_sent():
    met = [PreviewContact(2, 3, 0.1), PreviewContact(0, 1, 0.2), PreviewContact(1, 2, 0.3)]
    assert impact_hops([(m.a, m.b) for m in met], [0]) == {0: 0, 1: 1, 2: 2}


def test_a_row_stands_heavy_first_broadside_on():
    slab = replace(box(0.3, 0.1, 0.4, name="slab"), density=900.0)
    things = [ball(0.1), slab, box(0.1, 0.3, 0.3, name="plate")]
    for seed in range(6):
        poses = arrange_bodies(things, "row", np.random.default_rng(seed))
        still = SettledBodies(things, poses)
        assert [int(k) for k in np.argsort(still.centres[:, 0])] == [1, 2, 0]
        assert np.allclose(np.ptp(still.boxes, axis=1)[:, 0], [0.2, 0.1, 0.1], atol=5e-3)


def test_what_is_flat_stands_at_the_end_of_a_row_where_nothing_passes_over_it():
    flat = replace(box(0.2, 0.2, 0.05, name="flat"), density=9e3)
    poses = arrange_bodies([flat, box(0.1, 0.1, 0.3), ball(0.1)], "row", np.random.default_rng(0))
    assert max(range(3), key=lambda k: poses[k].position[0]) == 0
