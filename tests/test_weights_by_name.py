"""Things that are there for their mass, whose names state it: how they are made fits it."""

import pytest
from names import weigh
from trimesh.creation import icosphere, revolve

from corporeal import materials
from corporeal.recognition.construction_from_mass import best_mass_fit, construction_table


def bell():
    """Return a closed round body of 205 mm, the size of every competition kettlebell."""
    return icosphere(3).apply_scale(0.1025).apply_translation((0, 0, 0.1025))


def drum(radius, height):
    return revolve([(0, 0), (radius, 0), (radius, height), (0, height)], sections=40)


@pytest.mark.parametrize(
    ("name", "shape", "said", "built"),
    [
        ("kettlebell 16 kg", bell(), 16, "shell"),
        ("kettlebell 32 kg", bell(), 32, None),
        ("weight 500g", drum(0.0205, 0.05), 0.5, "solid"),
        ("10lb bowling ball", icosphere(3).apply_scale(0.108), 4.536, "packed"),
        ("vinyl_dumbbell_3kg", drum(0.05, 0.2), 3, "filled"),
    ],
)
def test_a_weight_is_made_so_that_it_weighs_what_its_name_says(tmp_path, name, shape, said, built):
    """A kettlebell of 16 kg was solid steel and weighed 33 kg without a word."""
    found = weigh(shape, tmp_path / f"{name}.glb")
    assert sum(found.masses) == pytest.approx(said, rel=0.25)
    assert found.field.words[0].structure == built
    assert found.weight == []


def test_a_mass_that_no_way_has_is_reported_and_sets_nothing(tmp_path):
    named = weigh(bell(), tmp_path / "kettlebell 160 kg.glb")
    plain = weigh(bell(), tmp_path / "kettlebell.glb")
    assert named.masses == pytest.approx(plain.masses)
    assert len(named.weight) == 1
    assert "160 kg" in named.weight[0]


def test_a_substance_in_the_name_is_kept(tmp_path):
    found = weigh(bell(), tmp_path / "brass kettlebell 12 kg.glb")
    assert found.field.words[0].material == "brass"
    assert "12 kg" in found.weight[0]


def test_the_commoner_way_is_taken_where_it_fits():
    assert best_mass_fit([11.0, 10.0], 10.0) == 0
    assert best_mass_fit([13.0, 10.5], 10.0) == 1
    assert best_mass_fit([30.0, 14.0], 10.0) == 1
    assert best_mass_fit([30.0, 20.0], 10.0) == 0


def test_ways_are_of_what_the_library_has():
    ways = [way for row in construction_table() for way in row["ways"]]
    assert {way[key] for way in ways for key in ("material", "contents") if key in way} <= set(materials.library())
