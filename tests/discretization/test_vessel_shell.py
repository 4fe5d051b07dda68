"""Open ware that pictures drew as a lump is a vessel: matter along its outside, and room in it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Law, Material, MaterialField, PartDescription, Structure
from corporeal.discretization.mesh_measures import measure_object
from corporeal.discretization.part_model import infer_structure, part_specification
from corporeal.discretization.vessel_shell import hollow_all_vessels, vessel_shell_surface
from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.mesh_queries import QueryMesh

STEEL = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0, yield_stress=2.5e8)
WARE = PartDescription("ware", "steel", "sheet", wall_unseen=True)
WALL = 4e-3
CUP = [(0, 0), (0.04, 0), (0.045, 0.1)]
"""Radius and height of its outside [m]."""
FILLED = {
    "to its rim": [(0, 0.1)],
    "over its rim": [(0.035, 0.11), (0.02, 0.117), (0, 0.12)],
    "by half": [(0.041, 0.1), (0.0385, 0.05), (0, 0.05)],
}


def drawn(filled):
    mesh = trimesh.creation.revolve(np.array([*CUP, *FILLED[filled]]), sections=48)
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64))


def anatomy_of(mesh):
    part = np.zeros(len(mesh.triangles), dtype=np.int64)
    return measure_object(mesh.vertices, mesh.triangles, part, np.random.default_rng(1))


def made_of(words):
    none = np.zeros((2, 2))
    return MaterialField((STEEL,), (Structure("shell", WALL),), (words,), none, none)


@pytest.mark.slow
@pytest.mark.parametrize("filled", FILLED)
def test_a_cup_that_is_filled_in_holds_what_a_cup_of_its_wall_does(filled):
    before = anatomy_of(drawn(filled))
    (cup,) = hollow_all_vessels([before], made_of(WARE))[0].members
    room = np.pi / 3 * 0.096 * (0.0362**2 + 0.041**2 + 0.0362 * 0.041)
    assert before.members[0].hollow < 0.6 * room
    assert cup.hollow == pytest.approx(room, rel=0.06)
    assert not cup.shape.inside(np.array([[0, 0, 0.01], [0, 0, 0.08], [0, 0, 0.11]])).any()
    assert cup.shape.inside(np.array([[0, 0, 0.002], [0.0405, 0, 0.05]])).all()


@pytest.mark.slow
@pytest.mark.parametrize("filled", FILLED)
def test_it_weighs_and_its_wall_is_as_before(filled):
    field, anatomy = made_of(WARE), anatomy_of(drawn(filled))
    before = infer_structure(anatomy.members[0], part_specification(0, field))
    now = infer_structure(hollow_all_vessels([anatomy], field)[0].members[0], part_specification(0, field))
    assert now.mass == pytest.approx(before.mass, rel=1e-9)
    assert (now.thickness, now.whose, now.shown) == (before.thickness, before.whose, 0.0)


def test_the_surface_of_a_vessel_is_one_and_closed_and_lies_in_what_was_drawn():
    mesh = drawn("over its rim")
    found = vessel_shell_surface(QueryMesh(mesh), mesh, WALL)
    welded = trimesh.Trimesh(found.vertices, found.triangles)
    assert welded.is_watertight and welded.body_count == 1
    assert signed_volume(found) == pytest.approx(WALL * 0.0317, rel=0.06)
    out = QueryMesh(mesh).closest(found.vertices)[0][~QueryMesh(mesh).inside(found.vertices)]
    assert out.max() < 1e-4


def test_what_is_no_ware_from_pictures_stays_as_it_is_drawn():
    anatomy = anatomy_of(drawn("to its rim"))
    for words in (replace(WARE, wall_unseen=False), replace(WARE, structure="shell")):
        assert hollow_all_vessels([anatomy], made_of(words))[0] is anatomy
