"""Things that are of one kind or another by a word beside them, or by how large they are."""

import pytest

from corporeal.core.types import SceneObject
from corporeal.pipeline.stages.describe import describe
from corporeal.recognition.metadata_recognition import FileEvidence, infer_hollow_structure, recognise_part
from corporeal.recognition.stated_properties import apply_stated_wall
from corporeal.vlm.annotation_file import PartAnnotation
from corporeal.vlm.annotation_file import apply_structure_annotation as annotated
from sample_scenes import plain, scene


class Named:
    def __init__(self, name):
        self.name, self.extras = name, {}


def built(name, extent=1.0, surface="mesh"):
    """Return what a thing of one part and such a name becomes."""
    known = FileEvidence(
        surfaces=[Named(surface)],  # type: ignore[list-item]
        finishes=[plain()],
        thing=SceneObject(f"{name}_0", name, extent),
        alone=True,
        metallic_means_something=False,
    )
    return infer_hollow_structure(recognise_part(known), known, lambda _: True)


@pytest.mark.parametrize("name", ["bean bag", "juggling bean bag", "beanbag_red"])
def test_a_bean_bag_for_juggling_is_full_of_grains(name):
    """It was a tuft of fibre fill and weighed 5 g."""
    found = built(name, 0.07)
    assert (found.material, found.structure, found.contents) == ("cotton", "filled", "grain")


@pytest.mark.parametrize("name", ["bean bag", "bean bag chair", "beanbag"])
def test_a_bean_bag_to_sit_on_is_full_of_beads_of_foam(name):
    """It was one rigid block of packaging foam."""
    found = built(name, 0.6)
    assert (found.material, found.structure, found.contents) == ("cotton", "filled", "foam_beads")


def test_how_large_an_object_is_tells_nothing_of_what_is_always_the_same():
    assert built("sponge", 0.05) == built("sponge", 0.9)


@pytest.mark.parametrize(
    ("name", "material", "structure"),
    [
        ("bocce ball", "phenolic", None),
        ("wooden bocce ball", "wood", None),
        ("clay ball", "terracotta", None),
        ("ceramic ball", "ceramic", None),
        ("porcelain duck", "porcelain", "shell"),
        ("hollow plastic golf ball", "hard_plastic", "shell"),
        ("plastic golf ball", "hard_plastic", None),
        ("golf ball", "golf_ball_core", None),
        ("hollow steel ball", "steel", "shell"),
        ("hollow_brick", "brick", "shell"),
        ("solid rubber ball", "rubber", "solid"),
        ("solid wood table", "wood", None),
    ],
)
def test_balls_of_what_is_fired_are_solid_and_what_is_called_hollow_is(name, material, structure):
    found = built(name)
    assert (found.material, found.structure) == (material, structure)
    if structure != "shell":
        assert (found.thickness, found.inflation) == (None, None)


@pytest.mark.parametrize(
    ("name", "extent", "material"),
    [
        ("orange", 0.08, "soft_fruit"),
        ("Orange_01", 0.07, "soft_fruit"),
        ("orange fruit", 0.07, "soft_fruit"),
        ("orange", 0.6, None),
        ("orange chair", 0.08, "wood"),
        ("chair orange", 0.9, "wood"),
        ("orange thingummy", 0.08, None),
    ],
)
def test_an_orange_is_a_fruit_where_nothing_else_is_named(name, extent, material):
    assert built(name, extent).material == material


def test_a_finish_called_orange_is_a_colour():
    assert built("thing", 0.08, surface="orange").material is None


def test_the_wall_of_a_balloon_is_that_of_one_blown_up():
    """A party balloon of 28 cm weighs 3 g without its air; it weighed 74 g."""
    rubber, area = 930.0, 3.1416 * 0.28**2
    assert 2e-3 < rubber * area * (built("balloon").thickness or 1.0) < 5e-3


@pytest.mark.parametrize(
    ("name", "cover", "inside"),
    [
        ("leather pouf", "leather", "seat_foam"),
        ("sofa_leather_brown", "leather", "seat_foam"),
        ("Velvet Cushion", "cotton", "fibre_fill"),
        ("faux leather armchair", "synthetic_leather", "seat_foam"),
    ],
)
def test_what_is_upholstered_is_covered_with_the_sheet_of_its_name(name, cover, inside):
    """A pouf of leather was a block of leather and weighed 70 kg."""
    found = built(name)
    assert (found.material, found.structure) == (cover, "filled")
    assert (found.contents, found.fill, found.thickness) == (inside, 1.0, None)


def test_what_is_not_upholstered_is_of_the_leather_of_its_name():
    assert built("leather belt").contents is None
    assert built("wooden sofa").contents is None


def test_the_wall_of_a_name_is_usual_and_not_stated():
    assert built("mailbox").wall_usual
    assert built("plastic garden chair").wall_usual
    assert not built("brick").wall_usual
    assert not apply_stated_wall(built("mailbox"), 0.003).wall_usual
    thin = PartAnnotation(None, thickness=0.003)
    assert not annotated(thin, built("mailbox")).wall_usual
    assert annotated(PartAnnotation("steel"), built("mailbox")).wall_usual


def test_a_tank_is_hollow_and_how_large_a_safe_is_tells_its_wall():
    assert built("old copper tank").structure == "shell"
    assert built("scuba tank", 0.6).thickness == 0.012
    assert (built("mini safe", 0.25).thickness, built("safe", 0.8).thickness) == (0.002, 0.005)


@pytest.mark.parametrize(
    ("name", "material", "kpa"),
    [
        ("air mattress", "soft_PVC", 2.8),
        ("inflated mattress", "soft_PVC", 2.8),
        ("inflatable_sofa", "soft_PVC", 3.0),
        ("inflated basketball", "rubber", 55.0),
        ("mattress", "seat_foam", None),
    ],
)
def test_what_is_blown_up_is_a_skin_with_air_in_it(name, material, kpa):
    """An inflated mattress was a block of foam, and an inflatable one a skin that held no air."""
    (part,) = describe(scene((name, [("mesh", plain(), {})]))).objects[0].parts
    assert part.material == material
    assert part.structure == ("shell" if kpa else None)
    assert part.inflation == (pytest.approx(1e3 * kpa) if kpa else None)


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("axe", "steel"),
        ("hatchet", "steel"),
        ("axe head", "steel"),
        ("bronze axe", "bronze"),
        ("stone axe", "granite"),
        ("wooden axe", "wood"),
        ("plastic toy axe", "hard_plastic"),
    ],
)
def test_an_axe_is_of_what_its_head_is_of(name, material):
    """Nobody knew it: a reconstructed one that came into a scene was of plastic."""
    assert built(name, 0.1).material == material
