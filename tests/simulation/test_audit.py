"""The audit finds what is wrong, and says what it means; the outcome tells what was seen."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import (
    Discretization,
    Frame,
    Law,
    Ledger,
    Material,
    MaterialField,
    NoteKind,
    PartDescription,
    Particles,
    Scene,
    SceneObject,
    Structure,
    note_kind,
)
from corporeal.simulation.audit import audit, energy_growth, impact_gain, impact_loss, momentum_residual, unbooked_loss
from corporeal.simulation.audit_messages import breach_messages
from corporeal.simulation.outcome import measure_outcome
from corporeal.simulation.trajectory_files import FrameLayout, gather_ledgers, write_frame, write_layout

CELL, FPS, STEPS = 0.01, 50, 41
SCENE = Scene(
    "made up",
    "",
    (SceneObject("clay_0", "clay", 0.1), SceneObject("stone_0", "stone", 0.04)),
    (),
    (),
    gravity=(0.0, 0.0, -5.0),
    fps=FPS,
    duration=(STEPS - 1) / FPS,
)
CLAY = Material("clay", Law.VON_MISES, 5e6, 0.4, 1700.0, yield_stress=1e5)
TREATMENT = Discretization("deformable", 5e6, 5e6, 0.4, 1700.0, 1e5, None, 0.1, 1.0, 60.0, 1e-4, "Deformable.")
HIT = 0.2
"""The stone strikes at this time [s], at x = y = 0.02 m."""


def cube(size, centre):
    axis = np.arange(CELL / 4, size, CELL / 2) - size / 2
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3) + centre


CLAY_START = cube(0.1, (0.0, 0.0, 0.05))
STONE_START = cube(0.04, (0.02, 0.02, 0.22))


def stone_height(t):
    """Falls 10 cm in 0.2 s, is thrown back 4 cm, and stays there (a story, not physics)."""
    return 0.22 - 0.1 * (t / HIT) ** 2 if t < HIT else min(0.12 + (t - HIT) * 0.2, 0.16)


def positions(t):
    clay = CLAY_START.copy()
    if t >= HIT:
        near = np.hypot(clay[:, 0] - 0.02, clay[:, 1] - 0.02) < 0.015
        clay[near & (clay[:, 2] > 0.07), 2] -= 0.02
    return clay, STONE_START + np.array([0, 0, stone_height(t) - 0.22])


def row(t):
    clay, stone = positions(t)
    mass = np.array([1.7, 0.1])
    momentum = np.array([[0, 0, 0], [0, 0, -0.1 * 5 * t if t < HIT else 0.0]])
    first, point = np.full((3, 3), np.nan), np.full((3, 3, 3), np.nan)
    first[0, 2] = first[2, 0] = 0.001
    point[0, 2] = point[2, 0] = 0.0
    if t >= HIT:
        first[0, 1] = first[1, 0] = HIT
        point[0, 1] = point[1, 0] = (0.02, 0.02, 0.1)
    return Ledger(
        time=np.array(t),
        mass=mass,
        centre=np.stack([clay.mean(0), stone.mean(0)]),
        momentum=momentum,
        angular_momentum=np.zeros((2, 3)),
        kinetic=np.zeros(2),
        elastic=np.zeros(2),
        potential=np.zeros(2),
        speed=np.array(0.0),
        external_impulse=momentum,
        plane_impulse=np.zeros((1, 2, 3)),
        pair_impulse=np.zeros((2, 2)),
        push_work=np.array(0.0),
        friction_loss=np.array(0.0),
        impact_loss=np.array(0.0),
        impact_of_pair=np.zeros((3, 3)),
        plastic_loss=np.array(0.0),
        viscous_loss=np.array(0.0),
        first_contact=first,
        last_contact=first,
        contact_point=point,
        flow=np.ones(2),
        rms_speed=np.zeros(2),
        gap=np.array([[np.inf, stone.min(0)[2] - 0.1], [stone.min(0)[2] - 0.1, np.inf]]),
        overlap=np.zeros((2, 2)),
        plane_depth=np.zeros((1, 2)),
        steps=np.array(5),
        dt_min=np.array(1e-4),
        dt_max=np.array(1e-4),
        nan=np.array(0),
        lost=np.array(0),
    )


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    folder = tmp_path_factory.mktemp("story")
    counts = [len(CLAY_START), len(STONE_START)]
    owner = np.repeat([0, 1], counts)
    layout = FrameLayout(object=owner, rigid=np.array([False, True]))
    write_layout(folder, layout)
    still = np.broadcast_to(np.eye(3), (sum(counts), 3, 3))
    for k in range(STEPS):
        frame = Frame(time=k / FPS, position=np.concatenate(positions(k / FPS)), deformation=still)
        write_frame(folder, k, frame, layout, row(k / FPS))
    volume = np.where(owner == 0, 1e-3 / counts[0], 6.4e-5 / counts[1])
    particles = Particles(
        position=np.concatenate([CLAY_START, STONE_START]),
        velocity=np.zeros((sum(counts), 3)),
        volume=volume,
        density=np.full(sum(counts), 1700.0),
        object=owner,
        part=owner.copy(),
        cell=CELL,
        treatments=(TREATMENT, replace(TREATMENT, kind="rigid")),
        surface=np.zeros((0, 3)),
        object_of_surface=np.zeros(0, dtype=np.int64),
        mass_real=(1.7, 6.4e-5 * 1700),
    )
    field = MaterialField(
        (CLAY, CLAY),
        (Structure("solid"),) * 2,
        (PartDescription("lump", "clay"), PartDescription("pebble", "clay")),
        np.full((3, 3), 0.5),
        np.full((3, 3), 0.5),
    )
    return SCENE, particles, field, gather_ledgers(folder, STEPS)


@pytest.fixture(scope="module")
def seen(story):
    return measure_outcome(*story)


def test_the_imprint_is_where_the_stone_struck(seen):
    clay = seen.objects["clay_0"]
    assert clay.dent_depth_m == pytest.approx(0.02, rel=0.05)
    np.testing.assert_allclose(clay.dent_place[:2], [0.02, 0.02], atol=0.003)
    assert clay.dent_from_contact_m["stone_0"] < 0.02
    assert clay.dent_from_contact_m["floor"] > 0.06
    assert clay.at_rest


def test_the_same_imprint_in_sand_is_measured_at_its_surface(story, seen):
    scene, particles, field, trajectory = story
    sand = replace(CLAY, law=Law.DRUCKER_PRAGER, yield_stress=None, friction_angle=0.6)
    lump = measure_outcome(scene, particles, replace(field, materials=(sand, CLAY)), trajectory).objects["clay_0"]
    assert lump.dent_depth_m == pytest.approx(0.02, rel=0.05)
    np.testing.assert_allclose(lump.dent_place[:2], [0.02, 0.02], atol=0.003)
    assert lump.rim_height_m == pytest.approx(0.0, abs=1e-3)
    assert seen.objects["clay_0"].rim_height_m is None, "what holds together has none"


def test_the_stone_bounced_and_kept_its_shape(seen):
    stone, pair = seen.objects["stone_0"], seen.pair("stone_0", "clay_0")
    assert stone.shape_error_end < 1e-6
    assert stone.dent_place is None
    assert stone.fall_m == pytest.approx(0.1, abs=2e-3)
    assert stone.rebound_m == pytest.approx(0.04, abs=2e-3)
    assert stone.rebound_ratio == pytest.approx(0.4, abs=0.03)
    assert pair.first_contact_s == HIT
    assert pair.separated
    assert pair.gap_end_m == pytest.approx(0.04, abs=CELL)
    assert seen.order == (("clay_0", "stone_0"),)


@pytest.mark.parametrize(("gap", "order"), [(1.0, (("clay_0", "stone_0"),)), (0.45, ())])
def test_what_meets_before_the_second_frame_was_apart_if_there_was_a_gap(story, gap, order):
    """Ways between things in a row are crossed sooner than a video can show."""
    scene, particles, field, trajectory = story
    ledger = deepcopy(trajectory.ledger)
    ledger.first_contact[-1, 0, 1] = 0.4 / FPS
    ledger.contact_point[-1, 0, 1] = 0.0
    ledger.gap[0, 0, 1] = gap * CELL
    seen = measure_outcome(scene, particles, field, replace(trajectory, ledger=ledger))
    assert seen.order == order
    assert seen.pair("clay_0", "stone_0").gap_start_dx == pytest.approx(gap)


def test_a_sound_run_has_no_warnings(story):
    found = audit(*story)
    assert found.warnings == ()
    assert found.mass_error < 1e-9
    assert [p.object for p in found.parts] == ["clay_0", "stone_0"]


def test_momentum_from_nowhere_is_found(story):
    ledger = deepcopy(story[3].ledger)
    ledger.momentum[20:, 1, 0] += 0.02
    assert momentum_residual(ledger, SCENE, CELL) == pytest.approx(0.02 / 2)


def test_a_booked_number_that_is_none_makes_a_run_invalid(story):
    ledger = deepcopy(story[3].ledger)
    ledger.push_work[20:] = np.nan
    found = audit(*story[:3], replace(story[3], ledger=ledger))
    assert found.nan_count == STEPS - 20
    assert any("not finite" in sentence for sentence in found.warnings)


def test_energy_from_nowhere_is_found_and_dissipation_is_not_mistaken_for_it(story):
    known = story[3].ledger
    fall = np.linspace(0, 1.0, STEPS)[:, None] * [0, 2.0]
    rubbed = replace(known, potential=-fall, friction_loss=0.3 * fall[:, 1])
    ledger = replace(rubbed, kinetic=0.7 * fall)
    assert energy_growth(ledger, SCENE, CELL) < 1e-12
    ledger = replace(rubbed, kinetic=0.8 * fall)
    assert energy_growth(ledger, SCENE, CELL) == pytest.approx(0.1)
    assert energy_growth(ledger, SCENE, CELL, with_losses=False) == 0
    ledger = replace(rubbed, kinetic=1.2 * fall)
    assert energy_growth(ledger, SCENE, CELL, with_losses=False) == pytest.approx(0.2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "value", "word"),
    [
        ("nan_count", 3, "not finite"),
        ("particles_out_of_domain", 7, "7 particles"),
        ("momentum_residual", 0.05, "5.0%"),
        ("energy_growth", 0.2, "energy balance"),
        ("mechanical_growth", 0.2, "energy grew by 20.0%"),
        ("max_penetration_dx", 2.5, "2.5 grid cells"),
        ("mass_error", 0.3, "30%"),
    ],
)
def test_every_breach_is_reported_in_plain_words(story, key, value, word):
    found = replace(audit(*story), **{key: value})
    (sentence,) = breach_messages(found)
    assert word in sentence
    assert sentence.endswith(".")
    wrong = key in ("nan_count", "momentum_residual", "mass_error")
    assert note_kind(sentence) is (NoteKind.GRAVE if wrong else NoteKind.DOUBT)


@pytest.mark.parametrize(("begun", "word"), [(0.0173, "at the start"), (0.002, "--detail")])
def test_detail_is_not_proposed_for_what_the_scene_puts_into_each_other(story, begun, word):
    scene, particles, field, told = story
    deep = np.full((STEPS, 2, 2), 0.0174)
    deep[0] = begun
    found = audit(scene, particles, field, replace(told, ledger=replace(told.ledger, overlap=deep)))
    (sentence,) = breach_messages(found)
    assert sentence.startswith("Objects penetrate each other by up to 1.7 grid cells (17 mm)")
    assert word in sentence


def test_what_is_one_particle_has_no_shape_that_could_change(story):
    scene, particles, field, told = story
    alone = np.append(np.flatnonzero(particles.object == 0), -1)
    rows = ("position", "velocity", "volume", "density", "object", "part")
    few = replace(particles, **{n: getattr(particles, n)[alone] for n in rows})
    frames = [replace(f, position=f.position[alone], deformation=f.deformation[alone]) for f in told.frames]
    seen = measure_outcome(scene, few, field, replace(told, frames=frames))
    assert seen.objects["stone_0"].shape_error_max == 0.0


def test_what_is_lost_and_not_booked_is_reported(story):
    known = story[3].ledger
    fall = np.linspace(0, 1.0, STEPS)[:, None] * [0, 2.0]
    ledger = replace(known, potential=-fall, kinetic=0.5 * fall, impact_loss=0.3 * fall[:, 1])
    assert unbooked_loss(ledger, SCENE, CELL) == pytest.approx(0.2)
    assert impact_loss(ledger, SCENE, CELL) == pytest.approx(0.3)
    assert energy_growth(ledger, SCENE, CELL) < 1e-12
    ledger = replace(ledger, friction_loss=0.2 * fall[:, 1])
    assert unbooked_loss(ledger, SCENE, CELL) == pytest.approx(0.0, abs=1e-12)


def test_a_pair_that_gained_hides_nothing_of_what_another_lost(story):
    """Clay loses 1 J on the floor, the stone gets .4 J from it: net .6 J were told, of 2 J."""
    known = story[3].ledger
    fall = np.linspace(0, 1.0, STEPS)[:, None] * [0, 2.0]
    pairs = np.zeros((STEPS, 3, 3))
    pairs[-1, 0, 2] = pairs[-1, 2, 0] = 1.0
    pairs[-1, 1, 2] = pairs[-1, 2, 1] = -0.4
    net = np.linspace(0, 0.6, STEPS)
    ledger = replace(known, potential=-fall, impact_loss=net, impact_of_pair=pairs)
    assert impact_loss(ledger, SCENE, CELL) == pytest.approx(0.5)
    assert impact_gain(ledger, SCENE, CELL) == pytest.approx(0.2)
