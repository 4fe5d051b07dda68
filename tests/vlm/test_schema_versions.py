"""Answers are recorded under the version of their schema: other fields need another version."""

import hashlib
import json
from importlib.resources import files
from typing import Any

import pytest
from video_judge.subquestions import Verdict

import corporeal.vlm.answer_schemas
from corporeal.description.query_scene import INTERVIEW_TASKS
from corporeal.vlm import AnswerSchema
from corporeal.vlm.prompt_files import read_prompt

FIELDS_OF = {
    "extents/1": "9ff5cbb109992dba",
    "mass/1": "f096eaf18a491464",
    "materials/1": "1fda4c8ec27e0b59",
    "parts/1": "e59e67c5172ca744",
    "placement-fractions/1": "41d81eabfcc6c940",
    "placement-values/1": "5b3e3adcd94a38b9",
    "ranking/1": "9bc77928d1f75aa6",
    "regions/1": "9c0f4b5142de85bb",
    "size/1": "754555f73a77ebda",
    "thickness/1": "1c705a2bcf11ad97",
    "things/1": "31f470b863d0b7d7",
    "verdict/1": "dcea5bcda469e998",
}
"""Version of a schema → digest of its fields, without names and docstrings of classes. Where a test
fails here, raise the version of the schema and write its own digest down beside the new version."""
SCHEMAS = sorted(
    [kind for kind in vars(corporeal.vlm.answer_schemas).values() if hasattr(kind, "SCHEMA")] + [Verdict],
    key=lambda kind: kind.SCHEMA,
)


def fields_digest(answer: type[AnswerSchema]) -> str:
    """Name the fields of an answer, with their types, bounds and defaults, at every depth."""
    schema = answer.model_json_schema()
    plain = json.dumps(_structure(schema, schema.get("$defs", {})), sort_keys=True)
    return hashlib.sha256(plain.encode()).hexdigest()[:16]


def _structure(schema: Any, known: dict) -> Any:
    if isinstance(schema, list):
        return [_structure(item, known) for item in schema]
    if not isinstance(schema, dict):
        return schema
    if "$ref" in schema:
        return _structure(known[schema["$ref"].rpartition("/")[2]], known)
    rows = {k: v for k, v in schema.items() if k not in ("title", "description", "$defs")}
    inner = rows.pop("properties", None)
    plain = {k: _structure(v, known) for k, v in rows.items()}
    if inner is not None:
        plain["properties"] = {name: _structure(v, known) for name, v in inner.items()}
    return plain


def test_every_schema_has_a_version_of_its_own():
    assert len({kind.SCHEMA for kind in SCHEMAS}) == len(SCHEMAS) == 12
    assert {kind.SCHEMA for kind in SCHEMAS} == set(FIELDS_OF)


@pytest.mark.parametrize("answer", SCHEMAS, ids=lambda kind: kind.SCHEMA)
def test_other_fields_have_another_version(answer):
    assert fields_digest(answer) == FIELDS_OF[answer.SCHEMA]


def test_names_and_docstrings_do_not_count_and_fields_do():
    def made(name: str, doc: str, kind: type) -> type[AnswerSchema]:
        body = {"__doc__": doc, "__annotations__": {"title": kind}, "__module__": __name__}
        return type(name, (AnswerSchema,), body)

    one = fields_digest(made("One", "a", int))
    assert fields_digest(made("Other", "b", int)) == one
    assert fields_digest(made("One", "a", float)) != one


def test_every_prompt_states_a_version_of_its_own():
    found = [files("corporeal.description").joinpath("prompts", f"{task}.md") for task in INTERVIEW_TASKS]
    found += [files("corporeal.vlm").joinpath("prompts", f"{t}.md") for t in ("sizes", "things", "regions")]
    found += [files("video_judge").joinpath("video.md")]
    prompts = [read_prompt(file) for file in found]
    assert len({prompt.version for prompt in prompts}) == len(prompts)
    assert not [prompt for prompt in prompts if "version:" in prompt.text]


def test_a_prompt_without_a_version_is_refused(tmp_path):
    (tmp_path / "mine.md").write_text("What is it?")
    with pytest.raises(ValueError, match=r"mine\.md states no version"):
        read_prompt(tmp_path / "mine.md")
