"""Materials and values in one question: what was said is put into the ranges that are asked for."""

import json

import pytest
from one_question import OneQuestion, ValuedAnswer

from corporeal.vlm import Question
from corporeal.vlm.answer_schemas import MaterialsAnswer, ValueAnswer
from corporeal.vlm.human_client import PendingQuestionsError

SAID = {
    "parts": [
        {
            "part": "cup",
            "ways": [
                {"material": "steel", "built": "sheet", "probability": 0.3, "reason": "It shines.",
                 "density": 7.8, "wall_mm": 0.8},
                {"material": "ceramic", "built": "sheet", "probability": 0.7, "reason": "A glaze.",
                 "density": 2400.0, "wall_mm": 4.0},
            ],
        }
    ]
}  # fmt: skip
RANGES = """Part cup:
- density: Density: 2000 to 2600 kg/m³; usually 2300 (place 0.50)
- young: Young's modulus: 10 to 100 GPa, logarithmic scale; usually 60 (place 0.78)
- shell_thickness: Wall thickness: 2 to 8 mm; usually 5 (place 0.50)

Part cup, way 2:
- density: Density: 7750 to 7900 kg/m³; usually 7850 (place 0.67)"""


@pytest.fixture
def asked(tmp_path):
    one = OneQuestion(str(tmp_path))
    question = Question("materials", "What is it made of?", "one/cup")
    with pytest.raises(PendingQuestionsError):
        one.ask(question, MaterialsAnswer)
    (page,) = (tmp_path / "questions").glob("*.json")
    assert "wall_mm" in page.with_suffix(".md").read_text(encoding="utf-8")
    page.write_text(json.dumps(SAID), encoding="utf-8")
    return one, question


def test_the_materials_come_without_the_values(asked):
    one, question = asked
    reply = one.ask(question, MaterialsAnswer)
    assert [w.material for w in reply.answer.parts[0].ways] == ["steel", "ceramic"]
    assert one.said["one/cup"] == ValuedAnswer.model_validate(SAID)


def test_values_go_to_the_way_they_were_given_for_and_stay_inside_its_range(asked):
    one, question = asked
    one.ask(question, MaterialsAnswer)
    outside = OneQuestion.characters["outside"]
    placing = Question("placement", "Where?", "one/cup", lists={"ranges": RANGES})
    first, second = one.ask(placing, ValueAnswer).answer.parts
    assert {v.quantity: v.value for v in first.values} == {
        "density": 2400.0,
        "young": 60.0,  # nobody said: usual
        "shell_thickness": 4.0,
    }
    assert [v.value for v in second.values] == [7750.0]
    assert OneQuestion.characters["outside"] == outside + 1
