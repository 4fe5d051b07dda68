"""Posed pictures on disk: ours come back, others' come in, broken ones are named."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import Camera, Views
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.io.photos.transforms_json import read_views, write_views

SIZE = (14, 10)


def camera(k=0, focal=20.0, width=SIZE[0], height=SIZE[1]):
    """Stands at (0, -3, 1 + k) and looks along +y."""
    pose = np.array([[1.0, 0, 0, 0], [0, 0, 1, -3], [0, -1, 0, 1 + k], [0, 0, 0, 1]])
    K = np.array([[focal, 0, width / 2 + 0.25], [0, focal * 1.1, height / 2], [0, 0, 1]])
    return Camera(K, pose, width, height)


def views(count=3, **more):
    random = np.random.default_rng(4)
    shape = (count, SIZE[1], SIZE[0])
    normals = random.normal(size=(*shape, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[:, 0] = 0
    depth = random.uniform(1.5, 4.0, shape)
    depth[:, 0] = np.inf
    made = Views(
        rgb=random.integers(0, 256, (*shape, 3), dtype=np.uint8),
        cameras=tuple(camera(k) for k in range(count)),
        depth=depth.astype(np.float32),
        normals=normals.astype(np.float32),
        object_of_pixel=random.integers(-1, 5, shape).astype(np.int32),
        part_of_pixel=random.integers(-1, 65000, shape).astype(np.int32),
    )
    return replace(made, **more)


def test_views_come_back_as_they_were(tmp_path):
    made = views()
    write_views(tmp_path, made)
    back = read_views(tmp_path)
    for name in ("rgb", "object_of_pixel", "part_of_pixel"):
        np.testing.assert_array_equal(getattr(back, name), getattr(made, name))
    for a, b in zip(back.cameras, made.cameras, strict=True):
        np.testing.assert_array_equal(a.K, b.K)
        np.testing.assert_array_equal(a.world_from_camera, b.world_from_camera)
        assert (a.width, a.height) == (b.width, b.height)
    there = np.isfinite(made.depth)
    np.testing.assert_array_equal(np.isfinite(back.depth), there)
    np.testing.assert_allclose(back.depth[there], made.depth[there], atol=0.5001e-3)
    np.testing.assert_array_equal(back.normals.any(axis=-1), made.normals.any(axis=-1))
    np.testing.assert_allclose(back.normals, made.normals, atol=0.008)
    np.testing.assert_allclose(np.linalg.norm(back.normals[:, 1:], axis=-1), 1, atol=1e-6)


def test_masks_tell_other_tools_where_objects_are(tmp_path):
    made = views()
    write_views(tmp_path, made)
    owners = made.object_of_pixel
    photographs = read_posed_photos(tmp_path)
    np.testing.assert_array_equal(photographs.masks, np.where(owners < 0, 0, 255))
    np.testing.assert_array_equal(photographs.views.rgb[owners >= 0], made.rgb[owners >= 0])


def test_colours_and_cameras_are_enough(tmp_path):
    made = views(depth=None, normals=None, object_of_pixel=None, part_of_pixel=None)
    write_views(tmp_path, made)
    back = read_views(tmp_path)
    assert back.depth is back.normals is back.object_of_pixel is back.part_of_pixel is None
    assert sorted(p.name for p in tmp_path.iterdir()) == ["rgb", "transforms.json"]


def test_the_file_speaks_as_instant_ngp_and_nerfstudio_do(tmp_path):
    said = json.loads(write_views(tmp_path, views()).read_text())
    assert (said["w"], said["h"], said["fl_x"], said["fl_y"]) == (14, 10, 20.0, 22.0)
    assert (said["cx"], said["cy"]) == (7.25, 5.0)
    assert said["camera_angle_x"] == pytest.approx(2 * math.atan(14 / 2 / 20))
    assert said["integer_depth_scale"] == 1e-3
    frame = said["frames"][2]
    # Looks along +y from (0, -3, 3): to the right is x, up is z, and back is -y.
    assert frame["transform_matrix"] == [[1, 0, 0, 0], [0, 0, -1, -3], [0, 1, 0, 3], [0, 0, 0, 1]]
    assert frame["file_path"] == "rgb/0002.png"
    with Image.open(tmp_path / frame["depth_file_path"]) as depth:
        assert depth.mode.startswith("I")
        steps = np.asarray(depth).astype(int)
    np.testing.assert_allclose(steps[1:] * 1e-3, views().depth[2][1:], atol=0.5001e-3)
    assert (steps[0] == 0).all()


@pytest.mark.parametrize(("size", "unit"), [(0.02, 1e-5), (0.2, 1e-4), (1, 1e-3), (400, 1e-1)])
def test_the_unit_of_depth_suits_the_scene(tmp_path, size, unit):
    made = views()
    made = replace(made, depth=(made.depth * size).astype(np.float32))
    path = write_views(tmp_path, made)
    assert json.loads(path.read_text())["integer_depth_scale"] == pytest.approx(unit)
    there = np.isfinite(made.depth)
    np.testing.assert_allclose(read_views(tmp_path).depth[there], made.depth[there], atol=0.501 * unit, rtol=1e-6)


def test_floor_beyond_the_reach_of_a_number_is_nothing(tmp_path):
    made = views()
    depth = made.depth.copy()
    depth[:, 1], made.object_of_pixel[:, 1] = 15_000.0, -1
    write_views(tmp_path, replace(made, depth=depth))
    back = read_views(tmp_path).depth
    assert np.isinf(back[:, 1]).all()
    np.testing.assert_allclose(back[:, 2:], depth[:, 2:], atol=0.5001e-3)


def test_cameras_may_differ(tmp_path):
    lenses = tuple(camera(k, focal=20.0 + k) for k in range(3))
    write_views(tmp_path, views(cameras=lenses))
    back = read_views(tmp_path).cameras
    assert [c.K[0, 0] for c in back] == [20.0, 21.0, 22.0]


def test_fewer_views_in_the_same_folder_leave_no_others(tmp_path):
    write_views(tmp_path, views(3))
    write_views(tmp_path, views(2))
    assert len(read_views(tmp_path).cameras) == 2


def test_what_the_format_cannot_say_is_refused(tmp_path):
    skewed = camera()
    skewed.K[0, 1] = 0.5
    with pytest.raises(UserError, match="skewed"):
        write_views(tmp_path, views(1, cameras=(skewed,)))
    many = views(1)
    many.part_of_pixel[0, 0, 0] = 65535
    with pytest.raises(UserError, match="More than 65534 parts"):
        write_views(tmp_path, many)
    assert not (tmp_path / "transforms.json").exists()


# ---------------------------------------------------------------- what others made


def photographs(folder, count=2, mode="RGB", **said):
    """A folder as the synthetic NeRF scenes have it: no extension, one angle, no more."""
    (folder / "train").mkdir(exist_ok=True)
    frames = []
    for k in range(count):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_euler("xyz", [1.2, 0.1, k]).as_matrix()
        pose[:3, 3] = (4, k, 2)
        Image.new(mode, SIZE, (10, 20, 30, 51)[: len(mode)]).save(folder / f"train/r_{k}.png")
        frames.append({"file_path": f"./train/r_{k}", "transform_matrix": pose.tolist()})
    whole = {"camera_angle_x": 0.69, "frames": frames} | said
    whole = {k: x for k, x in whole.items() if x is not None}
    (folder / "transforms.json").write_text(json.dumps(whole))
    return folder


def test_a_folder_of_the_synthetic_nerf_scenes_is_read(tmp_path):
    made = read_views(photographs(tmp_path, mode="RGBA"))
    focal = SIZE[0] / 2 / math.tan(0.69 / 2)
    np.testing.assert_allclose(made.cameras[1].K, [[focal, 0, 7], [0, focal, 5], [0, 0, 1]])
    # A fifth of (10, 20, 30) on white.
    assert (made.rgb == (206, 208, 210)).all()
    pose = made.cameras[1].world_from_camera
    turn = Rotation.from_euler("xyz", [1.2, 0.1, 1]).as_matrix()
    np.testing.assert_allclose(pose[:3, 2], -turn[:, 2])
    np.testing.assert_allclose(pose[:3, 1], -turn[:, 1])
    assert made.depth is None


def frame(said, k=0, **change):
    said["frames"][k] |= change
    return said


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda s: s.pop("frames"), "no list of frames"),
        (lambda s: s.update(frames=[]), "no list of frames"),
        (lambda s: s.update(frames=[1]), "no list of frames"),
        (lambda s: s.pop("camera_angle_x"), "frame 1: it states no focal length"),
        (lambda s: s.update(camera_angle_x="wide"), "'camera_angle_x' is wide"),
        (lambda s: s.update(camera_angle_x=4.0), "'camera_angle_x' is 4. Give an angle between 0"),
        (lambda s: s.update(fl_x=-3), "focal length is negative"),
        (lambda s: s.update(k1=0.1), "bends straight lines. Undistort"),
        (lambda s: s.update(camera_model="OPENCV_FISHEYE"), "bends straight lines"),
        (lambda s: s.update(w=1920), "'w' is 1920, but its picture has 14"),
        (lambda s: frame(s, 1, transform_matrix=[[1, 2], [3]]), "frame 2: 'transform_matrix'"),
        (lambda s: frame(s, transform_matrix=(2 * np.eye(4)).tolist()), "neither scale"),
        (lambda s: frame(s, transform_matrix=np.diag([1, 1, -1, 1.0]).tolist()), "not a rigid transform.*nor mirror"),
        (lambda s: frame(s, 1, file_path="../../etc/passwd"), "leads outside"),
        (lambda s: frame(s, file_path="train/gone"), "frame 1: train/gone.png: "),
        (lambda s: frame(s, file_path=7), "'file_path' is '7'"),
        (lambda s: s["frames"][0].pop("file_path"), "frame 1: 'file_path' is missing, but others"),
        (lambda s: frame(s, depth_file_path="train/r_0"), "'depth_file_path' is missing, but"),
        (lambda s: [frame(s, k, depth_file_path="train/r_0") for k in (0, 1)], "holds colours .RGB., not grey numbers"),
    ],
)
def test_a_mistake_in_the_file_is_named(tmp_path, spoil, told):
    path = photographs(tmp_path) / "transforms.json"
    said = json.loads(path.read_text())
    spoil(said)
    path.write_text(json.dumps(said))
    with pytest.raises(BadFileError, match=told) as problem:
        read_views(tmp_path)
    assert str(path) in str(problem.value)


def test_bad_pictures_are_named(tmp_path):
    folder = photographs(tmp_path)
    (folder / "train/r_1.png").write_bytes(b"not a picture")
    with pytest.raises(BadFileError, match=r"frame 2: \./train/r_1\.png: the picture is no PNG"):
        read_views(folder)
    Image.new("RGB", (20, 10)).save(folder / "train/r_1.png")
    with pytest.raises(BadFileError, match=r"frame 2: .* is of another size than that of frame 1"):
        read_views(folder)


def test_a_depth_of_another_size_is_named(tmp_path):
    write_views(tmp_path, views(1))
    Image.fromarray(np.ones((5, 5), np.uint16)).save(tmp_path / "depth/0000.png")
    with pytest.raises(BadFileError, match=r"depth/0000.png is not as large as its colours"):
        read_views(tmp_path)


def test_no_file_and_no_json_are_named(tmp_path):
    with pytest.raises(BadFileError, match="there is no such file"):
        read_views(tmp_path)
    (tmp_path / "transforms.json").write_text("{")
    with pytest.raises(BadFileError, match=r"transforms\.json"):
        read_views(tmp_path)
