"""What the name of a folder of photographs says of what they show, and what it cannot say."""

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.geometry.gaussian_transforms import transform_gaussians
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.pipeline.stages.reconstruct import reconstruct
from corporeal.reconstruction.reconstruct_config import ReconstructConfig, ReconstructionResolution
from corporeal.vlm.photographed_objects import (
    check_stated_extents,
    decide_metric_scale,
    object_from_name,
    object_of_usual_size,
    telling_words,
)
from gaussian_boxes import DOWN, box

SIDES = (0.4, 0.2, 0.2)


COARSE = ReconstructionResolution(16, (96, 96), object_grid_cells=60_000)
"""Looks at splats in fewer and smaller pictures, and carves more coarsely, than for people."""


def made(folder, name, extents=(), **settings):
    """Reconstruct one box of a file that is called so."""
    scene = box(SIDES, (0.0, 0.0, 0.1), (0.7, 0.6, 0.1))
    write_splat_ply(folder / f"{name}.ply", transform_gaussians(scene, DOWN, 2.0, (0.0, 0.0, 5.0)))
    config = ReconstructConfig(**settings, resolution=COARSE)
    return reconstruct(folder / f"{name}.ply", config, extents)


@pytest.mark.parametrize(
    ("name", "class_name"),
    [
        ("banana", "banana"),
        ("IMG_banana_01", "banana"),
        ("photos of a mug", "mug"),
        ("Foto Tasse", "cup"),
        ("photos", None),
        ("Fotos", None),
        ("Camera", None),
        ("iPhone_photos", None),
        ("pictures", None),
        ("IMG_1234", None),
        ("views", None),
    ],
)
def test_a_name_says_what_is_shown_unless_it_is_of_the_photographs(name, class_name):
    found = object_from_name(name)
    assert (found and found.class_name) == class_name
    assert found is None or found.extent == object_of_usual_size(class_name).extent


@pytest.mark.slow
def test_a_lone_object_is_called_and_sized_by_the_name_of_its_folder(tmp_path):
    came = made(tmp_path, "banana")
    (thing,), found = came.scene.objects, came.found
    assert thing.name == thing.class_name == "banana"
    assert np.ptp(found.boxes[0], axis=0).max() == pytest.approx(0.19, rel=0.05)
    (said,) = [w for w in found.warnings if "banana" in w]
    assert "19 cm" in said
    assert "--extent banana=METRES" in said
    assert "--object-names" in said
    assert not any("0.5 m" in w for w in found.warnings)


@pytest.mark.slow
def test_a_stated_size_is_the_size_whatever_the_name_says(tmp_path):
    came = made(tmp_path, "axe", ("axe=0.103",))
    assert np.ptp(came.found.boxes[0], axis=0).max() == pytest.approx(0.103, rel=0.05)
    (said,) = [w for w in came.found.warnings if "axe" in w]
    assert "scale" not in said
    assert "METRES" not in said, "they did"
    assert made(tmp_path, "axe", ("object=0.103",)).scene.objects[0].name == "axe"


@pytest.mark.slow
def test_a_named_object_is_not_called_as_the_folder(tmp_path):
    came = made(tmp_path, "banana", object_names=("crate",))
    assert [o.name for o in came.scene.objects] == ["crate"]
    assert not any("banana" in w for w in came.found.warnings)


@pytest.mark.slow
def test_a_folder_of_photographs_makes_nothing_one_of_paper(tmp_path):
    came = made(tmp_path, "photos")
    (thing,) = came.scene.objects
    assert thing.name == "object"
    assert thing.stem == "object"
    assert telling_words("old teapot photos") == "old teapot"
    first, *_ = came.found.warnings
    assert "0.5 m" in first, "what a person can state comes first"
    assert not any("0.5 m" in s for s in came.found.statements), "said once"


def test_sizes_of_unnamed_objects_can_be_stated():
    check_stated_extents(["banana=0.2"], [], "banana")
    check_stated_extents(["object=0.2"], [], "banana")
    with pytest.raises(UserError, match="no object 'duck'"):
        check_stated_extents(["duck=0.2"], [], "banana")
    assert decide_metric_scale({"axe": 2.0}, [object_of_usual_size("axe")], ["object=0.5"]).metres_per_unit == 0.25


@pytest.mark.slow
def test_an_estimated_size_names_its_source(tmp_path):
    (said,) = [w for w in made(tmp_path, "one", object_names=("banana",)).found.warnings if "large" in w]
    assert said == (
        "How large it is was not stated: assumed as large as a banana usually is, 19 cm. "
        "State a size with --extent banana=METRES."
    )
    stated = made(tmp_path, "two", ("banana=0.2",), object_names=("banana",)).found.warnings
    assert not any("how large" in w for w in stated)
