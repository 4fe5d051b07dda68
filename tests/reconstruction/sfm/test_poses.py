"""Where photographs, or frames of a video, were taken from."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace

import imageio_ffmpeg
import numpy as np
import pytest
from colmap_writer import write_colmap
from PIL import Image

from corporeal.core.errors import BadFileError, UserError
from corporeal.io.input_files import input_kind, lacks_poses, list_input_files, photos_in_folder
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.multiview.silhouette_coherence import MIN_MASK_FILLED_FRACTION
from corporeal.reconstruction import gaussian_source as reconstructing
from corporeal.reconstruction.masks.grown_masks import GrownMasks
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.sfm import find_poses as posing
from corporeal.reconstruction.sfm.find_poses import (
    CAMERAS_FIGURE_FILE,
    describe_moved_object,
    find_object_poses,
    find_poses,
)
from corporeal.reconstruction.sfm.mask_consistency import remove_by_masks
from corporeal.reconstruction.sfm.pose_acceptance import model_doubts, some_names, thorough_in_vain
from corporeal.reconstruction.sfm.prepare_images import prepare_images
from corporeal.reconstruction.sfm.sfm_run import SfmRun, names_by_camera, pictures_beside_first
from corporeal.reconstruction.sfm.video_frames import StaticPixels, choose_frames, write_video_frames
from corporeal.render.camera_placement import camera_from_aim
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from corporeal.render.video_file import open_video
from patterned_scene import OF_SLAB, blots, patterned, photographs, pose_errors, ring, stepped

COUNT = 14
TURN_ABOUT_Z = np.array([[0, -1.0, 0, 0.3], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
AWAY = np.array([[1, 0, 0, 0.06], [0, 1, 0, 0.04], [0, 0, 1, 0], [0, 0, 0, 1.0]])
TURN_RIGHT = 6
"""EXIF: the picture is to be turned by a quarter to the right."""


def silent(fraction, words):
    pass


# ---------------------------------------------------------------- photographs


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """A folder of photographs around a patterned block, and their cameras."""
    folder = tmp_path_factory.mktemp("taken") / "photos"
    return folder, photographs(folder, ring(np.arange(COUNT) * 360 / COUNT, (320, 240)))


@pytest.fixture(scope="module")
def spoilt(taken, tmp_path_factory):
    """The same with a picture held upright, and with all that goes wrong in folders."""
    folder = tmp_path_factory.mktemp("spoilt") / "photos"
    shutil.copytree(taken[0], folder)
    with Image.open(folder / "photo_003.jpg") as picture:
        exif = Image.Exif()
        exif[0x0112] = TURN_RIGHT
        turned = picture.transpose(Image.Transpose.ROTATE_90)
        turned.save(folder / "photo_003.jpg", quality=95, exif=exif)
    shutil.copy(folder / "photo_001.jpg", folder / "photo_001 (copy).jpg")
    (folder / "broken.jpg").write_bytes((folder / "photo_002.jpg").read_bytes()[:900])
    (folder / "phone.heic").write_bytes(b"\0\0\0\x18ftypheic" + bytes(100))
    Image.new("RGB", (320, 240), (3, 3, 3)).save(folder / "lens cap.jpg")
    return folder


def test_cameras_are_found_where_they_were(taken, spoilt, tmp_path):
    pytest.importorskip("pycolmap")
    found = find_poses(spoilt, tmp_path / "poses", silent)
    seen = read_posed_photos(found.folder)
    true = [taken[1][int(name[6:9])] for name in seen.names]
    assert len(seen.names) == COUNT, "also the one that was held upright"
    angle, place = pose_errors(seen.views.cameras, true)
    assert angle.max() < 0.5 and place.max() < 0.01
    assert f"{COUNT} of {COUNT} photographs" in found.statements[0]
    (told,) = found.warnings
    for name in ("broken.jpg is damaged", "phone.heic is a HEIC picture", "lens cap.jpg shows nothing"):
        assert name in told
    assert "photo_001.jpg shows the same as photo_001_(copy).jpg" in told
    assert (found.folder / CAMERAS_FIGURE_FILE).stat().st_size > 10_000
    assert (found.folder / "sparse" / "0" / "images.txt").exists()


def test_pictures_that_were_cropped_each_differently_are_posed_by_where_their_lenses_were(taken, tmp_path):
    pytest.importorskip("pycolmap")
    rng = np.random.default_rng(5)
    (tmp_path / "cropped").mkdir()
    for k in range(COUNT):
        with Image.open(taken[0] / f"photo_{k:03d}.jpg") as picture:
            left, top, right, low = (rng.uniform(0, 0.15, 4) * [320, 240, 320, 240]).astype(int)
            cut = picture.crop((left, top, 320 - right, 240 - low))
            cut.save(tmp_path / "cropped" / f"photo_{k:03d}.jpg", quality=95)
    seen = read_posed_photos(find_poses(tmp_path / "cropped", tmp_path / "poses", silent).folder)
    assert len(seen.names) == COUNT
    angle, place = pose_errors(seen.views.cameras, taken[1])
    assert np.median(angle) < 1.25 and np.median(place) < 0.01, "1.5° and 2.1 % by their middles"


@pytest.fixture
def turned_over(tmp_path, monkeypatch):
    """Two rounds about a block that was turned over between them, and what attempts come to.

    By the slab all pictures fit together; by what is inside masks too, where that is found.
    """
    folder, aims = tmp_path / "photos", ring(np.arange(COUNT) * 360 / COUNT, (160, 120), 0.2, 0.28)
    (folder / "masks").mkdir(parents=True)
    back = np.diag([1.0, -1.0, -1.0, 1.0])
    back[:3, 3] = -0.02, 0.01, 0.12
    by_slab, by_block, names = [], [], []
    for turned in (False, True):
        stage = RayScene(stepped(turned))
        for k, aim in enumerate(aims):
            names.append(f"{int(turned)}_{k:02d}.jpg")
            mask = np.uint8(255) * (identify_triangles(stage, aim)[0] >= OF_SLAB)
            Image.fromarray(mask).save(folder / "masks" / f"{names[-1][:-4]}.png")
            noise = np.random.default_rng(len(names)).integers(0, 255, (120, 160, 3))
            Image.fromarray(noise.astype(np.uint8)).save(folder / names[-1])
            camera = camera_from_aim(aim)
            by_slab.append(camera)
            seen = back @ camera.world_from_camera if turned else camera.world_from_camera
            by_block.append(replace(camera, world_from_camera=seen))
    models, tried = {"plain": by_slab, "masked": by_block}, []

    def attempt(source, out, gathered, way, progress):
        tried.append(way)
        points = np.random.default_rng(0).normal(size=(2000, 3))
        cameras = models[way] if way in models else []
        if cameras:
            grey = np.full((2000, 3), 90, np.uint8)
            write_colmap(out / "sparse" / "0", tuple(cameras), tuple(names), points, grey)
        return SfmRun(way, len(names), len(cameras), 9000 * bool(cameras), focal=1.0)

    monkeypatch.setattr(posing, "run_sfm", attempt)
    return folder, models, tried


@pytest.mark.slow
def test_an_object_that_was_turned_over_is_posed_by_what_its_masks_show(turned_over, tmp_path):
    """All pictures fit by the floor, and no count of the model speaks against that."""
    folder, models, tried = turned_over
    found = find_poses(folder, tmp_path / "poses", silent)
    assert tried == ["plain", "masked"] and found.warnings == ()
    assert "from points on objects alone" in found.statements[0]
    angle, place = pose_errors(read_posed_photos(found.folder).views.cameras, models["masked"])
    assert angle.max() < 0.01 and place.max() < 1e-4
    kept = json.loads((tmp_path / "poses" / "poses.json").read_text())
    first, last = (told["filled"] for told in kept["attempts"])
    assert first < MIN_MASK_FILLED_FRACTION < last


def test_masks_that_nothing_agrees_with_are_a_warning(turned_over, tmp_path):
    """They may be poor: what all pictures agree on is not refused for them."""
    folder, models, tried = turned_over
    models["masked"] = []
    found = find_poses(folder, tmp_path / "poses", silent)
    assert tried == ["plain", "masked"], "what is plainly believed needs no thorough attempt"
    assert "masks alone" not in found.statements[0] and len(found.warnings) >= 1
    assert "turned over between the pictures, or masks miss parts" in found.warnings[-1]


@pytest.mark.slow
def test_masks_that_were_grown_later_find_an_object_that_was_turned_over(turned_over, tmp_path):
    """Nobody drew masks: those that are grown under the slab's poses contradict each other."""
    folder, models, _ = turned_over
    by_block = models.pop("masked")
    by_slab = find_poses(folder, tmp_path / "poses", silent)
    masks = folder / "masks"
    why = describe_moved_object(by_slab, masks)
    assert why is not None and "moved or turned over between the pictures" in why
    assert find_object_poses(by_slab, masks, tmp_path / "nothing", silent) is None
    models["masked"] = by_block
    assert find_object_poses(by_slab, masks, tmp_path / "nothing", silent) is None, "it is remembered"
    found = find_object_poses(by_slab, masks, tmp_path / "object", silent)
    assert found is not None and not (found.folder / "masks").exists()
    assert describe_moved_object(found, masks) is None
    angle, place = pose_errors(read_posed_photos(found.folder).views.cameras, by_block)
    assert angle.max() < 0.01 and place.max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    "how", ["refused", *(pytest.param(how, marks=pytest.mark.slow) for how in ("forced", "found", "still"))]
)
def test_a_run_does_not_believe_poses_of_the_background(turned_over, tmp_path, how, monkeypatch):
    folder, models, _ = turned_over
    by_block = models.pop("masked")
    if how == "still":
        models["plain"][COUNT:] = models["plain"][:COUNT]
    shutil.copytree(folder / "masks", tmp_path / "grown" / "masks")
    if how == "still":
        for k in range(COUNT):
            first = tmp_path / "grown" / "masks" / f"0_{k:02d}.png"
            shutil.copy(first, first.with_name(f"1_{k:02d}.png"))
    by_slab = find_poses(folder, tmp_path / "poses", silent)
    models["masked"] = by_block if how == "found" else []
    monkeypatch.setattr(reconstructing, "find_poses", lambda *what: by_slab)
    monkeypatch.setattr(reconstructing, "has_masks", lambda shots: False)
    grown = GrownMasks(tmp_path / "grown", ())
    monkeypatch.setattr(reconstructing, "grown_masks", lambda *what, **more: grown)
    config = ReconstructConfig(force=how == "forced")
    if how == "refused":
        with pytest.raises(BadFileError, match="turned over between the pictures, and it has"):
            reconstructing._find_source_poses(folder, config, tmp_path / "run", silent)
        return
    found = reconstructing._find_source_poses(folder, config, tmp_path / "run", silent)
    assert found is not None
    assert (found.folder == by_slab.folder) == (how != "found")
    assert (found.warnings != by_slab.warnings) == (how != "still")


def test_a_picture_on_the_wrong_piece_of_a_pattern_is_left_out(taken, tmp_path):
    """As one of the bananas on a carpet was: right by reprojection, wrong by its silhouette."""
    pytest.importorskip("pycolmap")
    scene, folder = RayScene(patterned()), tmp_path / "poses"
    aims = ring(np.arange(COUNT) * 360 / COUNT, (320, 240))
    (folder / "masks").mkdir(parents=True)
    for k, aim in enumerate(aims):
        mask = np.uint8(255) * (identify_triangles(scene, aim)[0] >= OF_SLAB)
        Image.fromarray(mask).save(folder / "masks" / f"photo_{k:03d}.png")
    names = tuple(f"photo_{k:03d}.jpg" for k in range(COUNT))
    cameras = list(taken[1])
    cameras[4] = replace(cameras[4], world_from_camera=AWAY @ cameras[4].world_from_camera)
    write_colmap(tmp_path / "model", tuple(cameras), names)
    told = SfmRun("plain", COUNT, registered=COUNT, points=9000, focal=1.0)
    left = remove_by_masks(told, folder, tmp_path / "model")
    assert left.astray == ("photo_004.jpg",) and left.registered == COUNT - 1
    assert left.filled > MIN_MASK_FILLED_FRACTION
    assert "photo_004.jpg" not in (tmp_path / "model" / "images.txt").read_text()
    again = remove_by_masks(told, folder, tmp_path / "model")
    assert again.astray == () and again.registered == COUNT


def test_what_was_found_is_not_looked_for_again(taken, tmp_path, monkeypatch):
    pytest.importorskip("pycolmap")
    tried = []

    def attempt(folder, out, gathered, way, progress):
        tried.append(way)
        return SfmRun(way, COUNT, registered=5, points=20)

    monkeypatch.setattr(posing, "run_sfm", attempt)
    said = []
    for _ in range(2):
        with pytest.raises(BadFileError, match=r"only 5 of 14 pictures fit together; there are 4 "):
            said.append(1)
            find_poses(taken[0], tmp_path / "poses", silent)
    assert tried == ["plain", "thorough"], "both attempts once"
    shutil.copytree(taken[0], tmp_path / "other")
    (tmp_path / "other" / "photo_000.jpg").unlink()
    with pytest.raises(BadFileError, match="Put the object on something with a pattern"):
        find_poses(tmp_path / "other", tmp_path / "poses", silent)
    assert len(tried) == 4, "other pictures are looked at anew"


def test_pycolmap_is_asked_for_where_it_is_absent(taken, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(UserError, match=r"pip install 'corporeal\[poses\]'"):
        find_poses(taken[0], tmp_path / "poses", silent)


@pytest.mark.parametrize("kind", ["black", "same", "broken", "heic"])
def test_folders_that_show_nothing_are_refused_in_one_sentence(taken, tmp_path, kind):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(30):
        if kind == "black":
            noise = np.random.default_rng(k).integers(0, 3, (240, 320, 3)).astype(np.uint8)
            Image.fromarray(noise).save(folder / f"{k}.jpg")
        elif kind == "same":
            shutil.copy(taken[0] / "photo_000.jpg", folder / f"{k}.jpg")
        else:
            data = b"\0\0\0\x18ftypheic" if kind == "heic" else b"\xff\xd8\xff"
            (folder / f"{k}.{kind if kind == 'heic' else 'jpg'}").write_bytes(data + bytes(50))
    said = {
        "black": "none of 30 photographs can be used.*shows nothing but one colour",
        "same": "only 1 of 30 photographs can be used.*shows the same as 0.jpg",
        "broken": "none of 30 photographs can be used.*is no PNG, JPEG or WebP",
        "heic": "none of 30 photographs can be used.*is a HEIC picture: convert it to JPEG",
    }
    assert input_kind([folder]) == "photographs" and lacks_poses(folder)
    with pytest.raises(BadFileError, match=said[kind]) as error:
        prepare_images(folder, tmp_path / "poses", silent)
    assert "\n" not in str(error.value)


def test_of_very_many_photographs_some_are_used(tmp_path):
    rng = np.random.default_rng(0)
    (tmp_path / "photos").mkdir()
    for k in range(250):
        picture = rng.integers(0, 255, (12, 16, 3)).astype(np.uint8)
        Image.fromarray(picture).resize((64, 48)).save(tmp_path / "photos" / f"{k:03d}.png")
    found = prepare_images(tmp_path / "photos", tmp_path / "poses", silent)
    assert len(found.names) == 84
    assert "Of 250 photographs, one in 3 was used." in found.said


def test_masks_are_turned_with_their_photographs(tmp_path):
    (tmp_path / "photos" / "masks").mkdir(parents=True)
    rng = np.random.default_rng(0)
    exif = Image.Exif()
    exif[0x0112] = TURN_RIGHT
    for k in range(4):
        picture = Image.fromarray(rng.integers(0, 255, (6, 8, 3)).astype(np.uint8))
        picture.resize((64, 48), Image.Resampling.NEAREST).save(tmp_path / "photos" / f"{k}.png", exif=exif)
        mask = np.zeros((48, 64), np.uint8)
        mask[:, :10] = 255  # the left in the file is the top as it is shown
        if k % 2:
            mask = np.rot90(mask, -1)  # drawn on the picture as it is shown
        Image.fromarray(mask).save(tmp_path / "photos" / "masks" / f"{k}.png")
    prepare_images(tmp_path / "photos", tmp_path / "poses", silent)
    for k in range(4):
        with Image.open(tmp_path / "poses" / "masks" / f"{k}.png") as mask:
            white = np.asarray(mask) > 128
        assert white.shape == (64, 48) and white[:10].all() and not white[10:].any()


def test_photographs_lie_in_a_folder_or_in_its_images(tmp_path):
    (tmp_path / "scan" / "images").mkdir(parents=True)
    (tmp_path / "scan" / "masks").mkdir()
    for name in ("images/b.JPG", "images/a.png", "masks/a.png", "notes.txt"):
        (tmp_path / "scan" / name).touch()
    assert [p.name for p in photos_in_folder(tmp_path / "scan")] == ["a.png", "b.JPG"]
    assert input_kind([tmp_path / "scan"]) == "photographs"
    (tmp_path / "a.MOV").touch()
    assert input_kind([tmp_path / "a.MOV"]) == "photographs" and lacks_poses(tmp_path / "a.MOV")
    assert list_input_files([tmp_path / "a.MOV"]) == [tmp_path / "a.MOV"]


# ---------------------------------------------------------------- what is believed

RIGHT = {
    "a patterned slab": SfmRun("plain", 48, 48, 13_999, 0.21, (), 1.0, 0.01),
    "a plain floor": SfmRun("thorough", 48, 47, 2403, 0.98, (), 1.0, 0.05),
    "real": SfmRun("thorough", 13, 12, 2092, 0.43, (), 0.99, 0.1),
    "a video": SfmRun("plain", 30, 30, 9705, 0.3, (), 1.0, 0.0),
}
WRONG = {
    "nothing": (SfmRun("thorough", 20), "no two pictures"),
    "groups": (SfmRun("plain", 48, 34, 2000, 0.5, (18,), 1.0, 0.0), "groups of 34 and 18"),
    "few": (SfmRun("thorough", 24, 11, 541, 0.9, (), 0.85, 0.1), "only 11 of 24"),
    "a lens": (SfmRun("thorough", 24, 20, 1541, 0.9, (), 0.85, 0.55), "k1 0.55"),
    "a vase": (SfmRun("thorough", 48, 40, 380, 1.1, (), 1.0, 0.0), "10 points per picture"),
    "a lens of a vase": (SfmRun("thorough", 48, 40, 4000, 1.1, (), 0.14, 0.0), "focal length 0.14"),
}


@pytest.mark.parametrize("name", RIGHT)
def test_models_that_were_right_are_believed(name):
    """Measured against known poses, docs/reference/input-files.md."""
    assert model_doubts(RIGHT[name]) == []


@pytest.mark.parametrize("name", WRONG)
def test_models_that_were_wrong_are_not(name):
    told, said = WRONG[name]
    assert any(said in clause for clause in model_doubts(told))
    cured = replace(told, pictures=40, registered=40, points=4000, others=(), focal=1.0, bent=0.0)
    assert model_doubts(cured) == [], "each has one thing wrong, or several, and nothing else"


def test_a_group_that_says_the_same_again_is_no_rival():
    """COLMAP begins anew at pictures that it has placed: 20 far apart gave 17 that were right, and
    12 of these once more."""
    pycolmap = pytest.importorskip("pycolmap")
    eyes = [camera_from_aim(aim).world_from_camera for aim in ring(np.arange(12) * 30)]
    first = model_of(pycolmap, eyes)
    turned = [TURN_ABOUT_Z @ eye for eye in eyes[4:]]
    assert pictures_beside_first(first, model_of(pycolmap, turned, 4)) == 0
    assert pictures_beside_first(first, model_of(pycolmap, [*turned, np.eye(4), np.eye(4)], 4)) == 2
    mirrored = [eyes[k] for k in (8, 4, 9, 5, 10, 6, 11, 7)]
    assert pictures_beside_first(first, model_of(pycolmap, mirrored, 4)) == 8, "it contradicts"


def model_of(pycolmap, eyes, begin=0):
    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(pycolmap.Camera(model=0, width=4, height=4, params=[4, 2, 2], camera_id=1))
    for k, eye in enumerate(eyes):
        image = pycolmap.Image(f"{begin + k}.jpg", image_id=k + 1, camera_id=1)
        pose = np.linalg.inv(eye)[:3]
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    return model


def test_pictures_of_two_lenses_have_two_cameras(tmp_path):
    """A telephone has several, and their pictures one size; EXIF tells them apart."""
    (tmp_path / "photos").mkdir()
    for k in range(6):
        exif = Image.Exif()
        exif.get_ifd(0x8769)[0xA405] = 52 if k % 2 else 26
        noise = np.random.default_rng(k).integers(0, 255, (30, 40, 3)).astype(np.uint8)
        Image.fromarray(noise).save(tmp_path / "photos" / f"{k}.jpg", exif=exif)
    gathered = prepare_images(tmp_path / "photos", tmp_path / "poses", silent)
    assert names_by_camera(tmp_path / "poses" / "images", gathered) == [
        ["0.jpg", "2.jpg", "4.jpg"],
        ["1.jpg", "3.jpg", "5.jpg"],
    ]


def test_only_pictures_that_points_join_can_be_placed():
    told = SfmRun("plain", 20, joined=7)
    assert model_doubts(told) == ["only 7 of 20 pictures share points with one another"]
    assert thorough_in_vain(told, 0) and not thorough_in_vain(replace(told, joined=20), 0)
    assert thorough_in_vain(replace(told, joined=20), 12), "most are blurred"
    assert model_doubts(replace(told, joined=20)) == ["no two pictures share enough points"]


def test_eight_names_are_enough():
    assert some_names(("a", "b")) == "a, b"
    assert some_names(tuple("abcdefghijk")) == "a, b, c, d, e, f, g, h and 3 more"


# ---------------------------------------------------------------- videos


def test_frames_are_sharp_and_equally_far_apart():
    change = np.concatenate([np.full(50, 1.0), np.zeros(100), np.full(50, 1.0)])
    sharp = np.full(200, 10.0)
    sharp[[10, 160]] = 20.0
    sharp[20:24] = 1.0
    chosen = choose_frames(change, sharp, 10)
    assert 10 in chosen and 160 in chosen
    assert sum(50 <= k < 150 for k in chosen) <= 1, "a hand that rests gives no frames"
    assert not set(chosen) & set(range(20, 24)), "smeared"
    assert choose_frames(np.zeros(30), np.ones(30), 10) == []
    # A stretch that is smeared as a whole gives none.
    sharp[:] = 10.0
    sharp[20:30] = 1.0
    assert not set(choose_frames(np.full(200, 1.0), sharp, 20)) & set(range(20, 30))


def video(path, count, smeared=lambda k: False, size=(320, 240)):
    """A camera that passes over a newspaper; some frames are smeared."""
    paper = np.kron(blots(0, 512), np.ones((2, 2, 1), np.uint8))
    with open_video(path, 30, size) as made:
        for k in range(count):
            y, x = 2 * k, 4 * k % (paper.shape[1] - size[0])
            picture = paper[y : y + size[1], x : x + size[0]]
            if smeared(k):
                shifted = [np.roll(picture.astype(float), s, axis=1) for s in range(12)]
                picture = np.mean(shifted, axis=0).astype(np.uint8)
            made.add(np.ascontiguousarray(picture))
    return path


@pytest.mark.slow
def test_a_video_gives_sharp_frames(tmp_path):
    path = video(tmp_path / "a.mp4", 120, lambda k: k % 12 < 4)
    said = write_video_frames(path, tmp_path / "frames", silent)
    numbers = [int(p.stem[6:]) for p in sorted((tmp_path / "frames").iterdir())]
    assert 40 <= len(numbers) <= 60 and "120 that were looked at" in said[0]
    assert np.mean([k % 12 < 4 for k in numbers]) <= 0.1
    with Image.open(tmp_path / "frames" / f"frame_{numbers[5]:05d}.png") as picture:
        shown = np.asarray(picture, float)
    paper = np.kron(blots(0, 512), np.ones((2, 2, 1), np.uint8))
    y, x = 2 * numbers[5], 4 * numbers[5]
    assert np.abs(shown - paper[y : y + 240, x : x + 320]).mean() < 12, "and not another frame"


@pytest.mark.slow
def test_a_video_that_was_held_upright_is_turned(tmp_path, caplog):
    video(tmp_path / "a.mp4", 60)
    program = imageio_ffmpeg.get_ffmpeg_exe()
    command = [program, "-v", "error", "-display_rotation", "90", "-i", str(tmp_path / "a.mp4")]
    subprocess.run([*command, "-c", "copy", str(tmp_path / "b.mp4")], check=True)
    write_video_frames(tmp_path / "b.mp4", tmp_path / "frames", silent)
    with Image.open(next((tmp_path / "frames").iterdir())) as picture:
        assert picture.size == (240, 320)
    assert caplog.records == [], "nothing is said of it in the terminal"


@pytest.mark.parametrize("kind", ["ten frames", "still", "noise", "empty", "text", "long"])
def test_videos_that_will_not_do_are_refused_in_one_sentence(tmp_path, kind):
    path, said, longest = tmp_path / "a.mp4", "cannot be read as a video", 600.0
    if kind == "ten frames":
        said = "holds 10 frames; at least 20"
        video(path, 10)
    elif kind == "still":
        said = "none of 40 frames are sharp and differ"
        with open_video(path, 30, (320, 240)) as made:
            for _ in range(40):
                made.add(np.full((240, 320, 3), 90, np.uint8))
    elif kind == "long":
        said, longest = "is 0 minutes long; at most", 0.5
        video(path, 30)
    else:
        path.write_bytes({"noise": bytes(range(256)) * 50, "empty": b"", "text": b"video"}[kind])
    with pytest.raises(BadFileError, match=said) as error:
        write_video_frames(path, tmp_path / "frames", silent, longest)
    assert "\n" not in str(error.value)


def test_a_recording_of_a_screen_is_refused(tmp_path):
    """A page that scrolls in a window whose frame stands still."""
    page = np.kron(blots(0, 512), np.ones((2, 2, 1), np.uint8))
    frame = blots(3, 256)[:240].repeat(2, axis=1)[:, :320]
    with open_video(tmp_path / "a.mp4", 30, (320, 240)) as made:
        for k in range(60):
            shown = frame.copy()
            shown[40:220, 60:] = page[8 * k : 8 * k + 180, :260]
            made.add(shown)
    with pytest.raises(BadFileError, match="never moves: it is a recording of a screen") as error:
        write_video_frames(tmp_path / "a.mp4", tmp_path / "frames", silent)
    assert "\n" not in str(error.value) and "Do not turn the object" in str(error.value)


def test_what_stands_still_before_a_plain_wall_is_no_screen():
    """A turntable; and a camera that moves."""
    moves, turns = StaticPixels(), StaticPixels()
    paper = blots(0, 512)[..., 0]
    for k in range(40):
        moves.look(paper[k : k + 200, 3 * k : 3 * k + 300].copy())
        plain = np.full((200, 300), 200, np.uint8)
        plain[60:140, 100:200] = paper[60:140, 3 * k : 3 * k + 100]
        turns.look(plain)
    assert moves.share < 0.01 and turns.share < 0.05


def test_a_video_that_is_not_there_is_named(tmp_path):
    """A scene file that named one ended as a mistake of ours."""
    with pytest.raises(BadFileError, match=r"none\.mp4: there is no such file"):
        find_poses(tmp_path / "none.mp4", tmp_path / "poses", lambda share, what: None)
