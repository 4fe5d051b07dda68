"""Ask for materials and their values in one question, where the product asks two.

    python benchmarks/one_question.py MODELS --answers FOLDER [--truth masses.csv]

MODELS is a folder of models, pictured without names. The questions are the product's, but the one
about materials also wants density and wall of each way as plain values, since it comes before
anybody knows which ranges matter; a value outside its material's measured range counts as that end.
Pages wait in FOLDER for whoever answers, as with ``--vlm ask:FOLDER``; with all answers the ladder
is printed, and how many characters were asked and answered. Compare it with ``evaluate mass``.
"""

import argparse
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from corporeal import vlm
from corporeal.core.errors import UserError
from corporeal.description.describe_config import DescribeConfig
from corporeal.lab.evaluation.mass_evaluation import MassConfig, compare_masses, predict_masses
from corporeal.lab.evaluation.measured_masses import objects_to_weigh
from corporeal.pipeline.stages.ground import GroundConfig
from corporeal.vlm.answer_schemas import (
    MaterialsAnswer,
    PartAnswer,
    PartHypothesis,
    PartValues,
    QuantityValue,
    ValueAnswer,
)
from corporeal.vlm.human_client import HumanClient
from corporeal.vlm.interpret_answers import hypothesis_name

VALUES = """

With each way, give also, for this very part, judged from the pictures, its use and its treatment:
- density: of its material [kg/m³];
- wall_mm: how thick its wall is [mm], where it is a sheet, hollow or filled; otherwise null;
- contents_density: of what fills it, as it lies in there [kg/m³]; otherwise null.
"""
VALUES_VERSION = "values/1"
NAMES = {"density": "density", "shell_thickness": "wall_mm", "contents_density": "contents_density"}
"""Quantity as the product asks for it → field of the answer; others take their usual value."""
RANGE = re.compile(r"- (\w+): .*?: ([\d.e+-]+) to ([\d.e+-]+).*?; usually ([\d.e+-]+)")


class ValuedWay(PartHypothesis):
    """One way a part may be, with its values."""

    density: float = Field(gt=0, lt=1e5)
    wall_mm: float | None = None
    contents_density: float | None = None


class ValuedPart(PartAnswer):
    """The ways of a part, with their values."""

    ways: list[ValuedWay]  # pyright: ignore[reportIncompatibleVariableOverride]


class ValuedAnswer(vlm.AnswerSchema):
    """Materials and placement in one."""

    SCHEMA: ClassVar[str] = "materials-with-values/1"
    parts: list[ValuedPart]


class OneQuestion:
    """Asks by hand; takes placement from what was said with the materials."""

    looks = True
    characters: Mapping[str, int] = {"asked": 0, "answered": 0, "outside": 0}
    """Of all questions and answers about materials, and values outside their ranges."""

    def __init__(self, folder: str) -> None:
        self.asked = HumanClient(folder)
        self.said: dict[str, ValuedAnswer] = {}

    def ask(self, question, answer, check=vlm.no_complaints):
        """Answer a question; the one about placement from memory."""
        if question.task == "materials":
            return self._materials(question, check)
        if question.task == "placement" and answer is ValueAnswer:
            return vlm.Reply(self._placed(question), "recording", "by hand")
        return self.asked.ask(question, answer, check)

    def _materials(self, question, check):
        wanted = replace(
            question, prompt=question.prompt + VALUES, prompt_version=f"{question.prompt_version} {VALUES_VERSION}"
        )

        def plain(found: ValuedAnswer) -> MaterialsAnswer:
            return MaterialsAnswer.model_validate(found.model_dump())

        reply = self.asked.ask(wanted, ValuedAnswer, lambda found: check(plain(found)))
        self.said[question.scene] = reply.answer
        self._count(asked=len(wanted.text), answered=len(reply.answer.model_dump_json()))
        return replace(reply, answer=plain(reply.answer))

    def _placed(self, question) -> ValueAnswer:
        """Read the ranges off the question, and put what was said into them."""
        ways = {}
        for part in self.said[question.scene].parts:
            likeliest = sorted((w for w in part.ways if w.probability > 0), key=_unlikely)
            ways |= {hypothesis_name(part.part, k): way for k, way in enumerate(likeliest)}
        parts = []
        for block in question.lists["ranges"].split("\n\n"):
            name = block.partition("\n")[0].removeprefix("Part ").removesuffix(":")
            rows = [self._value(ways[name], *m.groups()) for m in RANGE.finditer(block)]
            parts.append(PartValues(part=name, values=rows))
        return ValueAnswer(parts=parts)

    def _value(self, way: ValuedWay, quantity: str, low: str, high: str, usual: str) -> QuantityValue:
        said = getattr(way, NAMES.get(quantity, ""), None)
        value = float(usual) if said is None else min(max(said, float(low)), float(high))
        self._count(outside=int(said is not None and value != said))
        return QuantityValue(quantity=quantity, value=value, reason=way.reason)

    @classmethod
    def _count(cls, **more: int) -> None:
        cls.characters = {k: n + more.get(k, 0) for k, n in cls.characters.items()}


def _unlikely(way: ValuedWay) -> float:
    return -way.probability


vlm.VLM_CLIENTS["one"] = f"{__name__}:OneQuestion"


def main() -> None:
    """Ask, and print the ladder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", type=Path)
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--truth", type=Path)
    asked = parser.parse_args()
    describing = DescribeConfig(vlm=f"one:{asked.answers}", sampling="value")
    config = MassConfig(anonymous=True)
    things = objects_to_weigh(asked.models, asked.truth, "all")
    try:
        result = compare_masses(predict_masses(things, describing, GroundConfig(), config))
    except UserError as waiting:
        raise SystemExit(str(waiting)) from None
    for row in result.rows:
        print(f"{row.object}: {row.mixture:.3g} kg ({row.mixture_low:.3g} to {row.mixture_high:.3g})")
    for method, errors in result.metrics.get("all", {}).items():
        print(f"{result.methods[method]}: {errors}")
    print(OneQuestion.characters)


if __name__ == "__main__":
    main()
