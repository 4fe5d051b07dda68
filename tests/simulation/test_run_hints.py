"""What a person is told who may have expected something else."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import Finish, Push, Scene, SceneObject, Surface, Wind
from corporeal.simulation.run_hints import run_hints
from sample_findings import audit_finding, object_outcome, outcome

CORNERS = np.eye(3)
FACES = np.array([[0, 1, 2]])


def shelf(*names, push=None, wind=None):
    """One object whose pieces are called so."""
    thing = SceneObject("shelf_0", "shelf", 1.0, push=push, wind=wind)
    pieces = tuple(Surface(name, 0, 0, CORNERS, FACES) for name in names)
    return Scene("shelf", "shelf.glb", (thing,), pieces, (Finish("oak"),))


def seen(**what):
    return outcome({"shelf_0": object_outcome(**what)})


FALLS = {"moved_m": (0.0, 0.0, -0.5)}


def test_nothing_is_reported_of_one_piece_that_moves():
    assert run_hints(shelf("boards"), seen(**FALLS), divided=False) == ()


def test_several_named_pieces_of_a_file_are_reported_to_stay_together():
    many = shelf("boards", "book 0", "book 1", "vase")
    (said,) = run_hints(many, seen(**FALLS), divided=False)
    assert "4 named pieces (boards, book 0, book 1, …)" in said and "--objects nodes" in said
    assert run_hints(many, seen(**FALLS), divided=True) == (), "it was asked for"
    two = replace(many.objects[0], name="book_0")
    assert run_hints(replace(many, objects=(*many.objects, two)), seen(**FALLS), divided=False) == ()
    assert run_hints(shelf("Mesh_01", "Mesh_02"), seen(**FALLS), divided=False) == ()


@pytest.mark.parametrize(
    ("moves", "told"),
    [
        ({}, True),
        ({"moved_m": (0.0, 0.0, -5e-4)}, True),
        ({"moved_m": (0.0, 0.01, 0.0)}, False),
        ({"turned_deg": 20.0}, False),
        ({"shape_error_max": 0.1}, False),
    ],
)
def test_that_nothing_moves_is_reported_only_where_nothing_does(moves, told):
    said = run_hints(shelf("boards"), seen(**moves), divided=False)
    assert any("Nothing moves" in s for s in said) == told


def test_a_push_or_wind_that_moves_nothing_is_named():
    push, wind = Push((1.0, 0.0, 0.0)), Wind((1.0, 0.0, 0.0))
    (said,) = run_hints(shelf("boards", push=push), seen(), divided=False)
    assert said.startswith("shelf_0 is pushed and yet not moved")
    (said,) = run_hints(shelf("boards", wind=wind), seen(), divided=False)
    assert said.startswith("shelf_0: the wind is too weak")
    assert run_hints(shelf("boards", push=push), seen(**FALLS), divided=False) == ()


def test_parts_that_are_softer_without_a_visible_effect_are_told_in_one_hint():
    """The duck of the first demo moves at 0.8 % of its E, and nothing in the terminal said so."""
    mild = audit_finding(severity="minor", part="body", stiffness_ratio=0.0078)
    milder = audit_finding(severity="minor", part="beak", stiffness_ratio=0.3)
    swaying = audit_finding(severity="minor", part="leaves", stiffness_ratio=0.0)
    (said,) = run_hints(shelf("boards"), seen(**FALLS), divided=False, findings=(mild, milder, swaying))
    assert said.startswith("3 parts are simulated with other values")
    assert "most of all shelf_0: body, with 0.0078 of its Young's modulus" in said
    grave = audit_finding()
    assert run_hints(shelf("boards"), seen(**FALLS), divided=False, findings=(grave, swaying)) == ()


def test_what_stands_still_need_not_be_of_a_file():
    """Of photographs it was said that everything stands at rest as in the file."""
    (said,) = run_hints(shelf("boards"), seen(moved_m=(0.0, 0.0, 0.0)), divided=False)
    assert said.startswith("Nothing moves: everything stands at rest, as it did at the start.")
