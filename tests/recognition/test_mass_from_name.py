"""Masses that names state, and numbers that are none."""

import pytest

from corporeal.recognition.mass_from_name import mass_from_name, mass_from_name_warning


@pytest.mark.parametrize(
    ("name", "mass"),
    [
        ("dumbbell_5kg", 5),
        ("kettlebell 16 kg", 16),
        ("weight 500g", 0.5),
        ("bag of flour 1kg", 1),
        ("10lb bowling ball", 4.536),
        ("Dumbbell2.5KG.001", 2.5),
        ("hantel 2,5 kg", 2.5),
        ("sack_1,000g", 1),
        ("2x5kg dumbbell", 10),
        ("bottle 500 ml", None),
        ("bottle_500ml", None),
        ("phone_5g", None),
        ("drill 18V", None),
        ("chair 1950", None),
        ("paper 80 g/m2", None),
        ("chair max 120 kg", None),
        ("washing machine 8kg", None),
        ("hook for 5 kg", None),
        ("pound cake", None),
        ("box_2_golden", None),
        ("plate 3 lbf", None),
        ("dumbbells 5kg 10kg", None),
    ],
)
def test_what_a_name_says_of_mass(name, mass):
    assert mass_from_name(name) == (None if mass is None else pytest.approx(mass, rel=1e-3))


def test_two_names_of_one_object_agree_or_say_nothing():
    assert mass_from_name("dumbbell", "dumbbell_5kg") == 5
    assert mass_from_name("dumbbell 4kg", "dumbbell_5kg") is None


def test_a_mass_that_is_far_from_the_name_is_reported():
    assert mass_from_name_warning("kettlebell_16kg", 20.0, "kettlebell_16kg") is None
    told = mass_from_name_warning("kettlebell_16kg", 33.0, "kettlebell_16kg")
    assert told is not None
    assert "says 16 kg, and it weighs 33 kg" in told
    assert mass_from_name_warning("kettlebell", 33.0, "kettlebell") is None
