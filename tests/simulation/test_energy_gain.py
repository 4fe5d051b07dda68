"""Energy that nothing gave is a failure of the run, said with whose and when."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from laws.bodies import Stuff, ball, box, floor, problem

from corporeal.core.audit_data import EnergyGain, Expectation
from corporeal.core.errors import SimulationError
from corporeal.core.types import Ledger
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.simulation.audit import reject_expectations
from corporeal.simulation.audit_messages import breach_messages
from corporeal.simulation.energy_gain import EnergyWatch, energy_gain
from corporeal.simulation.ledger_row import ledger_row
from sample_findings import run_audit

NAMES = ("ball", "block")


def row(time, elastic, touched=np.nan, work=0.0):
    """Two objects of 2 and 4 J at the start; the second gets strained."""
    last = np.full((3, 3), np.nan)
    last[1, 2] = last[2, 1] = touched
    said = {
        "time": np.array(time),
        "mass": np.array([1.0, 2.0]),
        "kinetic": np.array([2.0, 4.0]),
        "elastic": np.array([0.0, elastic]),
        "potential": np.array([0.0, 1.0]),
        "push_work": np.array(work),
        "last_contact": last,
    }
    return replace(nothing(), **said)


@cache
def nothing():
    """Ledger of two objects on one plane that never moved."""
    given = problem(*(box((x, 0, 1), (0.04,) * 3, 0.02) for x in (0.0, 1.0)), cell=0.04, planes=[floor()])
    run = CpuEngine(given, threads=1)
    return ledger_row(given, run.snapshot(), run.measure(), run.steps)


def seen(*rows):
    watch = EnergyWatch(NAMES, 10.0, 0.01)
    for one in rows:
        watch.see(one)


def test_strain_that_grows_in_flight_ends_the_run_with_whose_and_when():
    rows = [row(0.1 * k, 0.01 * 1.5**k) for k in range(8)]
    seen(*rows[:4])
    with pytest.raises(SimulationError, match=r"At t = 0\.4 s 'block' had gained 1\.0% of its"):
        seen(*rows)


def test_slow_growth_over_many_frames_adds_up():
    with pytest.raises(SimulationError, match="'block'"):
        seen(*(row(0.1 * k, 0.005 * k) for k in range(20)))


def test_what_a_touch_or_a_push_gives_is_no_gain():
    seen(row(0.0, 0.0), row(0.1, 1.0, touched=0.05), row(0.2, 1.0, touched=0.05))
    seen(row(0.0, 0.0), row(0.1, 1.0, work=1.0), row(0.2, 1.0, work=1.0))
    # One in the first step after a frame bears that frame's time.
    seen(row(0.0, 0.0), row(0.1, 0.0), row(0.2, 1.0, touched=0.1))
    # A touch excuses its own frames and no later ones.
    with pytest.raises(SimulationError, match="'block'"):
        seen(row(0.0, 0.0), row(0.1, 1.0, touched=0.05), row(0.2, 1.1, touched=0.05))


def test_a_ball_that_falls_bounces_and_rings_passes():
    cell = 0.02
    soft = ball((0.0, 0.0, 0.12), 0.05, cell / 2, stuff=Stuff(young_pa=1e5), velocity=(0, 0, -2))
    given = problem(soft, cell=cell, planes=[floor()], gravity=(0.0, 0.0, -9.81))
    run, watch = CpuEngine(given, threads=1), EnergyWatch.of(given)
    assert watch is not None
    for time in np.linspace(0.0, 0.25, 26):
        if time > 0.0:
            run.advance(float(time))
        watch.see(ledger_row(given, run.snapshot(), run.measure(), run.steps))
    assert run.measure().plane_impulse[0, 0, 2] > 0.0
    assert EnergyWatch.of(replace(given, contact="single")) is None


def test_the_audit_says_who_gained_and_from_when_on():
    rows = [row(0.1 * k, 0.0 if k < 3 else 5.0, touched=0.0) for k in range(6)]
    ledger = Ledger(**{f.name: np.stack([getattr(r, f.name) for r in rows]) for f in fields(Ledger)})
    balance = (ledger.kinetic + ledger.elastic).sum(axis=1)
    found = energy_gain(ledger, NAMES, balance, allowed=0.06)
    assert (found.object, found.frame, found.time) == ("block", 3, pytest.approx(0.3))
    assert energy_gain(ledger, NAMES, balance, allowed=6.0) is None


def test_no_expectation_is_met_by_a_run_that_gained_energy():
    sound = run_audit()
    wanted = Expectation("It bounces", "40 %", "above 10 %", True)
    assert reject_expectations([wanted], sound) == (wanted,)
    grown = replace(sound, mechanical_growth=46.8, energy_gain=EnergyGain("ball_0", 36, 0.6))
    (doubted,) = reject_expectations([wanted], grown)
    assert not doubted.met and doubted.value == "40 %; but energy grew by 4680.0%"
    (said,) = breach_messages(grown)
    assert "energy grew by 4680.0%" in said
    assert "in ball_0, from 0.60 s on" in said
