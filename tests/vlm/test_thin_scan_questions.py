"""Questions that a mesh calls for: holes that it shows, and a scan that is thicker than the thing.

``wording_2026_11b`` keeps the question about materials as it was before.
"""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import trimesh

from corporeal.core.errors import UserError
from corporeal.core.types import Finish, PartDescription, Scene, SceneObject, Surface
from corporeal.description.describe_config import DescribeConfig
from corporeal.discretization.drawn_thickness import NO_DRAWN_SHAPE, measure_drawn_shape
from corporeal.pipeline.stages.describe import describe
from corporeal.vlm import Reply
from corporeal.vlm.answer_checks import thickness_complaints
from corporeal.vlm.answer_schemas import AllowedNames, MaterialsAnswer, ThicknessAnswer
from corporeal.vlm.interpret_answers import apply_real_shares, millimetres_text, strange_share_notes
from corporeal.vlm.interview import NO_SHARES_INSTRUCTION, Interview, InterviewSubject
from corporeal.vlm.prompt_files import read_prompt
from corporeal.vlm.recordings import ReplayClient, write_recording

OLD = Path(__file__).parent / "wording_2026_11b" / "materials.md"
NEW = files("corporeal.description").joinpath("prompts", "materials.md")
FACTS = {"count": "4", "name": "thing", "class_name": "object", "sides": "9 × 9 × 9 cm"}
NAMES = AllowedNames(str, str, bool)
HALF = {"part": "blade", "low": 0.4, "likely": 0.5, "high": 0.6, "reason": "1 mm, drawn as 2."}


def surface(mesh):
    points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    return Surface("thing", 0, 0, points, triangles)


def blade(share=0.1):
    return trimesh.creation.icosphere(4, 0.05).apply_scale((1, 1, share))


def tube():
    return trimesh.creation.annulus(0.03, 0.04, 0.08)


class Noting:
    """Answers nothing but keeps what was asked."""

    looks = False

    def __init__(self, answer):
        self.answer, self.asked = answer, []

    def ask(self, question, answer, check=None):
        self.asked.append(question)
        return Reply(answer.model_validate(self.answer), "model", "nobody")


def about_materials(drawing, text):
    """The question about materials as it is put of what a mesh draws."""
    model = Noting({"parts": []})
    subject = InterviewSubject("s", FACTS["name"], FACTS["class_name"], FACTS["sides"], drawn=drawing)
    prompts = {"materials": read_prompt(text)}
    Interview(model, model, prompts, replace(subject, count=4)).materials({"thing": ""}, NAMES, {}, shared=False)
    return model.asked[0].prompt


def test_holes_that_the_mesh_shows_are_not_counted_again():
    shown = measure_drawn_shape([surface(tube())])
    assert shown.hollowed
    asked = about_materials(shown, NEW)
    assert "holes, gaps and hollows that the pictures show are modelled: they are already" in asked
    assert "a solid with large holes that the model does not show;" in asked
    assert "already taken off" not in about_materials(shown, OLD)


def test_of_what_shows_no_holes_nothing_else_is_asked_than_before():
    assert measure_drawn_shape([surface(trimesh.creation.icosphere(3, 0.05))]) == NO_DRAWN_SHAPE
    assert about_materials(NO_DRAWN_SHAPE, NEW) == about_materials(NO_DRAWN_SHAPE, OLD)
    assert NO_SHARES_INSTRUCTION in about_materials(NO_DRAWN_SHAPE, NEW)


def test_an_open_mesh_encloses_nothing_and_shows_no_holes():
    mesh = tube()
    mesh.update_faces(mesh.triangles_center[:, 2] < 0.02)
    assert measure_drawn_shape([surface(mesh)]) == NO_DRAWN_SHAPE


def test_only_a_thin_scan_is_thin():
    thin = measure_drawn_shape([surface(blade())], scale=2.0).thin
    edge = np.median(blade().edges_unique_length)
    assert thin is not None
    assert thin.edge == pytest.approx(edge / 2, rel=0.05)
    assert 0 < thin.behind[0] < thin.behind[1] < thin.behind[2] <= 0.005 * (1 + 1e-9)
    assert thin.doubt > 0.1
    assert measure_drawn_shape([surface(blade(1.0))]).thin is None, "a ball is thick"
    coarse = trimesh.creation.icosphere(3, 0.05).apply_scale((1, 1, 0.1))
    assert measure_drawn_shape([surface(coarse)]).thin is None, "1,280 triangles are no scan"


class Looking(Noting):
    """Says that it is one blade of steel, and that half of what is drawn is real."""

    def __init__(self, built="solid"):
        part = {"name": "blade", "look": "flat", "seen": "yes"}
        way = {"material": "steel", "built": built, "probability": 1.0, "reason": "It shines."}
        self.answers = {
            "parts": {"object": "a blade", "decompositions": [{"parts": [part], "why": "One."}]},
            "materials": {"parts": [{"part": "blade", "ways": [way]}]},
            "thickness": {"parts": [HALF]},
            "mass": {"low_kg": 0.01, "likely_kg": 0.02, "high_kg": 0.03, "reason": "Thin."},
            "extents": {"classes": []},
        }
        super().__init__(None)

    def ask(self, question, answer, check=None):
        self.asked.append(question)
        if question.task == "placement":
            raise UserError("stop here")
        return Reply(answer.model_validate(self.answers[question.task]), "model", "nobody")


def asked_about(mesh, model, monkeypatch):
    things = (SceneObject("blade_0", "blade", 0.1),)
    scene = Scene("one", "", things, (surface(mesh),), (Finish("plain"),))
    scene = replace(scene, surfaces=(replace(scene.surfaces[0], name="blade"),))
    monkeypatch.setattr("corporeal.pipeline.stages.describe.connect_vlm", lambda *a: model)
    with pytest.raises(UserError, match="stop here"):
        describe(scene, DescribeConfig(vlm="noting:x"))
    return [q for q in model.asked if q.task == "thickness"]


def test_how_thick_a_thin_scan_really_is_is_asked_of_what_fills_it(monkeypatch):
    (question,) = asked_about(blade(), Looking(), monkeypatch)
    assert "It was found to be: a blade." in question.prompt
    assert "Parts: blade (flat)" in question.prompt
    edge = millimetres_text(float(np.median(blade().edges_unique_length)))
    assert f"triangles with sides of about {edge}." in question.prompt
    assert not asked_about(blade(1.0), Looking(), monkeypatch)
    assert not asked_about(blade(), Looking("sheet"), monkeypatch)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"low": 0.7}, "in this order"),
        ({"high": 60.0}, "not a percentage"),
        ({"low": 0.001}, "is not between 0.1 and 1.25"),
        ({"part": "handle"}, "Answer for exactly these names"),
    ],
)
def test_an_absurd_share_is_asked_for_again(change, told):
    wrong = ThicknessAnswer.model_validate({"parts": [HALF | change]})
    assert told in " ".join(thickness_complaints(wrong, ["blade"]))
    assert not thickness_complaints(ThicknessAnswer.model_validate({"parts": [HALF]}), ["blade"])


def test_a_share_far_from_what_a_fine_scan_draws_is_reported():
    said = ThicknessAnswer.model_validate({"parts": [HALF]})
    (warning,) = strange_share_notes(said, 0.02)
    assert "50%" in warning
    assert "2%" in warning
    assert not strange_share_notes(said, 0.3)


def test_a_share_goes_to_its_part_and_to_the_piece_that_matters_most():
    said = ThicknessAnswer.model_validate({"parts": [HALF]})
    pieces = (PartDescription("handle", "nylon", volume_share=0.6), PartDescription("blade", "steel", volume_share=0.4))
    whole = apply_real_shares(PartDescription("scissors", "nylon", pieces=pieces), said, "recording")
    assert whole.swelling is None
    assert [p.swelling and p.swelling.likely for p in whole.pieces] == [None, 0.5]
    alone = apply_real_shares(PartDescription("blade", "steel"), said, "recording").swelling
    assert alone is not None
    assert (alone.low, alone.likely, alone.high, alone.answered_by) == (0.4, 0.5, 0.6, "recording")


def test_an_answer_to_the_old_wording_is_refused_with_one_sentence(tmp_path):
    model = Noting({"parts": []})
    shown = replace(NO_DRAWN_SHAPE, hollowed=True)
    subject = InterviewSubject("s", "thing", "object", "9 × 9 × 9 cm", drawn=shown)
    for text in (OLD, NEW):
        prompts = {"materials": read_prompt(text)}
        Interview(model, model, prompts, subject).materials({"thing": ""}, NAMES, {}, shared=False)
    old, new = model.asked
    write_recording(tmp_path, old, MaterialsAnswer(parts=[]), "nobody")
    with pytest.raises(UserError, match="are to another wording of the questions"):
        ReplayClient(str(tmp_path)).ask(new, MaterialsAnswer)
