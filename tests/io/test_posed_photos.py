"""Photographs with poses say the same in every format; bad ones are named or left out."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from colmap_writer import write_colmap
from PIL import Image

from corporeal.core.errors import BadFileError
from corporeal.core.types import Camera, Finish, Scene, SceneObject, Surface, Views
from corporeal.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from corporeal.io.photos.colmap import read_colmap
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.io.photos.projection_matrices import check_focal, split_projection
from corporeal.io.photos.transforms_json import write_views
from corporeal.multiview.epipolar import projection_matrix
from corporeal.pipeline.stages.capture import CaptureConfig, capture

SIZE = (80, 64)


@pytest.fixture(scope="module")
def views():
    """Return captured views of a box."""
    box = trimesh.creation.box((0.6, 0.4, 0.4))
    box.apply_translation((0.1, -0.2, 0.2))
    surface = Surface("box", 0, 0, np.asarray(box.vertices), np.asarray(box.faces))
    scene = Scene("box", "", (SceneObject("box", "box", 0.6),), (surface,), (Finish("grey"),))
    made = capture(scene, CaptureConfig(views=5, size=SIZE, threads=1))
    lenses = [replace(c, K=c.K + np.array([[0, 0, k], [0, 2, 1.5], [0, 0, 0]])) for k, c in enumerate(made.cameras)]
    return Views(rgb=made.rgb, cameras=tuple(lenses))


NAMES = tuple(f"shot {k}.png" for k in range(5))


def keep_pictures(folder, views, names=NAMES):
    for name, rgb in zip(names, views.rgb, strict=True):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(rgb).save(folder / name)


def keep_binary(folder, cameras, names, points, model=1):
    """Write COLMAP's binary files, with points seen in images, as COLMAP does."""
    folder.mkdir(parents=True)
    count = struct.pack("<Q", len(cameras))
    lenses = images = count
    for k, (camera, name) in enumerate(zip(cameras, names, strict=True)):
        K, pose = camera.K, camera.world_from_camera
        lenses += struct.pack("<iiQQ4d", k, model, camera.width, camera.height, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        turn, shift = quaternion_from_matrix(pose[:3, :3].T), -pose[:3, :3].T @ pose[:3, 3]
        images += struct.pack("<I7dI", 9 - k, *turn, *shift, k) + name.encode() + b"\0"
        images += struct.pack("<Q", k) + struct.pack("<ddq", 1.0, 2.0, -1) * k
    rows = struct.pack("<Q", len(points))
    for k, point in enumerate(points):
        rows += (
            struct.pack("<Q3d3Bd", k, *point, 10, 20, 30, 0.5)
            + struct.pack("<Q", k % 3)
            + struct.pack("<II", 1, 2) * (k % 3)
        )
    for file, data in (("cameras", lenses), ("images", images), ("points3D", rows)):
        (folder / f"{file}.bin").write_bytes(data)


POINTS = np.random.default_rng(0).normal(size=(7, 3))


def test_colmap_says_in_which_pictures_points_are_seen(tmp_path, views):
    write_colmap(tmp_path / "text", views.cameras, NAMES, POINTS)
    file = tmp_path / "text" / "points3D.txt"
    lines = file.read_text(encoding="utf-8").splitlines()
    lines[2] += " 4 0 2 7 4 9 77 1"  # images 4 and 2, the first of them twice; 77 is not there
    lines[4] += " 1 5"
    file.write_text("\n".join(lines), encoding="utf-8")
    assert read_colmap(tmp_path / "text").sightings.tolist() == [[0, 4], [1, 2], [3, 2]]
    keep_binary(tmp_path / "binary", views.cameras, NAMES, POINTS)
    rows = (tmp_path / "binary" / "points3D.bin").read_bytes()
    seen = rows.replace(struct.pack("<II", 1, 2), struct.pack("<II", 7, 2))
    (tmp_path / "binary" / "points3D.bin").write_bytes(seen)
    # Images are numbered 9, 8, 7 … there; of every three points the last two are seen.
    assert read_colmap(tmp_path / "binary").sightings.tolist() == [[2, 1], [2, 2], [2, 4], [2, 5]]
    write_colmap(tmp_path / "none", views.cameras, NAMES, POINTS)
    assert read_colmap(tmp_path / "none").sightings.shape == (0, 2)


def keep_as(kind, folder, views):
    """Write pictures and poses in one of the formats."""
    if kind == "transforms":
        write_views(folder, views)
        return
    place = folder if "3x4" in kind else folder / "images"
    keep_pictures(place, views)
    if kind == "colmap text":
        write_colmap(folder / "sparse" / "0", views.cameras, NAMES, POINTS, np.full((7, 3), [10, 20, 30], "u1"))
    elif kind == "colmap binary":
        keep_binary(folder / "sparse", views.cameras, NAMES, POINTS)
    for k, camera in enumerate(views.cameras if "3x4" in kind else ()):
        P = projection_matrix(camera) * (-1.0) ** k * 3.7
        if kind == "3x4 text":
            text = "CONTOUR\n" * (k % 2) + "\n".join(" ".join(repr(float(x)) for x in row) for row in P)
            (folder / f"shot {k}.txt").write_text(text)
        else:
            (folder / "projections").mkdir(exist_ok=True)
            np.save(folder / "projections" / f"shot {k}.npy", P)


KINDS = ["transforms", "colmap text", "colmap binary", "3x4 text", "3x4 npy"]


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_says_the_same(tmp_path, views, kind):
    keep_as(kind, tmp_path, views)
    read = read_posed_photos(tmp_path)
    np.testing.assert_array_equal(read.views.rgb, views.rgb)
    for found, given in zip(read.views.cameras, views.cameras, strict=True):
        np.testing.assert_allclose(found.K, given.K, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.world_from_camera, given.world_from_camera, atol=1e-9)
        assert (found.width, found.height) == SIZE
    assert read.z_up is (kind == "transforms")
    assert (read.masks, read.warnings) == (None, ())
    if "colmap" in kind:
        np.testing.assert_allclose(read.points, POINTS)
        assert (read.colours == [10, 20, 30]).all()


def test_a_projection_matrix_comes_apart_as_it_was_put_together():
    rng = np.random.default_rng(3)
    for sign in (1, -1):
        for _ in range(20):
            K = np.array(
                [[rng.uniform(50, 900), rng.normal(), rng.uniform(10, 400)], [0, rng.uniform(50, 900), 120], [0, 0, 1]]
            )
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = (matrix_from_quaternion(rng.normal(size=4)), rng.normal(size=3))
            P = sign * rng.uniform(0.1, 9) * projection_matrix(Camera(K, pose, 100, 100))
            found, stood = split_projection(Path("P"), P)
            np.testing.assert_allclose(found, K, rtol=1e-8, atol=1e-8)
            np.testing.assert_allclose(stood, pose, atol=1e-8)
            assert np.linalg.det(stood[:3, :3]) == pytest.approx(1)


# ---------------------------------------------------------------- what others write


def said(folder, count=4, **more):
    """Write pictures and a file in the manner of NeRF's synthetic scenes."""
    frames = []
    for k in range(count):
        turn = 2 * np.pi * k / count
        eye = np.array([3 * np.cos(turn), 3 * np.sin(turn), 1.0])
        back = eye / np.linalg.norm(eye)
        right = np.cross([0, 0, 1], back) / np.linalg.norm(np.cross([0, 0, 1], back))
        pose = np.eye(4)
        pose[:3, :4] = np.stack([right, np.cross(back, right), back, eye], axis=1)
        frames.append({"file_path": f"./train/r_{k}", "transform_matrix": pose.tolist()})
        if not (folder / "train").exists():
            (folder / "train").mkdir()
        Image.fromarray(np.full((12, 16, 3), (40 * k + 20) % 256, np.uint8)).save(folder / "train" / f"r_{k}.png")
    whole = {"camera_angle_x": 0.7, "frames": frames} | more
    (folder / "transforms.json").write_text(json.dumps(whole))
    return whole


def keep(folder, whole, name="transforms.json"):
    (folder / name).write_text(json.dumps(whole))


def test_an_angle_alone_is_enough_and_the_suffix_may_lack(tmp_path):
    whole = said(tmp_path)
    read = read_posed_photos(tmp_path)
    focal = 8 / np.tan(0.35)
    np.testing.assert_allclose(read.views.cameras[2].K, [[focal, 0, 8], [0, focal, 6], [0, 0, 1]])
    pose = np.array(whole["frames"][2]["transform_matrix"])
    np.testing.assert_allclose(read.views.cameras[2].world_from_camera[:3, 2], -pose[:3, 2], atol=1e-12)
    assert [int(r[0, 0, 0]) for r in read.views.rgb] == [20, 60, 100, 140]
    assert read.z_up
    (tmp_path / "transforms.json").rename(tmp_path / "transforms_train.json")
    assert len(read_posed_photos(tmp_path).names) == 4
    assert len(read_posed_photos(tmp_path / "transforms_train.json").names) == 4


def test_names_are_understood_as_other_systems_write_them(tmp_path):
    whole = said(tmp_path, aabb_scale=16, offset=[0.5, 0.5, 0.5], scale=0.3)
    for k, name in enumerate([".\\train\\r_0", "train/../train/r_1.png", "train/r_2"]):
        whole["frames"][k]["file_path"] = name
    (tmp_path / "train" / "r_2.png").rename(tmp_path / "train" / "r_2.JPG")
    keep(tmp_path, whole)
    assert len(read_posed_photos(tmp_path).names) == 4


def test_each_frame_may_have_its_own_lens(tmp_path):
    whole = said(tmp_path, fl_x=30.0, fl_y=31.0, cx=7.0, cy=5.0, w=16, h=12)
    whole["frames"][1] |= {"fl_x": 40.0, "cy": 6.5}
    keep(tmp_path, whole)
    cameras = read_posed_photos(tmp_path).views.cameras
    np.testing.assert_allclose(cameras[0].K, [[30, 0, 7], [0, 31, 5], [0, 0, 1]])
    np.testing.assert_allclose(cameras[1].K, [[40, 0, 7], [0, 31, 6.5], [0, 0, 1]])


def test_pictures_smaller_than_the_camera_says_are_understood(tmp_path):
    said(tmp_path, fl_x=300.0, fl_y=310.0, cx=70.0, cy=50.0, w=160, h=120)
    camera = read_posed_photos(tmp_path).views.cameras[0]
    np.testing.assert_allclose(camera.K, [[30, 0, 7], [0, 31, 5], [0, 0, 1]])


# ---------------------------------------------------------------- masks


def test_what_is_transparent_is_masked_and_white(tmp_path):
    said(tmp_path)
    for k in range(4):
        rgba = np.full((12, 16, 4), (10, 20, 30, 255), np.uint8)
        rgba[:, :8, 3] = 51
        Image.fromarray(rgba).save(tmp_path / "train" / f"r_{k}.png")
    read = read_posed_photos(tmp_path)
    assert (read.masks[:, :, :8] == 51).all() and (read.masks[:, :, 8:] == 255).all()
    assert (read.views.rgb[:, :, :8] == (206, 208, 210)).all()  # a fifth of it on white
    assert (read.views.rgb[:, :, 8:] == (10, 20, 30)).all()


@pytest.mark.parametrize(
    "name", ["masks/r_{}.png", "train/masks/r_{}.png", "masks/r_{}.png.png", "mask/r_{}.jpg", "masks/r_{}_mask.png"]
)
def test_masks_may_lie_in_a_folder(tmp_path, name):
    said(tmp_path)
    mask = np.zeros((12, 16), np.uint8)
    mask[:, 8:] = 255
    for k in range(4):
        path = tmp_path / name.format(k)
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(mask).save(path)
    read = read_posed_photos(tmp_path)
    np.testing.assert_allclose(read.masks, np.broadcast_to(mask, (4, 12, 16)), atol=3)
    assert (read.views.rgb[:, :, :6] >= 252).all()


def test_a_picture_without_a_mask_among_masked_ones_is_left_out(tmp_path):
    said(tmp_path)
    (tmp_path / "masks").mkdir()
    for k in (0, 1, 3):
        Image.fromarray(np.eye(12, 16, dtype=np.uint8) * 255).save(tmp_path / "masks" / f"r_{k}.png")
    read = read_posed_photos(tmp_path)
    assert read.names == ("./train/r_0", "./train/r_1", "./train/r_3")
    assert "1 of 4 pictures were left out: ./train/r_2 has no mask" in read.warnings[0]


def test_masks_that_lie_across_their_pictures_are_refused_and_squares_stretched(tmp_path):
    said(tmp_path)
    (tmp_path / "masks").mkdir()
    for k in range(4):
        path = tmp_path / "masks" / f"r_{k}.png"
        Image.fromarray(np.eye(24, dtype=np.uint8) * 255).save(path)
    assert len(read_posed_photos(tmp_path).masks) == 4
    for k in range(4):
        path = tmp_path / "masks" / f"r_{k}.png"
        Image.fromarray(np.eye(16, 12, dtype=np.uint8) * 255).save(path)
    with pytest.raises(BadFileError, match="12 × 16 pixels, which lies across its 16 × 12: turn"):
        read_posed_photos(tmp_path)


def test_masks_under_names_of_no_photograph_are_reported_to_be_none(tmp_path):
    said(tmp_path)
    (tmp_path / "masks").mkdir()
    Image.fromarray(np.eye(12, 16, dtype=np.uint8) * 255).save(tmp_path / "masks" / "m1.png")
    read = read_posed_photos(tmp_path)
    assert read.masks is None
    assert "None of the 1 pictures in masks" in read.warnings[0]
    assert "m1.png is the first of them, where r_0.png would be one" in read.warnings[0]
    assert read_posed_photos(tmp_path, bare=True).warnings == ()


def test_opaque_pictures_are_not_masked(tmp_path):
    said(tmp_path)
    for k in range(4):
        Image.fromarray(np.full((12, 16, 4), 255, np.uint8)).save(tmp_path / "train" / f"r_{k}.png")
    assert read_posed_photos(tmp_path).masks is None


# ---------------------------------------------------------------- instances

NUMBERS = np.zeros((12, 16), np.int32)
NUMBERS[2:6, 3:9], NUMBERS[6:11, 9:15] = 7, 300


def test_captured_views_say_which_object_is_where(tmp_path, views):
    numbers = np.full(views.rgb.shape[:3], -1, np.int32)
    numbers[:, 10:30, 20:40], numbers[:, 30:50, 20:40] = 0, 4
    write_views(tmp_path, replace(views, object_of_pixel=numbers))
    read = read_posed_photos(tmp_path)
    np.testing.assert_array_equal(read.views.object_of_pixel, numbers)
    np.testing.assert_array_equal(read.masks, np.uint8(255) * (numbers >= 0))
    small = read_posed_photos(tmp_path, longest=40).views.object_of_pixel
    np.testing.assert_array_equal(small, numbers[:, 1::2, 1::2])  # nothing lies between numbers


@pytest.mark.parametrize("kind", ["grey", "colours", "palette"])
@pytest.mark.parametrize("place", ["instances/r_{}.png", "train/objects/r_{}.png"])
def test_instances_may_lie_in_a_folder(tmp_path, place, kind):
    """Every kind tells the same; without masks, all instances are one."""
    said(tmp_path)
    (tmp_path / place).parent.mkdir(parents=True)
    drawn = Image.fromarray(NUMBERS.astype(np.uint16))
    if kind == "colours":
        flat = np.stack([NUMBERS >> 8, NUMBERS & 255, np.zeros_like(NUMBERS)], axis=-1)
        drawn = Image.fromarray(flat.astype(np.uint8))
    if kind == "palette":
        drawn = Image.fromarray((NUMBERS % 255).astype(np.uint8))
        drawn.putpalette(bytes(range(0, 240, 5)) * 16)
    for k in range(4):
        drawn.save(tmp_path / place.format(k))
    read = read_posed_photos(tmp_path)
    assert len(np.unique(read.views.object_of_pixel)) == 3
    for number in (0, 7, 300):
        assert len(np.unique(read.views.object_of_pixel[0][NUMBERS == number])) == 1
    np.testing.assert_array_equal(read.views.object_of_pixel >= 0, [NUMBERS > 0] * 4)
    np.testing.assert_array_equal(read.masks, np.uint8(255) * np.stack([NUMBERS > 0] * 4))


def test_instances_are_straightened_without_numbers_in_between(tmp_path):
    said(tmp_path, camera_model="OPENCV", fl_x=20.0, k1=-0.1, k2=0.01)
    (tmp_path / "instances").mkdir()
    for k in range(4):
        Image.fromarray(NUMBERS.astype(np.uint16)).save(tmp_path / "instances" / f"r_{k}.png")
    read = read_posed_photos(tmp_path)
    assert set(np.unique(read.views.object_of_pixel)) == {-1, 6, 299}
    assert "straightened" in read.warnings[0]


def test_instances_that_a_jpeg_blurred_are_not_believed(tmp_path):
    said(tmp_path)
    (tmp_path / "instances").mkdir()
    for k in range(4):
        shown = Image.fromarray(NUMBERS.astype(np.uint8))
        shown.save(tmp_path / "instances" / f"r_{k}.{'jpg' if k == 1 else 'png'}")
    told = read_posed_photos(tmp_path).warnings[0]
    assert "r_1 has instances of which the picture is a JPEG, which blurs numbers" in told


# ---------------------------------------------------------------- sizes and lenses


def shade(x, y):
    """A smooth picture of directions x, y."""
    return np.stack([128 + 90 * np.sin(3 * x), 128 + 90 * np.cos(4 * y), 128 + 60 * x * y], axis=-1)


def directions(K, width, height):
    v, u = np.mgrid[:height, :width] + 0.5
    return np.moveaxis(np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T, -1, 0)[:2]


def test_pictures_of_other_sizes_are_brought_to_the_most_frequent_with_their_cameras(tmp_path):
    whole = said(tmp_path, count=5)
    sizes = [(160, 120), (160, 120), (80, 60), (160, 120), (90, 120)]
    for frame, (w, h) in zip(whole["frames"], sizes, strict=True):
        K = np.array([[w * 1.1, 0, w * 0.55], [0, h * 1.3, h * 0.45], [0, 0, 1]])
        frame |= {"w": w, "h": h, "fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
        picture = shade(*directions(K, w, h)).round().astype(np.uint8)
        Image.fromarray(picture).save(tmp_path / f"{frame['file_path']}.png")
    keep(tmp_path, whole)
    read = read_posed_photos(tmp_path)
    assert read.views.rgb.shape == (5, 120, 160, 3)
    for camera, rgb in zip(read.views.cameras, read.views.rgb, strict=True):
        expected = shade(*directions(camera.K, 160, 120))
        assert np.abs(rgb - expected)[4:-4, 4:-4].max() < 2.5
    assert "3 of 160 × 120, 1 of 80 × 60, 1 of 90 × 120" in read.warnings[0]
    small = read_posed_photos(tmp_path, longest=40)
    assert small.views.rgb.shape == (5, 30, 40, 3)
    expected = shade(*directions(small.views.cameras[0].K, 40, 30))
    assert np.abs(small.views.rgb[0] - expected)[2:-2, 2:-2].max() < 4


LENSES = {
    "SIMPLE_RADIAL": [200, 83, 57, -0.15],
    "RADIAL": [200, 83, 57, 0.2, -0.05],
    "OPENCV": [200, 190, 83, 57, -0.3, 0.12, 0.004, -0.006],
}


@pytest.mark.parametrize("model", LENSES)
def test_bent_pictures_are_straightened(tmp_path, model):
    """A photograph is made by finding, for each of its pixels, the direction that appears there."""
    p = LENSES[model]
    fx, fy, cx, cy = p[:4] if model == "OPENCV" else (p[0], p[0], p[1], p[2])
    k1, k2, p1, p2 = [*p[4 if model == "OPENCV" else 3 :], 0, 0, 0][:4]
    v, u = np.mgrid[:120, :160] + 0.5
    seen_x, seen_y = (u - cx) / fx, (v - cy) / fy
    x, y = seen_x, seen_y
    for _ in range(60):
        r2 = x * x + y * y
        scale = 1 + k1 * r2 + k2 * r2 * r2
        x = (seen_x - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / scale
        y = (seen_y - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / scale
    picture = shade(x, y).round().astype(np.uint8)
    folder = tmp_path / "sparse" / "0"
    cameras = tuple(Camera(np.eye(3), np.eye(4), 160, 120) for _ in range(3))
    write_colmap(folder, cameras, NAMES[:3])
    numbers = " ".join(str(x) for x in p)
    (folder / "cameras.txt").write_text("".join(f"{k} {model} 160 120 {numbers}\n" for k in (1, 2, 3)))
    keep_pictures(tmp_path / "images", Views(np.stack([picture] * 3), cameras), NAMES[:3])
    read = read_posed_photos(tmp_path)
    camera = read.views.cameras[0]
    error = np.abs(read.views.rgb[0] - shade(*directions(camera.K, 160, 120)))
    assert error.max() < 2  # right up to the border: nothing there is made up
    np.testing.assert_allclose(camera.K[:2, 2], [83, 57])
    assert "straightened" in read.warnings[0]
    # As much as possible is shown: the border is at the border somewhere.
    assert 0.5 < camera.K[0, 0] / fx < 1.5


def test_the_same_lens_in_transforms_json_is_straightened(tmp_path):
    said(tmp_path, camera_model="OPENCV", fl_x=20.0, k1=-0.1, k2=0.01, p1=0.001, p2=0.001)
    assert "4 pictures were straightened" in read_posed_photos(tmp_path).warnings[-1]


# ---------------------------------------------------------------- bad pictures


def forty(folder):
    whole = said(folder, count=40)
    return whole, [folder / f"{f['file_path']}.png" for f in whole["frames"]]


def test_one_corrupt_jpeg_among_forty_is_left_out_and_named(tmp_path):
    _, pictures = forty(tmp_path)
    picture = pictures[7].with_suffix(".jpg")
    Image.open(pictures[7]).resize((160, 120)).save(picture)
    pictures[7].unlink()
    picture.write_bytes(picture.read_bytes()[:-300])
    read = read_posed_photos(tmp_path)
    assert len(read.names) == len(read.views.cameras) == 39
    assert "./train/r_7" not in read.names
    assert read.warnings[0].startswith("1 of 40 pictures were left out: ./train/r_7 is broken")


def test_missing_pictures_are_left_out_and_named_unless_most_are(tmp_path):
    _, pictures = forty(tmp_path)
    for path in pictures[:7]:
        path.unlink()
    pictures[8].write_bytes(b"hello")
    read = read_posed_photos(tmp_path)
    assert len(read.names) == 32
    assert "8 of 40 pictures were left out: ./train/r_0 is not there; " in read.warnings[0]
    assert "and 3 more" in read.warnings[0]
    for path in pictures[9:25]:
        path.unlink()
    with pytest.raises(BadFileError, match=r"24 of 40 pictures cannot be used: ./train/r_0 is not"):
        read_posed_photos(tmp_path)


def test_blurred_dark_and_grey_pictures_are_fine(tmp_path):
    said(tmp_path)
    Image.fromarray(np.full((12, 16), 3, np.uint8)).save(tmp_path / "train" / "r_0.png")
    assert (read_posed_photos(tmp_path).views.rgb[0] == 3).all()


def test_grey_pictures_among_coloured_ones_are_reported(tmp_path):
    _, pictures = forty(tmp_path)
    assert not read_posed_photos(tmp_path).warnings, "all are grey"
    for path in pictures[3:]:
        Image.fromarray(np.full((12, 16, 3), (200, 20, 30), np.uint8)).save(path)
    told = read_posed_photos(tmp_path).warnings
    assert told == ("3 of 40 pictures are grey: colours will be paler.",)


def test_a_single_view_is_too_few(tmp_path):
    said(tmp_path, count=1)
    with pytest.raises(BadFileError, match=r"1 of 1 pictures can be used, but at least 3 are needed.*20 to 50"):
        read_posed_photos(tmp_path)


def test_a_picture_of_another_proportion_than_its_camera_is_left_out(tmp_path):
    said(tmp_path, w=16, h=12, fl_x=20)
    Image.fromarray(np.zeros((16, 12, 3), np.uint8)).save(tmp_path / "train" / "r_0.png")
    read = read_posed_photos(tmp_path)
    assert "r_0 has 12 × 16 pixels, but its camera takes 16 × 12" in read.warnings[0]


# ---------------------------------------------------------------- bad files


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"camera_model": "OPENCV_FISHEYE"}, "OPENCV_FISHEYE.*Undistort"),
        ({"is_fisheye": True}, "fisheye"),
        ({"frames": []}, "no list of frames"),
        ({"fl_x": float("1e999")}, "'fl_x' is inf"),
        ({"k1": "a"}, "'k1' is a"),
        ({"camera_angle_x": 7.0}, "'camera_angle_x' is 7. Give an angle"),
        ({"fl_x": 1e-300, "k1": 1e300}, "cannot be straightened: its lens bends too much"),
        ({"fl_x": 2.0, "k1": 5.0, "k2": -90.0}, "cannot be straightened: its lens bends too much"),
    ],
)
def test_a_bad_transforms_file_is_refused(tmp_path, change, words):
    said(tmp_path, **change)
    with pytest.raises(BadFileError, match=words):
        read_posed_photos(tmp_path)


def test_bad_pictures_of_one_name_count_one_by_one(tmp_path):
    whole = said(tmp_path)
    for frame in whole["frames"]:
        frame["file_path"] = "gone"
    keep(tmp_path, whole)
    with pytest.raises(BadFileError, match="4 of 4 pictures cannot be used"):
        read_posed_photos(tmp_path)


def test_what_is_no_description_of_photographs_is_refused(tmp_path):
    with pytest.raises(BadFileError, match="no such file or folder"):
        read_posed_photos(tmp_path / "gone")
    for data in (b"\xff\xd8\xff", b"[1, 2", b"[" * 100_000, b""):
        (tmp_path / "transforms.json").write_bytes(data)
        with pytest.raises(BadFileError, match=r"is no JSON .*transforms.json, or write"):
            read_posed_photos(tmp_path)


def test_a_pose_that_is_not_finite_is_named(tmp_path):
    whole = said(tmp_path)
    whole["frames"][2]["transform_matrix"][1][2] = float("nan")
    keep(tmp_path, whole)
    with pytest.raises(BadFileError, match=r"frame 3: .* not finite.*leave the frame out"):
        read_posed_photos(tmp_path)


def test_a_principal_point_in_the_very_middle_is_let_pass(tmp_path):
    K = np.array([[80.0, 0, 32], [0, 80, 32], [0, 0, 1]])
    check_focal(tmp_path, K, 64, 64)
    for far in ((-100, 0), (0, 130)):
        with pytest.raises(BadFileError, match="middle at"):
            check_focal(tmp_path, K + np.array([[0, 0, far[0]], [0, 0, far[1]], [0, 0, 0]]), 64, 64)


def test_masks_that_show_nothing_are_left_out_unless_most_do(tmp_path):
    said(tmp_path)
    (tmp_path / "masks").mkdir()
    for k in range(4):
        mask = np.full((12, 16), 0 if k == 2 else 255, np.uint8)
        mask[0] = 100
        Image.fromarray(mask).save(tmp_path / "masks" / f"r_{k}.png")
    read = read_posed_photos(tmp_path)
    assert len(read.names) == 3
    assert "./train/r_2 has a mask that shows nothing" in read.warnings[0]
    for k in (0, 1, 3):
        Image.fromarray(np.zeros((12, 16), np.uint8)).save(tmp_path / "masks" / f"r_{k}.png")
    with pytest.raises(BadFileError, match=r"4 of 4 pictures cannot be used: .* shows nothing .*instances"):
        read_posed_photos(tmp_path)


def test_pictures_of_telephones_are_named_as_what_they_are(tmp_path):
    said(tmp_path)
    for file in tmp_path.rglob("*.png"):
        file.write_bytes(b"\0\0\0\x18ftypheic\0\0\0\0mif1heic")
    with pytest.raises(BadFileError, match="is a HEIC picture: convert it to JPEG"):
        read_posed_photos(tmp_path)


def test_pictures_are_turned_as_they_ask_only_where_their_camera_says_so(tmp_path):
    """Some are stored on their side; of others the note is ignored, as COLMAP does."""
    whole = said(tmp_path, w=16, h=12, fl_x=20)
    upright = np.arange(192, dtype=np.uint8).reshape(12, 16)
    for k, (turn, note) in enumerate([(1, 6), (3, 8), (0, 6), (0, 1)]):
        noted = Image.Exif()
        noted[0x0112] = note
        path = (tmp_path / whole["frames"][k]["file_path"]).with_suffix(".png")
        Image.fromarray(np.ascontiguousarray(np.rot90(upright, turn))).save(path, exif=noted)
    read = read_posed_photos(tmp_path)
    for rgb in read.views.rgb:
        np.testing.assert_array_equal(rgb[..., 0], upright)
    assert [w[:21] for w in read.warnings if "EXIF" in w] == ["1 pictures note in th"]


def test_a_mask_that_is_named_and_missing_is_refused(tmp_path):
    whole = said(tmp_path)
    whole["frames"][2]["mask_path"] = "gone.png"
    keep(tmp_path, whole)
    with pytest.raises(BadFileError, match=r"frame 3: its mask 'gone.png' is not there"):
        read_posed_photos(tmp_path)


def test_a_folder_without_poses_is_refused(tmp_path, views):
    keep_pictures(tmp_path, views)
    with pytest.raises(BadFileError, match=r"no photographs with poses.*COLMAP.*3 × 4"):
        read_posed_photos(tmp_path)


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("cameras", "1 FULL_OPENCV 80 64 1 1 1 1 0 0 0 0 0 0 0 0", "FULL_OPENCV.*image_undistorter"),
        ("cameras", "1 OPENCV_FISHEYE 80 64 1 1 1 1 0 0 0 0", "OPENCV_FISHEYE"),
        ("cameras", "1 PINHOLE 80 64 99 99 40", "PINHOLE camera has bad numbers"),
        ("cameras", "1 PINHOLE 80 64 -9 99 40 32", "bad numbers"),
        ("cameras", "1 PINHOLE 80 nan 99 99 40 32", "cannot read the line"),
        ("cameras", "7 PINHOLE 80 64 99 99 40 32", "camera 1, which is not there"),
        ("images", "1 0 0 0 0 0 0 0 1 shot 0.png", "pose of image shot 0.png is bad"),
        ("images", "1 1 0 0 0 0 0 inf 1 shot 0.png", "pose of image|cannot read"),
        ("images", "1 1 0 0", "cannot read the line '1 1 0 0'"),
        ("images", "# none", "holds no images"),
        ("points3D", "1 2 x 3 0 0 0 0", "cannot read the line '1 2 x"),
    ],
)
def test_a_bad_colmap_text_is_refused(tmp_path, views, file, text, words):
    keep_as("colmap text", tmp_path, views)
    (tmp_path / "sparse" / "0" / f"{file}.txt").write_text(text + "\n")
    with pytest.raises(BadFileError, match=words):
        read_posed_photos(tmp_path)


def test_no_byte_of_a_colmap_file_can_make_the_reader_crash(tmp_path, views):
    keep_binary(tmp_path / "0", views.cameras, NAMES, POINTS)
    rng = np.random.default_rng(0)
    refused = 0
    for file in ("cameras.bin", "images.bin", "points3D.bin"):
        good = (tmp_path / "0" / file).read_bytes()
        for _ in range(30):
            bad = bytearray(good)
            bad[rng.integers(len(bad))] = rng.integers(256)
            (tmp_path / "0" / file).write_bytes(bad[: rng.integers(8, len(bad) + 40)])
            try:
                read_colmap(tmp_path / "0")
            except BadFileError:
                refused += 1
        (tmp_path / "0" / file).write_bytes(good)
    assert refused > 45
    assert len(read_colmap(tmp_path / "0").images) == 5


def test_a_lying_count_and_an_unknown_model_are_refused(tmp_path, views):
    keep_binary(tmp_path / "a", views.cameras, NAMES, POINTS, model=99)
    with pytest.raises(BadFileError, match="model number 99"):
        read_colmap(tmp_path / "a")
    keep_binary(tmp_path / "b", views.cameras, NAMES, POINTS)
    (tmp_path / "b" / "images.bin").write_bytes(struct.pack("<Q", 2**60) + bytes(200))
    with pytest.raises(BadFileError, match="claims 1,152,921,504,606,846,976 records"):
        read_colmap(tmp_path / "b")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a red box on a table", "no projection matrix"),
        ("1 2 3 4 5 6 7 8", "no projection matrix"),
        ("nan 0 0 0 0 1 0 0 0 0 1 0", "no projection matrix"),
        ("1 0 0 0 2 0 0 0 0 0 1 0", "not the matrix of a finite camera"),
        ("1 0 0 0 0 1 0 0 0 0 1 3", "focal length of 1 and 1 pixels.*K .R . t. in pixels"),
    ],
)
def test_a_bad_matrix_is_refused(tmp_path, views, text, words):
    keep_as("3x4 text", tmp_path, views)
    (tmp_path / "shot 2.txt").write_text(text)
    with pytest.raises(BadFileError, match=words):
        read_posed_photos(tmp_path)


# ---------------------------------------------------------------- files of other programs


def test_posed_pictures_of_other_programs_are_read(shared_assets):
    suzanne = read_posed_photos(shared_assets / "posed" / "suzanne", longest=160)
    assert suzanne.views.rgb.shape == (20, 90, 160, 3)
    assert suzanne.views.cameras[0].K[0, 0] == pytest.approx(888.8888888888888 / 4)
    assert 0.02 < (suzanne.masks > 127).mean() < 0.5
    trivial = read_posed_photos(shared_assets / "posed" / "trivial", longest=128)
    assert trivial.views.rgb.shape == (5, 128, 128, 3)
    for read in (suzanne, trivial):  # the middle of what is seen is ahead, near the origin
        for camera, mask in zip(read.views.cameras, read.masks, strict=True):
            u, v, depth = projection_matrix(camera) @ [0, 0, 0, 1]
            assert depth > 0
            rows, columns = np.nonzero(mask > 127)
            assert columns.min() < u / depth < columns.max() and rows.min() < v / depth < rows.max()
