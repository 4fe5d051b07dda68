"""What materials look like where nobody drew them."""

from dataclasses import replace

import pytest

import corporeal as co
from corporeal.core.types import Finish
from corporeal.materials.default_appearance import (
    DEFAULT_COLOUR,
    LIQUID_COLOURS,
    METAL_COLOURS,
    SOLID_COLOURS,
    default_finish,
)


def test_every_material_has_a_look():
    plain = default_finish("unheard of")
    for entry in co.library().values():
        assert default_finish(*entry.kin).colour != plain.colour, entry.name


def test_every_look_is_of_a_material_or_a_group():
    known = {name for entry in co.library().values() for name in entry.kin}
    assert not (LIQUID_COLOURS.keys() | METAL_COLOURS.keys() | SOLID_COLOURS.keys()) - known
    assert DEFAULT_COLOUR not in SOLID_COLOURS.values()


def test_the_name_decides_before_the_group():
    assert default_finish("gold", "metal").colour != default_finish("steel", "metal").colour
    assert default_finish("gold", "metal").metallic == 1.0
    assert default_finish("water", "liquid").alpha_mode == "BLEND"


@pytest.mark.parametrize("material", ["wood", "steel"])
def test_a_solid_looks_like_its_material_unless_it_has_a_colour(material):
    one = co.ball(material, 0.1)
    (seen,) = co.build_scene(one).finishes
    assert seen == replace(default_finish(*co.material(material).kin), name="ball")
    blue = (0.0, 0.0, 1.0, 1.0)
    (seen,) = co.build_scene(replace(one, colour=blue)).finishes
    assert seen == Finish("ball", blue)
