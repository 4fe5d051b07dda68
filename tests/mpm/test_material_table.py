"""One table says what bodies are made of, and all engines read it."""

from dataclasses import replace

import numpy as np
import pytest
from laws.bodies import Stuff, box, problem

from corporeal.core.errors import SimulationError
from corporeal.core.types import Law
from corporeal.mpm.constants import VAST
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.cuda import layout
from corporeal.mpm.cuda.engine import CudaEngine
from corporeal.mpm.material_table import MaterialTable
from corporeal.mpm.state import ParticleConstants

SAND = Stuff(law=Law.DRUCKER_PRAGER, young_pa=1e6, friction_angle=0.6, cohesion=300.0)
METAL = Stuff(law=Law.VON_MISES, young_pa=2e6, yield_stress=1e4, hardening=5e4)
SHARED = ("LAW MU LAMBDA YIELD HARD CONE APEX DRAG INDEX FORGET DENSITY RIGID").split()
"""Columns that both fast engines have, at the same places."""


def mixed(**given):
    """A body of two materials, and a rigid one."""
    size = (0.04, 0.04, 0.04)
    soft = box((0, 0, 0.05), size, 0.01, stuff=SAND)
    half, metal = soft.position[:, 0] > 0, box((0, 0, 0.05), size, 0.01, stuff=METAL)
    names = "law young_pa poisson yield_stress hardening friction_angle cohesion loss".split()
    soft = replace(soft, **{n: np.where(half, getattr(metal, n), getattr(soft, n)) for n in names})
    return problem(soft, box((0, 0, 0.15), size, 0.01, rigid=True), cell=0.02, **given)


def test_fast_engines_copy_the_same_rows():
    given = mixed()
    table, row = MaterialTable.of(given)
    assert sorted(table.law[table.body == 0]) == [Law.DRUCKER_PRAGER.value, Law.VON_MISES.value]
    cpu = CpuEngine(given, threads=1).material[0].table
    cuda = CudaEngine(given, device="cpu").arrays.particles.table.numpy()[: len(table.body)]
    here = [int(getattr(layout, name)) for name in SHARED]
    assert here == list(range(len(SHARED)))
    np.testing.assert_array_equal(cpu[:, here], cuda[table.body == 0][:, here])
    matter = ParticleConstants.of(given)
    np.testing.assert_array_equal(matter.mu.astype(np.float32)[: len(row)], cuda[row, layout.MU])


def test_the_numbers_are_those_of_the_field():
    given = mixed()
    table, row = MaterialTable.of(given)
    sand = table.law == Law.DRUCKER_PRAGER.value
    bulk = SAND.young_pa / (3 * (1 - 2 * SAND.poisson))
    assert table.apex[sand] == pytest.approx(300.0 / np.tan(0.6) / bulk)
    assert table.cone[sand] == pytest.approx(np.sqrt(2) / 3 * np.sin(0.6))
    soft = ~table.rigid
    assert table.modulus[~sand & soft] == pytest.approx(METAL.p_wave_modulus)
    assert not table.modulus[table.rigid].any() and (table.flip_damping_rate[table.rigid] == VAST).all()
    assert np.array_equal(table.body[row], np.repeat([0, 1], [len(b.position) for b in given.bodies]))


def test_all_that_share_a_field_forget_alike():
    """Or momentum would go astray: the fastest rate is everybody's."""
    apart, _ = MaterialTable.of(mixed())
    assert len(set(apart.flip_damping_rate[~apart.rigid])) == 1
    shared, _ = MaterialTable.of(mixed(contact="single"))
    assert set(shared.flip_damping_rate) == {VAST}


@pytest.mark.parametrize(("poisson", "mean"), [(0.3, False), (0.4, False), (0.41, True)])
def test_pressure_is_a_mean_above_a_poissons_ratio_of_two_fifths(poisson, mean):
    """At 0.4 itself engines of different precision decided differently."""
    for young_pa in (1e5, 2.3e6, 1e9):
        stuff = Stuff(young_pa=young_pa, poisson=poisson)
        table, _ = MaterialTable.of(problem(box((0, 0, 0), (0.04,) * 3, 0.01, stuff=stuff), cell=0.02))
        assert table.uses_mean_dilatation.all() == table.uses_mean_dilatation.any() == mean


def test_what_flows_keeps_its_own_pressure():
    stuff = replace(METAL, poisson=0.45)
    table, _ = MaterialTable.of(problem(box((0, 0, 0), (0.04,) * 3, 0.01, stuff=stuff), cell=0.02))
    assert table.flows.all() and not table.uses_mean_dilatation.any()


@pytest.mark.parametrize("number", [-1, len(Law), 99])
def test_a_law_that_there_is_not_is_refused_with_the_menu(number):
    body = box((0, 0, 0), (0.04,) * 3, 0.01)
    body.law[:] = number
    with pytest.raises(SimulationError, match=rf"unknown law {number}\. .*0 \(corotated\)"):
        MaterialTable.of(problem(body, cell=0.02))
