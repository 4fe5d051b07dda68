"""What the engine for cards asks of a card, counted on the processor: ``benchmarks/card.py``."""

import re

import card
import numpy as np
import pytest
from cost.blocks import drop_of, problem_of
from point_bodies import CELL, ball, body, problem
from test_cuda import fall

from corporeal.core.types import Push
from corporeal.mpm.constants import OUT_OF_BLOCK_FRACTION
from corporeal.mpm.cuda import block_arena, gather, layout, particle_memory, scatter
from corporeal.mpm.cuda.engine import CudaEngine
from corporeal.mpm.cuda.layout import wp

OBJECT, HEAP = drop_of(4_000), drop_of(4_000, objects=8, heap=True)
STATE = particle_memory.PARTICLE_STATE


def engine_of(drop):
    return CudaEngine(problem_of(drop), device="cpu")


def flying(**given):
    return CudaEngine(problem(body(ball((0, 0, 0)), loss=0.0, **given), planes=()), device="cpu")


def flag(engine, which):
    return int(engine.arrays.sheet.flag.numpy()[which])


def kept(engine):
    return {name: particle_memory.read_rows(engine.arrays.particles, name) for name in STATE}


# ---------------------------------------------------------------- launches


def test_a_step_of_one_body_is_four_launches_and_one_with_contact_eleven():
    assert card.launches(flying().program._step) == ["scatter", "momentum_to_velocity", "gather", "finish_step"]
    names = card.launches(engine_of(HEAP).program._step)
    assert len(names) == 11 and len(set(names)) == 11


def test_rigid_bodies_add_four_launches_and_a_round_of_impacts_is_six():
    stone = ball((0, 0, 0.1))
    run = CudaEngine(problem(body(stone, rigid=True, surface=stone)), device="cpu").program
    names = card.launches(run._step)
    assert {"list_surface", "force_rigid", "advance_rigid", "place_rigid_particles"} < set(names) and len(names) == 15
    assert len(card.launches(run._impact)) == 6 and len(card.launches(run._sweep)) == 3


# ---------------------------------------------------------------- atomics


@pytest.mark.parametrize(("drop", "most"), [(OBJECT, 7.0), (HEAP, 12.0)], ids=["object", "heap"])
def test_a_particle_adds_a_few_numbers_to_memory_where_it_added_216(drop, most):
    """Whole blocks of 8 a cell would be 216 nodes of 7 sums for 512 particles: 2.95."""
    fresh = card.adds(engine_of(drop))
    assert fresh.strays == 0.0 and 2.9 < fresh.all < most
    assert card.Adds(fresh.kept, OUT_OF_BLOCK_FRACTION).all < 30.0


def test_the_sums_of_a_node_are_seven_and_none_is_a_zero_that_is_added(tmp_path):
    """A cell's layer of 9 nodes, of 7 sums, in the arena; in memory what strayed gives to its 27;

    7 a node; and a rigid mass 27.
    """
    made = wp.compile_aot_module(scatter, arch=86, module_dir=tmp_path, use_ptx=True)
    text = next(path for path in made if path.suffix == ".ptx").read_text()
    added = re.findall(r"\b(?:red|atom)\.(?:\w+\.)*?(global|shared)\.add\.f32", text)
    each = 27 * layout.ARENA_SUMS
    assert added.count("shared") == block_arena.LAYER_SUMS == each / 3
    assert added.count("global") == each + layout.ARENA_SUMS + 27
    assert ".local" not in text


# ---------------------------------------------------------------- bytes


def shaken(engine, names, kernel):
    """Launch a kernel as it is and with other values in some channels: what it wrote each time."""
    engine.advance(0.01)
    scattered(engine)
    before, sums, found = kept(engine), engine.arrays.grid.sum.numpy().copy(), []
    for other in (False, True):
        for name, rows in before.items():
            values = rows + 3 if other and name in names.split() else rows
            particle_memory.write_rows(engine.arrays.particles, name, values)
        engine.arrays.grid.sum.zero_()
        kernel(engine)
        found.append((kept(engine), engine.arrays.grid.sum.numpy().copy()))
    assert np.abs(sums).max() > 0
    return before, found


def scattered(engine, lanes=1):
    a = engine.arrays
    grouped(scatter.scatter, lanes, a.particles, a.grid, a.rigid, a.loads, a.sheet)


def gathered(engine, lanes=1):
    a = engine.arrays
    grouped(gather.gather, lanes, a.particles, a.grid, a.loads, a.sheet)


def grouped(kernel, lanes, *inputs):
    """Launch a kernel in two groups."""
    threads = 2 * lanes
    given = [*inputs, threads, lanes]
    wp.launch(kernel, dim=threads, inputs=given, device="cpu", block_dim=lanes)


def test_scatter_reads_no_channel_but_those_that_are_counted():
    others = " ".join(set(STATE) - {*card.SCATTER_READS.split(), "field"})
    _, ((_, sums), (_, same)) = shaken(flying(), others, scattered)
    assert np.array_equal(sums, same)


def test_gather_reads_and_writes_no_channel_but_those_that_are_counted():
    others = " ".join(set(STATE) - {*card.GATHER_READS.split(), "field"})
    before, ((after, _), (shifted, _)) = shaken(flying(velocity=(1, 2, 3)), others, gathered)
    written = {name for name in STATE if not np.array_equal(before[name], after[name])}
    assert written - {"cell"} == {*card.GATHER_WRITES.split()} - {"cell"}
    for name in card.GATHER_WRITES.split():
        assert np.array_equal(after[name], shifted[name])
    assert card.moved() == {"scatter reads": 108, "gather reads": 128, "gather writes": 132}


# ---------------------------------------------------------------- groups


@pytest.mark.slow
def test_a_group_of_threads_sums_and_moves_what_one_thread_does(monkeypatch):
    """The processor can take turns among the threads of a group, at every place where they meet."""
    engine = engine_of(HEAP)
    engine.advance(0.004)
    a, found = engine.arrays, []
    monkeypatch.setattr(wp.config, "enable_cpu_blocks", True)
    words = a.particles.words.numpy().copy()
    for lanes in (1, 5):
        a.particles.words.assign(words)
        a.grid.sum.zero_()
        scattered(engine, lanes)
        sums = a.grid.sum.numpy().copy()
        gathered(engine, lanes)
        found.append((sums, kept(engine)))
        assert not np.array_equal(words, a.particles.words.numpy())
    (sums, alone), (same, together) = found
    assert np.abs(sums - same).max() < 1e-6 * np.abs(sums).max() and np.abs(sums).max() > 0
    for name in STATE:
        assert together[name] == pytest.approx(alone[name], rel=1e-6, abs=1e-9)


def pressed():
    return problem(body(ball((0, 0, 0.055)), velocity=(0.3, 0, -1.0), poisson=0.47, young_pa=5e4))


def struck():
    """Two rigid balls and a soft one, pushed, that hit each other and the floor."""
    stones = [ball((x, 0.0, 0.05)) for x in (0.0, 0.1)]
    rigid = [
        body(at, rigid=True, surface=at, velocity=(speed, 0, -1.0))
        for at, speed in zip(stones, (1.5, 0.0), strict=True)
    ]
    push = Push((3.0, 1.0, 0.0))
    return problem(*rigid, body(ball((0.21, 0.01, 0.055)), push=push, velocity=(-1, 0, -1)))


@pytest.mark.slow
@pytest.mark.parametrize("scene", [fall, pressed, struck])
def test_groups_of_threads_simulate_what_one_thread_does(monkeypatch, scene):
    """Twelve threads in three groups: kernels know their threads' numbers as on a card."""
    monkeypatch.setattr(wp.config, "enable_cpu_blocks", True)
    alone, groups = (CudaEngine(scene(), device="cpu") for _ in range(2))
    groups.program.lanes, groups.program.stride = 4, 12
    groups.program.load()
    for engine in (alone, groups):
        engine.advance(0.03)
    assert alone.steps.count == groups.steps.count
    here, there = alone.snapshot(), groups.snapshot()
    assert np.abs(here.position - there.position).max() < 5e-6 * CELL
    mine, theirs = alone.measure(), groups.measure()
    assert mine.plane_impulse[0, :, 2].max() > 0.1
    for name in ("pair_impulse", "plane_impulse", "external_impulse", "friction_loss", "elastic"):
        assert getattr(theirs, name) == pytest.approx(getattr(mine, name), rel=1e-4, abs=1e-6)


# ---------------------------------------------------------------- sorting


def in_task(engine):
    """Which particles are in the block of the task they belong to; each is in one task."""
    a = engine.arrays
    count = flag(engine, layout.FLAG_TASKS)
    home, first, last = (getattr(a.grid, f"task_{name}").numpy()[:count] for name in ("home", "first", "last"))
    task = np.repeat(np.arange(count), last - first)
    order = np.concatenate([np.arange(*pair) for pair in zip(first, last, strict=True)])
    assert sorted(order) == list(range(a.particles.count)) and (last - first).max() <= layout.TASK
    cell = particle_memory.read_rows(a.particles, "cell")[order]
    return (cell >> 2 == a.grid.where.numpy()[home[task]]).all(axis=1)


def test_particles_are_sorted_within_a_frame_when_a_tenth_has_strayed():
    """In one frame they cross 40 cells; unsorted, none would be in its block at the end."""
    engine = flying(velocity=(8.0, 1.0, 0.0))
    assert in_task(engine).all()
    engine.advance(0.1)
    assert engine.snapshot().position[:, 0].mean() > 39 * CELL
    away = ~in_task(engine)
    assert flag(engine, layout.FLAG_STRAYS) == away.sum()
    assert away.mean() <= OUT_OF_BLOCK_FRACTION + 0.05


def test_sorting_what_is_sorted_changes_nothing():
    engine = flying(velocity=(8.0, 1.0, 0.0))
    engine.advance(0.013)
    engine.program.arrange()
    once = engine.arrays.particles.words.numpy().copy()
    engine.program.arrange()
    assert np.array_equal(once, engine.arrays.particles.words.numpy())
