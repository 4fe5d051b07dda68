"""A warning points to what it is about."""

from types import SimpleNamespace

import pytest

from corporeal.render.warning_subjects import parts_named_in


def thing(*names):
    return [SimpleNamespace(name=n) for n in names]


SCENE = SimpleNamespace(objects=thing("can_0", "can_01", "lid"))
PARTS = SimpleNamespace(
    catalogue=[SimpleNamespace(name=n, object=o) for n, o in (("body", 0), ("lid", 0), ("body", 1), ("lid", 2))]
)


@pytest.mark.parametrize(
    ("sentence", "parts"),
    [
        ("can_0: body is of unknown material.", [0]),
        ("can_0: lid is thin.", [1]),
        ("can_0 gained energy.", [0, 1]),
        ("can_01 gained energy.", [2]),
        ("lid: lid is of unknown material.", [3]),
        ("6 of 7 parts are simulated softer than they are.", []),
        ("somebody said can_0x.", []),
        ("Object 2 of the scene is only 3.1 cells across.", [2]),
    ],
)
def test_the_parts_that_a_sentence_names(sentence, parts):
    assert parts_named_in(sentence, SCENE, PARTS) == parts
