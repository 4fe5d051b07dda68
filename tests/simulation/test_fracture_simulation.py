"""What breaks when it is told to, and what is kept."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import corporeal as co
from corporeal.core.errors import UserError
from corporeal.core.types import Surface
from corporeal.discretization.discretization_plan import QualityPreset
from corporeal.geometry.voronoi_fragments import cut_fragments, fragment_cells, fragment_seeds
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.simulate import SimulateConfig
from corporeal.simulation.audit import audit
from corporeal.simulation.audit_messages import breakage_message

BREAKING = co.Settings(simulate=SimulateConfig(breaking=True))


def tile(speed, height=0.3, tilt=0.1):
    """A tile that strikes the floor with a corner."""
    shape = trimesh.creation.box((0.1, 0.1, 0.004))
    shape.apply_transform(trimesh.transformations.euler_matrix(tilt, 0.7 * tilt, 0.0))
    shape.apply_translation((0, 0, height))
    thing = co.solid("terracotta", shape.vertices, shape.faces, (0, 0, -speed), "tile")
    return co.build_scene(thing, duration=0.04)


@pytest.fixture(scope="module")
def broken():
    return co.simulate_scene(tile(14.0), BREAKING)


@pytest.fixture(scope="module")
def audited(broken):
    prepared = broken.prepared
    return audit(prepared.scene, prepared.particles, prepared.field, broken.trajectory)


@pytest.mark.slow
def test_what_is_struck_far_too_hard_becomes_pieces(broken):
    (one,) = broken.trajectory.breaks
    assert one.ratio > 10
    count = len(one.surfaces)
    assert count > 5
    assert len(broken.prepared.scene.objects) == count
    assert {s.object for s in broken.prepared.scene.surfaces} == set(range(count))
    assert len(broken.prepared.parts.catalogue) == len(broken.prepared.field.materials) == count
    turns = [f.deformation for f in broken.trajectory.frames][-1]
    last = [turns[broken.prepared.particles.object == k][0] for k in range(count)]
    assert max(np.abs(a - last[0]).max() for a in last) > 0.01


@pytest.mark.slow
def test_pieces_have_the_mass_and_move_with_the_momentum_of_the_whole(broken, audited):
    ledger = broken.trajectory.ledger
    assert np.ptp(ledger.mass.sum(axis=1)) < 1e-12
    outside = ledger.external_impulse.sum(axis=1) + ledger.plane_impulse.sum(axis=(1, 2))
    moved = ledger.momentum.sum(axis=1) - ledger.momentum[0].sum(axis=0)
    assert np.abs(moved - outside).max() < 1e-9 * np.abs(ledger.momentum).sum(axis=1).max()
    prepared = broken.prepared
    assert audited.energy_growth < 1e-3
    assert sum(prepared.particles.mass_real) == pytest.approx(ledger.mass[0].sum(), rel=0.02)


@pytest.mark.slow
def test_before_the_impact_the_pieces_move_as_one(broken):
    (one,) = broken.trajectory.breaks
    before = [f for f in broken.trajectory.frames if f.time < one.time]
    first, last = before[0], before[-1]
    way = last.position - first.position
    assert len(before) > 1
    assert np.abs(way - way[0]).max() < 1e-6


@pytest.mark.slow
def test_the_report_says_into_how_many_pieces(broken, audited):
    (said,) = audited.breakage
    assert said.pieces == len(broken.trajectory.breaks[0].surfaces)
    assert f"breaks into {said.pieces} pieces" in breakage_message(said)


def test_what_is_struck_softly_stays_whole():
    assert not co.simulate_scene(tile(1.0, height=0.03), BREAKING).trajectory.breaks


def test_a_tilted_tile_is_struck_as_the_sheet_that_it_is_and_stays_whole_by_default():
    """Its box along the axes would be that of a lump, which bears a thousand times as much."""
    played = co.simulate_scene(tile(14.0))
    assert len(played.prepared.scene.objects) == 1
    assert not played.trajectory.breaks
    prepared = played.prepared
    found = audit(prepared.scene, prepared.particles, prepared.field, played.trajectory)
    assert found.breakage[0].word == "would break"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("config", "word"),
    [
        (SimulateConfig(engine="cuda", breaking=True), "'cuda' cannot break bodies into pieces"),
        (SimulateConfig(contact="single", breaking=True), "works with contact multi alone"),
    ],
)
def test_what_cannot_break_says_so_in_a_sentence(config, word):
    with pytest.raises(UserError, match=word):
        co.simulate_scene(tile(14.0), replace(BREAKING, simulate=config))


def test_on_the_command_line_that_is_one_sentence_before_anything_is_done(command, tmp_path):
    write_glb(tmp_path / "ball.glb", co.build_scene(co.ball("granite", 0.05, (0, 0, 0.1))))
    asked = ("run", tmp_path / "ball.glb", "--out", tmp_path / "run")
    code, said = command(*asked, "--engine", "cuda", "--breaking")
    assert code == 2 and "Traceback" not in said.err
    assert "The engine 'cuda' cannot break bodies into pieces. Use the engine cpu." in said.err
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_the_reference_engine_breaks_a_coarse_tile_as_the_cpu_engine_does():
    quality = QualityPreset(2, 8, 1000, 20e3, np.inf, cell=0.01)
    ready = co.prepare_scene(replace(tile(14.0, height=0.04), duration=0.003, fps=1000))
    particles = fill(ready.scene, ready.parts, ready.field, quality=quality)
    assert particles.count < 500
    ready = replace(ready, particles=particles)
    ours, sure = (
        co.simulate_scene(ready, co.Settings(simulate=SimulateConfig(engine=engine, breaking=True)))
        for engine in ("cpu", "reference")
    )
    (mine,), (theirs,) = ours.trajectory.breaks, sure.trajectory.breaks
    assert len(theirs.surfaces) == len(mine.surfaces) > 5
    np.testing.assert_array_equal(theirs.piece, mine.piece)
    assert theirs.time == pytest.approx(mine.time, rel=1e-6)
    ledgers = ours.trajectory.ledger, sure.trajectory.ledger
    for ledger in ledgers:
        outside = ledger.external_impulse.sum(axis=1) + ledger.plane_impulse.sum(axis=(1, 2))
        moved = ledger.momentum.sum(axis=1) - ledger.momentum[0].sum(axis=0)
        np.testing.assert_allclose(moved, outside, atol=1e-9)
    before, (mine_after, sure_after) = (
        ledgers[0].momentum[0].sum(axis=0),
        (ledger.momentum[-1].sum(axis=0) for ledger in ledgers),
    )
    np.testing.assert_allclose(sure_after, mine_after, atol=0.05 * np.linalg.norm(before))


@pytest.mark.parametrize("wall", [0.0, 0.002])
def test_pieces_fill_what_they_were_cut_from(wall):
    ball = trimesh.creation.icosphere(3, 0.05)
    whole = Surface("ball", 0, 0, np.array(ball.vertices), np.array(ball.faces))
    points = ball.vertices * 0.98
    seed = fragment_seeds(points, points[0], np.random.default_rng(0))
    pieces = cut_fragments(whole, wall, seed)
    assert pieces is not None
    full = ball.volume if wall == 0.0 else ball.volume * (1 - (1 - wall / 0.05) ** 3)
    enclosed = sum(trimesh.Trimesh(p.vertices, p.triangles, process=False).volume for p in pieces)
    assert enclosed == pytest.approx(full, rel=2e-3)
    assert len(np.unique(fragment_cells(points, seed))) == len(seed)


def test_what_is_not_closed_is_not_cut():
    ball = trimesh.creation.icosphere(2, 0.05)
    open_ = Surface("ball", 0, 0, np.array(ball.vertices), np.array(ball.faces)[:-5])
    assert cut_fragments(open_, 0.0, ball.vertices[:4]) is None
