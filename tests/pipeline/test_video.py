import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
import trimesh
from PIL import Image

from corporeal.core.errors import UserError
from corporeal.core.types import (
    Finish,
    Frame,
    Inventory,
    Law,
    Material,
    MaterialField,
    Part,
    PartDescription,
    Particles,
    Parts,
    Scene,
    SceneObject,
    Structure,
    Surface,
    Trajectory,
)
from corporeal.pipeline.settings import VideoConfig, validate_video
from corporeal.pipeline.stages.video import _box, _reach_ratio, render_video
from corporeal.render import video_file
from corporeal.render.video_raycaster import VideoRaycaster
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult
from sample_ledger import ledger

SMALL = VideoConfig(width=128, height=96, quality="draft")


class Frames(Sequence):
    """Frames made when asked for, as a trajectory on disk reads them."""

    def __init__(self, points, motion, count):
        self.points, self.motion, self.count = points, motion, count
        self.asked = []

    def __len__(self):
        return self.count

    def __getitem__(self, k):
        self.asked.append(k)
        F, shift = self.motion(k / max(self.count - 1, 1))
        whole = np.broadcast_to(F, (len(self.points), 3, 3)).astype(np.float32)
        return Frame(k / 60, (self.points @ F.T + shift).astype(np.float32), whole)


def spin(t):
    c, s = np.cos(np.pi * t), np.sin(np.pi * t)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([0, 0, 0.5 - 0.5 * t])


def squash(t):
    f = 1 - 0.5 * t
    return np.diag([f**-0.5, f**-0.5, f]), np.zeros(3)


def play(shape, motion, count=6):
    v, f = np.asarray(shape.vertices), np.asarray(shape.faces)
    surface = Surface("thing", 0, 0, v, f)
    thing = SceneObject("thing_0", "thing", 1.0)
    red = Finish("red", (0.7, 0.1, 0.05, 1.0), roughness=0.5)
    scene = Scene("test", "", (thing,), (surface,), (red,), duration=count / 60)
    zero = np.zeros(len(f), dtype=np.int64)
    parts = Parts(zero, zero, zero + 1.0, (Part("thing", 0, "node"),))
    lattice = np.linspace(-1, 1, 11)
    points = np.stack(np.meshgrid(lattice, lattice, lattice), -1).reshape(-1, 3) * 0.5
    points = points * shape.extents + shape.bounds.mean(axis=0)
    none = np.zeros(len(points), dtype=np.int64)
    particles = Particles(
        points, points * 0, none + 1e-3, none + 1e3, none, none, 0.2, (),
        np.zeros((0, 3)), none[:0], (1.0,),
    )  # fmt: skip
    rubber = Material("rubber", Law.NEO_HOOKEAN, 1e6, 0.45, 1e3)
    words = PartDescription("thing", "rubber")
    pair = np.full((2, 2), 0.5)
    field = MaterialField((rubber,), (Structure("solid"),), (words,), pair, pair)
    frames = Frames(points, motion, count)
    trajectory = Trajectory(Path("nowhere"), np.arange(count) / 60, ledger(np.arange(count) / 60), frames)
    prepared = PreparedScene(scene, Inventory(()), parts, field, particles)
    return SimulationResult(prepared, trajectory)


def cube():
    return trimesh.creation.box(bounds=[[-0.5, -0.5, 0], [0.5, 0.5, 1]])


def red(picture):
    p = picture.astype(int)
    return p[..., 0] > 1.6 * p[..., 2]


def test_a_video_has_all_frames_and_any_browser_plays_it(tmp_path):
    told = []
    made = render_video(play(cube(), spin), SMALL, tmp_path, lambda f, words: told.append(f))
    assert (made.width, made.height, made.fps) == (128, 96, 60)
    assert len(video_file.read_frames(made.path, list(range(6)))) == 6
    probe = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(made.path)], capture_output=True, text=True
    ).stderr
    assert "h264" in probe and "yuv420p" in probe and "128x96" in probe and "60 fps" in probe
    data = made.path.read_bytes()
    assert data.find(b"moov") < data.find(b"mdat"), "a browser wants the index first"
    assert told == sorted(told) and told[-1] == 1.0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["thumbnail.png", "video.mp4"]
    assert np.asarray(Image.open(tmp_path / "thumbnail.png")).shape == (96, 128, 3)


def test_the_video_carries_whom_to_thank_for_what_is_seen(tmp_path):
    played = play(cube(), spin, 2)
    scene = played.prepared.scene
    things = [replace(scene.objects[0], credit=c) for c in ("CC0; Ada", "MIT;\0 Bo", "CC0; Ada", "")]
    thanked = replace(played.prepared, scene=replace(scene, objects=tuple(things)))
    made = render_video(replace(played, prepared=thanked), SMALL, tmp_path)
    probe = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(made.path)], capture_output=True, text=True
    ).stderr
    said = dict(line.split(":", 1) for line in probe.splitlines() if ":" in line)
    said = {key.strip(): value.strip() for key, value in said.items()}
    assert said["copyright"] == said["comment"] == "CC0; Ada; MIT; Bo"


def test_a_sphere_that_is_squashed_is_seen_lower_and_wider(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    ball.apply_translation([0, 0, 0.5])
    made = render_video(play(ball, squash), SMALL, tmp_path)
    first, last = (red(p) for p in video_file.read_frames(made.path, [0, 5]))
    extent = [[np.ptp(np.nonzero(m)[a]) for a in (0, 1)] for m in (first, last)]
    assert extent[1][0] < 0.85 * extent[0][0]
    assert extent[1][1] > 1.2 * extent[0][1]


def test_what_does_not_move_does_not_flicker(tmp_path):
    still = play(cube(), lambda t: (np.eye(3), np.zeros(3)))
    config = VideoConfig(width=128, height=96, quality="draft", stills=True, caption=False)
    render_video(still, config, tmp_path)
    stills = [np.asarray(Image.open(p)) for p in sorted((tmp_path / "stills").iterdir())]
    assert len(stills) == 6
    assert all(np.array_equal(s, stills[0]) for s in stills)


@pytest.mark.parametrize(("speed", "casts"), [(0.0, 1), (1e-3, 1), (4.0, 6)], ids=["still", "unseen", "seen"])
def test_what_stands_still_is_cast_once(tmp_path, monkeypatch, speed, casts):
    made, cast = [], VideoRaycaster._cast
    monkeypatch.setattr(VideoRaycaster, "_cast", lambda *given: made.append(1) or cast(*given))
    render_video(play(cube(), lambda t: (np.eye(3), np.array([0, speed * t, 0.0]))), SMALL, tmp_path)
    assert len(made) == casts


def test_the_whole_motion_stays_in_the_picture(tmp_path):
    made = render_video(play(cube(), lambda t: (np.eye(3), np.array([0, 4 * t, 0.0]))), SMALL, tmp_path)
    for picture in video_file.read_frames(made.path, [0, 3, 5]):
        seen = red(picture)
        assert seen.sum() > 50
        assert not seen[[0, -1]].any() and not seen[:, [0, -1]].any()


def test_frames_are_read_one_by_one_and_few_are_kept(tmp_path):
    given = play(cube(), spin)
    render_video(given, SMALL, tmp_path)
    # Once to place the camera, once to draw; the type checker of the tests looks a few times too.
    assert len(given.trajectory.frames.asked) <= 3 * 6


def test_a_failed_video_says_so_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(video_file, "X264_CRF", "nonsense")
    with pytest.raises(UserError, match="ffmpeg"):
        render_video(play(cube(), spin), SMALL, tmp_path)
    assert not list(tmp_path.glob("*.mp4")) and not list(tmp_path.glob(".*"))


def test_a_missing_encoder_is_one_clear_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "no-such-ffmpeg"))
    with pytest.raises(UserError, match="IMAGEIO_FFMPEG_EXE"):
        render_video(play(cube(), spin), SMALL, tmp_path)


def test_a_full_disk_is_one_clear_sentence(tmp_path):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full")
    (tmp_path / f".{video_file.Path('video').stem}.part.mp4").symlink_to(full)
    with pytest.raises(UserError, match=r"disk is full|ffmpeg failed"):
        render_video(play(cube(), spin), SMALL, tmp_path)


def test_odd_sizes_are_refused_with_a_reason(tmp_path):
    with pytest.raises(UserError, match="even"):
        render_video(play(cube(), spin), VideoConfig(width=127, height=96), tmp_path)


def test_a_slow_video_is_longer_and_every_picture_knows_its_time(tmp_path):
    """Nothing touches here: all of it is slow."""
    made = render_video(play(cube(), spin), replace(SMALL, slow=2.0), tmp_path)
    assert len(made.times) == len(video_file.read_frames(made.path, list(range(11)))) == 11
    np.testing.assert_allclose(made.times, np.arange(11) / 120, atol=1e-9)


def test_the_time_is_written_into_the_picture_where_it_is_asked_for(tmp_path):
    still = play(cube(), lambda t: (np.eye(3), np.zeros(3)), 2)
    with_time, without = (
        render_video(still, replace(SMALL, stills=True, caption=c), tmp_path / str(c)) for c in (True, False)
    )
    paths = [m.path.parent / "stills" / "00001.png" for m in (with_time, without)]
    a, b = (np.asarray(Image.open(path)) for path in paths)
    assert np.array_equal(a, b), "stills are of the scene alone"
    p, q = (video_file.read_frames(m.path, [1])[0].astype(int) for m in (with_time, without))
    changed = np.abs(p - q).max(axis=2) > 60
    assert changed[70:, :60].any() and not changed[:60].any()


def test_slowness_that_makes_no_sense_is_refused(tmp_path):
    with pytest.raises(UserError, match="--slow"):
        validate_video(replace(SMALL, slow=0.5))


def test_a_camera_goes_by_where_most_of_an_object_is_and_sees_all_of_what_keeps_its_shape():
    rng = np.random.default_rng(4)
    ball = rng.normal(size=(2000, 3))
    ball *= (0.05 * rng.uniform(size=(2000, 1)) ** (1 / 3)) / np.linalg.norm(ball, axis=1)[:, None]
    mass = np.ones(2000)
    full = _reach_ratio(ball, mass)
    low, high = _box(ball + np.array([3.0, 0.0, 0.1]), mass, full)
    assert high - low == pytest.approx(np.full(3, 0.1), rel=0.12)
    # A fifth of it flies off as drops.
    scattered = ball.copy()
    scattered[:400] *= 40.0
    low, high = _box(scattered, mass, full)
    assert (high - low).max() < 0.13


def test_what_is_no_video_is_reported_in_one_line(tmp_path):
    path = tmp_path / "video.mp4"
    with pytest.raises(UserError, match=r"video\.mp4: there is no such video\. Make it again\.$"):
        video_file.read_frames(path, [0])
    path.write_bytes(b"no video at all" * 100)
    for read in (video_file.count_frames, lambda p: video_file.read_frames(p, [0])):
        with pytest.raises(UserError, match=r"cannot be read as a video \(.+\)\. Make it") as said:
            read(path)
        assert "\n" not in str(said.value)
