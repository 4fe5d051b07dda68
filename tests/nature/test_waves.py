"""Sound in solids."""

import numpy as np
import pytest
from laws.bodies import Stuff, box, problem

LENGTH, YOUNG, DENSITY = 1.0, 1e6, 1000.0
PERIOD = 2 * LENGTH * np.sqrt(DENSITY / YOUNG)


def ringing_bar(cells, periods, build, **more):
    """A free bar, ν = 0, in its first mode: when its velocity passes zero, and its energy."""
    cell = LENGTH / cells
    stuff = Stuff(young=YOUNG, poisson=0.0, density=DENSITY)
    width = 2 * cell
    bar = box((LENGTH / 2, width / 2, width / 2), (LENGTH, width, width), cell / 2, stuff=stuff)
    mode = np.cos(np.pi * bar.position[:, 0] / LENGTH)
    bar.velocity[:, 0] = 0.01 * mode
    run = build(problem(bar, cell=cell, **more))
    first = run.measure()
    times = np.linspace(0, periods * PERIOD, 24 * periods + 1)
    amplitude = [np.mean(run.snapshot().velocity[:, 0] * mode)]
    for time in times[1:]:
        run.advance(time)
        amplitude.append(np.mean(run.snapshot().velocity[:, 0] * mode))
    a = np.array(amplitude)
    k = np.flatnonzero((a[:-1] > 0) & (a[1:] <= 0))
    crossing = times[k] + (times[k + 1] - times[k]) * a[k] / (a[k] - a[k + 1])
    last = run.measure()
    lost = (last.kinetic + last.elastic).sum() / (first.kinetic + first.elastic).sum()
    return (crossing[-1] - crossing[0]) / (len(crossing) - 1), lost


def test_a_free_bar_rings_with_the_period_of_its_sound(patient_engine):
    period, energy = ringing_bar(20, 3, patient_engine)
    assert period == pytest.approx(PERIOD, rel=0.015)
    assert 0.9 < energy <= 1.001


def test_a_finer_bar_rings_truer_and_longer(fast_engine):
    period, energy = ringing_bar(40, 6, fast_engine)
    assert period == pytest.approx(PERIOD, rel=0.005)
    assert 0.97 < energy <= 1.001
    _, dull = ringing_bar(40, 6, fast_engine, transfer="apic")
    assert dull < energy
