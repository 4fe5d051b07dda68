"""What a model is offered never contradicts the library in use."""

import re

import pytest

from corporeal import materials
from corporeal.materials.material_candidates import content_materials_text, part_materials_text, quantity_choice

OWN = """
[sources.mine]
cite = "Our own bench"

[flubber]
law = "neo_hookean"
group = "elastomer"
young_MPa = { low = 1, typical = 2, high = 3, source = "mine" }
poisson = { low = 0.45, typical = 0.47, high = 0.49, source = "mine" }
density_kg_m3 = { low = 900, typical = 1000, high = 1100, source = "mine" }

[syrup]
law = "neo_hookean"
group = "liquid"
young_Pa = { low = 100, typical = 200, high = 300, source = "mine" }
poisson = { low = 0.49, typical = 0.49, high = 0.495, source = "mine" }
density_kg_m3 = { low = 1300, typical = 1330, high = 1400, source = "mine" }
"""


@pytest.mark.parametrize("library", ["default", "reference"])
def test_no_use_lies_outside_the_range_that_it_is_offered_with(library):
    for entry in materials.library(library).values():
        for field, measured in entry.ranges.items():
            offered = quantity_choice(entry.name, field, measured)
            low, high = offered.bounds
            for use, a, b in offered.uses:
                assert low * (1 - 1e-6) <= a < b <= high * (1 + 1e-6), (entry.name, field, use)


def test_the_published_steel_is_not_offered_as_a_hardened_tool():
    hard = "tool, spring, blade"
    for library, there in (("default", True), ("reference", False)):
        measured = materials.library(library)["steel"].ranges["yield_stress"]
        assert (hard in quantity_choice("steel", "yield_stress", measured).words) == there


def test_a_library_of_ones_own_is_what_is_offered(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(OWN)
    assert "flubber" in part_materials_text(str(path))
    assert "syrup" in content_materials_text(str(path))
    assert "syrup" not in part_materials_text(str(path)), "nothing is made of a liquid"
    assert "brass" not in part_materials_text(str(path))
    path.write_text('extends = "default"\n' + OWN)
    offered = part_materials_text(str(path))
    assert {"flubber", "brass"} <= set(re.findall(r"[\w-]+", offered))
