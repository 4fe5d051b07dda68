"""Pictures of something else on the same floor, which the floor places as well as the object."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.reconstruction import gaussian_source
from corporeal.reconstruction.masks.grown_masks import GrownMasks
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.sfm.find_poses import (
    FOUND_POSES_FILE,
    FoundPoses,
    _PosesRecord,
    drop_pictures_of_something_else,
)
from corporeal.render.camera_placement import camera_from_aim
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from patterned_scene import OF_SLAB, box, on_slab, patterned, ring

pycolmap = pytest.importorskip("pycolmap")
COUNT, SIZE = 15, (100, 75)
OTHER = on_slab(box((-0.12, -0.12, 0), (0.12, 0.12, 0.03)))
"""A plate where the others show a block."""


def placed(folder, strangers):
    """Poses of pictures around a block of which some show a plate, and masks of what they show."""
    model, masks = pycolmap.Reconstruction(), folder / "masks"
    masks.mkdir()
    block, plate = RayScene(patterned()), RayScene(OTHER)
    for k, aim in enumerate(ring(np.arange(COUNT) * 360 / COUNT, SIZE)):
        camera = camera_from_aim(aim)
        if not k:
            lens = [camera.K[0, 0], *camera.K[:2, 2], 0.0]
            made = {"model": "SIMPLE_RADIAL", "width": SIZE[0], "height": SIZE[1]}
            model.add_camera_with_trivial_rig(pycolmap.Camera(**made, params=lens, camera_id=1))
        pose = pycolmap.Rigid3d(np.linalg.inv(camera.world_from_camera)[:3])
        image = pycolmap.Image(name=f"{k:02d}.jpg", camera_id=1, image_id=k + 1)
        model.add_image_with_trivial_frame(image, pose)
        shown = identify_triangles(plate if k in strangers else block, aim)[0] >= OF_SLAB
        Image.fromarray(np.uint8(255) * shown).save(masks / f"{k:02d}.png")
    place = folder / "sparse" / "0"
    place.mkdir(parents=True)
    model.write_text(str(place))
    store.write_json(folder / FOUND_POSES_FILE, _PosesRecord(("found",), ("before",), "", ()))
    return FoundPoses(folder, ("found",), ("before",), "doubt"), masks


def test_what_shows_something_else_on_the_same_floor_is_left_out_and_named(tmp_path):
    posed, masks = placed(tmp_path, (2, 7, 11))
    left = drop_pictures_of_something_else(posed, masks)
    assert left.warnings[0] == "before" and left.doubt == "doubt"
    assert left.warnings[1].startswith("3 photographs show something else")
    assert "02.jpg, 07.jpg, 11.jpg" in left.warnings[1]
    assert pycolmap.Reconstruction(str(tmp_path / "sparse" / "0")).num_reg_images() == COUNT - 3
    kept = from_plain(_PosesRecord, store.read_json(tmp_path / FOUND_POSES_FILE))
    assert kept.warnings == left.warnings
    assert drop_pictures_of_something_else(left, masks) == left  # it is not said twice


def test_of_one_object_nothing_is_left_out(tmp_path):
    posed, masks = placed(tmp_path, ())
    assert drop_pictures_of_something_else(posed, masks) == posed


def test_none_is_left_out_where_half_show_something_else(tmp_path):
    posed, masks = placed(tmp_path, range(0, COUNT, 2))
    assert drop_pictures_of_something_else(posed, masks) == posed


class _Shots:
    shots = ()


@pytest.mark.parametrize("why", ["outlines", "colours", "still doubted"])
def test_doubted_masks_speak_against_pictures_if_those_of_the_others_are_believed(tmp_path, monkeypatch, why):
    (tmp_path / "poses").mkdir()
    posed, masks = placed(tmp_path / "poses", (2, 7, 11))
    posed = FoundPoses(posed.folder, posed.statements, posed.warnings)
    doubted, believed = tmp_path / "doubted", tmp_path / "believed"
    for folder in (doubted, believed):
        shutil.copytree(masks, folder / "masks")
    first = GrownMasks(None, (), doubted, contradict=why != "colours")
    after = GrownMasks(None if why == "still doubted" else believed, ())
    answers = iter([first, after])
    monkeypatch.setattr(gaussian_source, "lacks_poses", lambda source: True)
    monkeypatch.setattr(gaussian_source, "find_poses", lambda *what: posed)
    monkeypatch.setattr(gaussian_source, "list_posed_photos", lambda folder: _Shots())
    monkeypatch.setattr(gaussian_source, "has_masks", lambda shots: False)
    monkeypatch.setattr(gaussian_source, "grown_masks", lambda *what, **more: next(answers))
    run = tmp_path / "run"
    found = gaussian_source._find_source_poses(tmp_path, ReconstructConfig(), run, lambda share, words: None)
    assert found is not None
    count = pycolmap.Reconstruction(str(found.folder / "sparse" / "0")).num_reg_images()
    if why == "outlines":
        assert count == COUNT - 3 and found.folder != posed.folder
        assert found.warnings[1].startswith("3 photographs show something else")
    else:
        assert found == posed and count == COUNT
        assert not (run / gaussian_source.ALIKE_POSES_FOLDER).exists()


def test_poses_that_neighbours_and_outlines_speak_against_are_refused_at_once(tmp_path, monkeypatch):
    """Less than seven tenths agree: to leave out a third at most cannot mend that."""
    (tmp_path / "poses").mkdir()
    posed, masks = placed(tmp_path / "poses", (2, 7, 11))
    doubted, asked = tmp_path / "doubted", []
    shutil.copytree(masks, doubted / "masks")

    def grown(*what, **more):
        asked.append(more["doubted"])
        return GrownMasks(None, (), doubted, contradict=True)

    monkeypatch.setattr(gaussian_source, "lacks_poses", lambda source: True)
    monkeypatch.setattr(gaussian_source, "find_poses", lambda *what: posed)
    monkeypatch.setattr(gaussian_source, "list_posed_photos", lambda folder: _Shots())
    monkeypatch.setattr(gaussian_source, "has_masks", lambda shots: False)
    monkeypatch.setattr(gaussian_source, "grown_masks", grown)
    run = tmp_path / "run"
    with pytest.raises(BadFileError, match="doubt"):
        gaussian_source._find_source_poses(tmp_path, ReconstructConfig(), run, lambda share, words: None)
    assert asked == [True], "masks are not grown again"


@pytest.mark.parametrize("masks", ["agree", "contradict", "forced", "not asked"])
def test_masks_that_were_given_are_asked_about_poses_that_neighbours_doubt(masks, tmp_path, monkeypatch):
    wrong = range(0, COUNT, 2) if masks != "agree" else ()
    posed, _ = placed(tmp_path, wrong)
    monkeypatch.setattr(gaussian_source, "lacks_poses", lambda source: True)
    monkeypatch.setattr(gaussian_source, "find_poses", lambda *_: posed)
    monkeypatch.setattr(gaussian_source, "list_posed_photos", lambda folder: SimpleNamespace(shots=()))
    monkeypatch.setattr(gaussian_source, "has_masks", lambda shots: True)
    how = "none" if masks == "not asked" else "auto"
    config = ReconstructConfig(masks=how, force=masks == "forced")
    if masks == "contradict":
        with pytest.raises(BadFileError, match=r"doubt\. Put it on something with a pattern"):
            gaussian_source._find_source_poses(tmp_path, config, tmp_path / "run", lambda share, words: None)
        return
    found = gaussian_source._find_source_poses(tmp_path, config, tmp_path / "run", lambda share, words: None)
    assert found is not None and found.warnings == ("Doubt.", "before")
