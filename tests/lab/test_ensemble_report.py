"""Ensembles of one run: drawn, simulated, resumed, and told as a spread."""

import json
import sys

import numpy as np
import pytest
import trimesh

from corporeal import cli
from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import SimulationError, UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.lab.evaluation import outcome_ensemble
from corporeal.lab.evaluation import outcome_ensemble as ensembles
from corporeal.lab.evaluation.outcome_ensemble import (
    SPREAD_QUANTITIES,
    Ensemble,
    MemberOutcome,
    QuantitySpread,
    outcome_spread,
    simulate_ensemble,
)
from corporeal.pipeline.run_pipeline import Settings, run


def silent(verb):
    return lambda fraction, words: None


def a_falling_ball():
    mesh = trimesh.creation.icosphere(2, 0.05)
    extras = {"substance": "natural_rubber"}
    mesh.apply_translation((0, 0, 0.07))
    surface = Surface("ball", 0, 0, mesh.vertices, mesh.faces, extras=extras)
    thing = SceneObject("ball", "ball", 0.1, velocity=(0.0, 0.0, -1.0))
    return Scene("ball", "", (thing,), (surface,), (Finish("red"),), duration=0.04, fps=25)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    write_glb(folder / "ball.glb", a_falling_ball())
    run([folder / "ball.glb"], folder / "ball", Settings(), silent, until="simulate")
    return folder / "ball"


@pytest.fixture(scope="module")
def made(ran):
    return simulate_ensemble(ran, 3, 0, None, silent)


@pytest.mark.slow
def test_members_differ_and_stay_in_their_ranges(ran, made):
    assert [member.number for member in made.members] == [0, 1, 2]
    young_pa = [member.drawn[0]["young_pa"] for member in made.members]
    assert len(set(young_pa)) == 3
    assert all(1.5e6 <= y <= 2.5e6 for y in young_pa)
    masses = [member.objects["ball"]["mass_kg"] for member in made.members]
    density = [member.drawn[0]["density"] for member in made.members]
    assert masses == pytest.approx([d * trimesh.creation.icosphere(2, 0.05).volume for d in density])
    told = made.of("ball", "mass_kg")
    assert told.smallest <= told.low <= told.median <= told.high <= told.largest
    assert told.count == 3
    assert from_plain(Ensemble, store.read_json(ran / "ensemble.json")) == made
    assert not list((ran / "ensemble").rglob("frames/*.npz")), "frames were kept"


def test_what_is_done_is_not_done_again_and_more_members_add_to_it(ran, made, monkeypatch):
    def never(*_):
        raise AssertionError("simulated twice")

    with monkeypatch.context() as patched:
        patched.setattr(ensembles, "simulate", never)
        assert simulate_ensemble(ran, 3, 0, None, silent) == made
    told = []
    more = simulate_ensemble(ran, 4, 0, None, lambda verb: lambda share, words: told.append((share, words)))
    assert more.members[:3] == made.members
    shares = [share for share, words in told if "of 4" in words]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert told[-1][1].startswith("4 of 4")


def test_a_member_that_was_cut_off_goes_on(ran, made, monkeypatch):
    calls, real = [], ensembles.simulate

    def cut(scene, particles, field, config, folder, progress):
        calls.append(folder.name)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(scene, particles, field, config, folder, progress)

    monkeypatch.setattr(ensembles, "simulate", cut)
    with pytest.raises(KeyboardInterrupt):
        simulate_ensemble(ran, 2, 7, None, silent)
    again = simulate_ensemble(ran, 2, 7, None, silent)
    assert calls == ["000", "001", "001"]
    assert again.members != made.members


def test_a_member_that_breaks_is_reported_and_the_others_count(ran, monkeypatch, tmp_path):
    real = ensembles.simulate

    def breaks(scene, particles, field, config, folder, progress):
        if folder.name == "001":
            raise SimulationError("It burst.")
        return real(scene, particles, field, config, folder, progress)

    monkeypatch.setattr(ensembles, "simulate", breaks)
    result = simulate_ensemble(ran, 2, 9, None, silent)
    assert outcome_ensemble.failed_members(result) == ["Member 1 stopped: It burst."]
    assert result.of("ball", "mass_kg").count == 1
    outcome_ensemble.spread_figure(result, tmp_path / "spread.png")
    assert (tmp_path / "spread.png").read_bytes()[:4] == b"\x89PNG"


def test_the_spread_is_that_of_the_members():
    rows = [MemberOutcome(v, (), {"a": {"rebound_m": float(v)}}) for v in range(101)]
    rows += [MemberOutcome(101, (), {"a": {"rebound_m": None}}), MemberOutcome(102, (), {}, "burst")]
    (told,) = outcome_spread({"a": {"rebound_m": 7.0}}, rows)["a"].values()
    assert told == QuantitySpread(chosen=7.0, low=5.0, median=50.0, high=95.0, smallest=0.0, largest=100.0, count=101)
    (nothing,) = outcome_spread({"a": {"rebound_m": None}}, rows[101:])["a"].values()
    assert nothing == QuantitySpread(chosen=None, count=0)


@pytest.mark.parametrize("samples", [0, -1, 10_000])
def test_a_senseless_number_of_samples_is_refused(ran, samples):
    with pytest.raises(UserError, match="--samples"):
        simulate_ensemble(ran, samples, 0, None, silent)


def test_the_verb_writes_table_data_and_figure(ran, made, monkeypatch, capsys):
    words = ["corporeal", "simulate", str(ran), "--samples", "3"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 0
    said = capsys.readouterr().out
    for quantity in ("mass [kg]", "rebound [m]", "deepest squeeze [m]"):
        assert quantity in said
    assert json.loads((ran / "ensemble.json").read_text())["samples"] == 3
    assert (ran / "ensemble.png").read_bytes()[:4] == b"\x89PNG"
    heights = [member.objects["ball"]["rebound_m"] for member in made.members]
    assert np.ptp(heights) >= 0
    assert set(made.spread["ball"]) == set(SPREAD_QUANTITIES)
