"""What materials look like where nobody drew them."""

from dataclasses import replace

import pytest

import corporeal as co
from corporeal.core.types import Finish
from corporeal.materials.looks import LIQUIDS, METALS, PLAIN, SOLIDS, finish_of


def test_every_material_has_a_look():
    plain = finish_of("unheard of")
    for entry in co.library().values():
        assert finish_of(*entry.kin).colour != plain.colour, entry.name


def test_every_look_is_of_a_material_or_a_group():
    known = {name for entry in co.library().values() for name in entry.kin}
    assert not (LIQUIDS.keys() | METALS.keys() | SOLIDS.keys()) - known
    assert PLAIN not in SOLIDS.values()


def test_the_name_decides_before_the_group():
    assert finish_of("gold", "metal").colour != finish_of("steel", "metal").colour
    assert finish_of("gold", "metal").metallic == 1.0
    assert finish_of("water", "liquid").alpha_mode == "BLEND"


@pytest.mark.parametrize("material", ["wood", "steel"])
def test_a_solid_looks_like_its_material_unless_it_has_a_colour(material):
    one = co.ball(material, 0.1)
    (seen,) = co.build_scene(one).finishes
    assert seen == replace(finish_of(*co.material(material).kin), name="ball")
    blue = (0.0, 0.0, 1.0, 1.0)
    (seen,) = co.build_scene(replace(one, colour=blue)).finishes
    assert seen == Finish("ball", blue)
