"""Masks of a folder of photographs: written, corrected, pointed at, refused."""

import json
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import painted_scene
import pytest
from colmap_writer import write_colmap
from painted_scene import GREY, HIGH, WIDE, agreement, grown_scene
from PIL import Image

from corporeal.cli import main
from corporeal.core.errors import UserError
from corporeal.core.types import Gaussians, Views
from corporeal.io.photos.mask_files import edited_masks
from corporeal.io.photos.posed_photos import MASK_FOLDERS, read_posed_photos
from corporeal.io.photos.transforms_json import write_views
from corporeal.multiview.pose_consistency import PoseConsistency
from corporeal.pipeline.run_pipeline import Settings, _Run, no_progress_of_stage
from corporeal.reconstruction import gaussian_source
from corporeal.reconstruction.gaussian_source import find_or_grow_masks, gaussians_from_source
from corporeal.reconstruction.gaussians import gaussian_scene
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.masks import grown_masks as module
from corporeal.reconstruction.masks.grown_masks import GrownMasks, grown_masks
from corporeal.reconstruction.masks.mask_prompts import MaskPrompt
from corporeal.reconstruction.masks_figure import MASKS_FIGURE_FILE
from corporeal.reconstruction.reconstruct_config import ReconstructConfig, validate_reconstruct

scene = partial(painted_scene.scene, count=10)


def unheard(fraction, words):
    """Progress that nobody is told of."""


@pytest.fixture
def photos(tmp_path):
    views, masks, _ = scene()
    write_views(tmp_path / "photos", views)
    return tmp_path / "photos", masks


@pytest.fixture(scope="module")
def grown(tmp_path_factory):
    """Photographs, their true masks, and what was grown of them; all that lies there stays so."""
    place = tmp_path_factory.mktemp("grown")
    views, masks, _ = scene()
    write_views(place / "photos", views)
    made = grown_masks(place / "photos", place / "made")
    assert made.folder == place / "made"
    return place / "photos", masks, made


@pytest.fixture(scope="module")
def grey(tmp_path_factory):
    """Photographs of a thing in the colours of its floor, and what was grown of them."""
    place = tmp_path_factory.mktemp("grey")
    views = scene(ball=GREY)[0]
    write_views(place / "photos", views)
    return place / "photos", views, grown_masks(place / "photos", place / "made")


@pytest.mark.slow
def test_masks_are_written_and_read_as_given_ones(grown):
    folder, masks, made = grown
    read = read_posed_photos(folder, WIDE, made.folder)
    assert agreement(read.masks / 255, masks).mean() > 0.93
    assert read_posed_photos(folder, WIDE, made.folder / "masks").masks is not None
    assert len(list((made.folder / "masks").glob("*.png"))) == len(masks)


@pytest.mark.slow
def test_masks_lie_on_the_photograph_as_it_is_stored(photos, tmp_path):
    """With a lens that bends, what is written is bent as the photograph is."""
    folder, masks = photos
    file = folder / "transforms.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"k1": -0.25}))
    made = grown_masks(folder, tmp_path / "made")
    assert made.folder is not None
    written = [np.asarray(Image.open(p)) for p in sorted((made.folder / "masks").glob("*.png"))]
    assert agreement(np.stack(written) / 255, masks).mean() > 0.9, "the pixels were not bent"


def test_what_was_corrected_is_kept_and_makes_results_stale(grown, tmp_path):
    folder, _, first = grown
    run = _Run([folder], tmp_path, Settings(), no_progress_of_stage)
    before = run._borrowed("reconstruct")
    shutil.copytree(first.folder, tmp_path / "0-reconstruct")
    made = grown_masks(folder, tmp_path / "0-reconstruct")
    assert made == replace(first, folder=tmp_path / "0-reconstruct"), "what lies there is kept"
    assert run._borrowed("reconstruct") == before, "what was made is no correction"
    mask = made.folder / "masks" / "0003.png"
    Image.fromarray(np.full((HIGH, WIDE), 255, np.uint8)).save(mask)
    assert list(edited_masks(made.folder)) == ["masks/0003.png"]
    assert run._borrowed("reconstruct") != before
    again = grown_masks(folder, tmp_path / "0-reconstruct")
    assert again.said[-1] == "1 of the masks were corrected manually."
    assert np.asarray(Image.open(mask)).min() == 255


@pytest.mark.slow
def test_what_masks_hold_a_part_of_is_refused_until_they_are_corrected(tmp_path):
    views, _, points = scene(flat=0.33)
    photos, run = tmp_path / "tea set", tmp_path / "run"
    names = tuple(f"{k:04d}.png" for k in range(len(views.cameras)))
    (photos / "images").mkdir(parents=True)
    for name, picture in zip(names, views.rgb, strict=True):
        Image.fromarray(picture).save(photos / "images" / name)
    write_colmap(photos / "sparse" / "0", views.cameras, names, points)
    for _ in range(2):  # the second time what was noted is read
        with pytest.raises(UserError, match=r"tea set: not all of .* --force goes on"):
            gaussians_from_source(photos, ReconstructConfig(), run, unheard)
    forced = find_or_grow_masks(ReconstructConfig(force=True), photos, run, unheard)
    assert forced.folder is not None and "Check them: not all of it" in forced.warnings[0]
    Image.fromarray(np.full((HIGH, WIDE), 255, np.uint8)).save(run / "masks" / names[3])
    assert not find_or_grow_masks(ReconstructConfig(), photos, run, unheard).incomplete


@pytest.mark.slow
@pytest.mark.parametrize("left_over", [0.0, 0.5])
def test_what_lies_flat_is_taken_if_masks_are_whole_then(photos, tmp_path, monkeypatch, left_over):
    folder, _ = photos
    whole = grown_scene(count=10)[-1]
    made = {False: replace(whole, left_over=1.0), True: replace(whole, left_over=left_over)}
    monkeypatch.setattr(module, "grow_masks", lambda *_, flat=False: made[flat])
    monkeypatch.setattr(module, "merge_attachments", lambda *given: given[2])
    found = grown_masks(folder, tmp_path / "made")
    assert (module.FLAT_TAKEN_STATEMENT in found.said) == (left_over == 0)
    assert ("1.0 times as much" in found.incomplete) == (left_over > 0)


@pytest.mark.slow
def test_what_cannot_be_distinguished_is_not_written(grey):
    photos, _, made = grey
    assert made.folder is None and "No masks were grown" in made.said[0]
    assert not (photos.parent / "made" / "masks").exists()
    assert made.doubted is not None, "they are kept, to be compared with"
    assert read_posed_photos(photos, WIDE, made.doubted).masks is not None
    assert grown_masks(photos, photos.parent / "made") == made


def test_what_colours_tell_goes_with_pictures_though_it_is_doubted(grey, tmp_path, monkeypatch):
    photos, views, made = grey
    run = tmp_path / "run"
    shutil.copytree(made.doubted.parent, run)
    none = Gaussians(*(np.zeros((0, n)) for n in (3, 4, 3)), np.zeros(0), np.zeros((0, 1, 3)))
    monkeypatch.setattr(
        gaussian_source, "load_or_train_gaussians", lambda *_: GaussianScene(none, views.cameras, views)
    )
    taken, masked = gaussians_from_source(photos, ReconstructConfig(), run, unheard)
    assert not masked and taken.coloured is not None
    assert taken.coloured.shape == views.rgb.shape[:3]


@pytest.mark.parametrize(
    ("pointed", "words"),
    [
        (MaskPrompt("", (200.0, 3.0)), "does not lie in"),
        (MaskPrompt("", None, (30.0, 30.0, 20.0, 40.0)), "the upper left corner first"),
        (MaskPrompt("other.png", (2.0, 3.0)), "no photograph 'other.png'"),
    ],
)
def test_a_place_that_is_not_there_is_named(photos, tmp_path, pointed, words):
    with pytest.raises(UserError, match=words):
        grown_masks(photos[0], tmp_path / "made", pointed)


@pytest.mark.slow
@pytest.mark.parametrize("lens", [{}, {"k1": -0.2}], ids=["straight", "bent"])
def test_a_point_is_in_the_pixels_of_the_photograph(photos, tmp_path, lens):
    folder, masks = photos
    file = folder / "transforms.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | lens))
    rows, columns = np.nonzero(masks[5])
    made = grown_masks(folder, tmp_path / "made", MaskPrompt("0005", (columns.mean(), rows.mean())))
    written = [np.asarray(Image.open(p)) for p in sorted((made.folder / "masks").glob("*.png"))]
    assert agreement(np.stack(written) / 255, masks).mean() > 0.85


def type_in(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["corporeal", *map(str, words)])
    try:
        main()
    except SystemExit as end:
        return end.code or 0
    return 0


def test_the_command_says_how_to_go_on(grown, tmp_path, monkeypatch, capsys):
    photos, _, made = grown
    out = tmp_path / "masks"
    shutil.copytree(made.folder, out)
    assert type_in(monkeypatch, "masks", photos, "--out", out) == 0
    told = capsys.readouterr().out.replace("\n", " ")
    assert f"Check {out / MASK_FOLDERS[0]}." in told, "they lie there"
    assert f"corporeal run {photos} --masks {out}" in told


@pytest.mark.parametrize(
    ("words", "said"),
    [(("--at", "1", "2", "--box", "1", "2", "3", "4"), "not both"), (("--at", "999", "2"), "does not lie in")],
)
def test_bad_words_get_one_sentence(photos, monkeypatch, capsys, words, said):
    assert type_in(monkeypatch, "masks", photos[0], *words) == 2
    assert said in capsys.readouterr().err.replace("\n", " ")


@pytest.mark.parametrize(
    ("words", "said"), [((), "Point at the object with --at or --box"), (("--box", "1", "2", "9", "9"), "--on")]
)
def test_who_pointed_is_not_advised_to_point(photos, monkeypatch, capsys, words, said):
    """A box around a thing that was found nowhere was answered with: point at it with --box."""
    monkeypatch.setattr(
        "corporeal.reconstruction.masks.grown_masks.grown_masks", lambda *_: GrownMasks(None, ("No masks were grown.",))
    )
    assert type_in(monkeypatch, "masks", photos[0], *words) == 2
    assert said in (told := capsys.readouterr().err.replace("\n", " "))
    assert ("Point at the object" in told) == (not words)


def test_photographs_without_poses_are_referred(tmp_path, monkeypatch, capsys):
    views = scene(count=4)[0]
    (tmp_path / "bare").mkdir()
    for k, picture in enumerate(views.rgb):
        Image.fromarray(picture).save(tmp_path / "bare" / f"{k}.png")
    assert type_in(monkeypatch, "masks", tmp_path / "bare") == 2
    told = capsys.readouterr().err.replace("\n", " ")
    assert "has no poses" in told
    assert "corporeal masks runs/bare/0-reconstruct/poses" in told, "to be typed as it is"


def test_a_run_grows_masks_where_there_are_none(grown, tmp_path):
    """Unless it was told not to, or there are some."""
    photos, _, first = grown
    shutil.copytree(first.folder, tmp_path / "run")

    def asked(masks, source=photos):
        config = ReconstructConfig(masks=masks)
        return find_or_grow_masks(config, source, tmp_path / "run", lambda fraction, words: None)

    found = asked("auto")
    assert found.grown and found.folder == tmp_path / "run"
    assert "There were no masks." in found.warnings[0]
    assert asked("none").folder is None
    assert asked(str(found.folder)).folder == found.folder
    views, masks, _ = scene()
    owners = np.where(masks, 0, -1).astype(np.int32)
    write_views(tmp_path / "masked", Views(views.rgb, views.cameras, object_of_pixel=owners))
    assert asked("auto", tmp_path / "masked").folder is None


@pytest.mark.parametrize(("masks", "used"), [("auto", True), ("none", False)])
def test_masks_beside_the_photographs_are_used_unless_none_are_wanted(masks, used, tmp_path, monkeypatch):
    views, true, _ = scene()
    owners = np.where(true, 0, -1).astype(np.int32)
    write_views(tmp_path / "photos", Views(views.rgb, views.cameras, object_of_pixel=owners))
    given = []

    def train(views, masks, *rest):
        given.append((masks, views.object_of_pixel))
        raise UserError("This is enough.")

    agree = PoseConsistency("matches", 500, 0.7, 0.5, None)
    monkeypatch.setattr(gaussian_scene, "check_pose_consistency", lambda *_: agree)
    monkeypatch.setattr(gaussian_scene, "train_gaussians", train)
    with pytest.raises(UserError, match="This is enough"):
        gaussians_from_source(tmp_path / "photos", ReconstructConfig(masks=masks), tmp_path / "run", unheard)
    ((seen, numbers),) = given
    assert (seen is not None) == (numbers is not None) == used
    assert (tmp_path / "run" / MASKS_FIGURE_FILE).exists() == used


def test_segmentation_by_masks_is_refused_without_masks():
    with pytest.raises(UserError, match="--apart masks needs masks"):
        validate_reconstruct(ReconstructConfig(apart="masks", masks="none"))


def test_masks_that_cannot_be_are_refused_before_anything_is_learned(tmp_path):
    with pytest.raises(UserError, match="There is no folder"):
        validate_reconstruct(ReconstructConfig(masks=str(tmp_path / "nowhere")))


def test_a_folder_without_masks_of_these_photographs_is_refused(photos, tmp_path):
    (tmp_path / "empty").mkdir()
    Image.fromarray(np.zeros((HIGH, WIDE), np.uint8)).save(tmp_path / "empty" / "other.png")
    with pytest.raises(UserError, match="no mask with the name of a photograph"):
        read_posed_photos(photos[0], WIDE, tmp_path / "empty")


@pytest.mark.parametrize("doubted", [True, False])
def test_growing_ends_where_outlines_contradict_each_other_under_doubted_poses(monkeypatch, doubted):
    grown, told = [], lambda share, words: None
    monkeypatch.setattr(module, "grow_masks", lambda *what, **more: grown.append(more))
    monkeypatch.setattr(module, "outlines_contradict", lambda made: True)
    module._grow_and_describe(None, None, False, told, doubted_poses=doubted)  # type: ignore[arg-type]
    assert len(grown) == (1 if doubted else 2)
