"""What the page is given is what happened."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import corporeal as co
from corporeal.core.types import Frame
from corporeal.pipeline.viewer_data import bind_scene, record_trajectory, viewer_recording
from corporeal.render.recording_format import (
    MAX_SIGNED_BYTE,
    RESIDUAL_STEP_M,
    SceneBinding,
    encode_octahedral,
    encode_time_deltas,
    pack_recording,
    record_frames,
    stress_bytes,
)
from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS

NEAR = 0.5 * RESIDUAL_STEP_M * np.sqrt(3) + 1e-6
"""Rounding of three coordinates, and that of float32 [m]."""


def decode_octahedral(pairs):
    """Return the unit vectors that ``encode_octahedral`` put into bytes, as the page does."""
    flat = pairs / MAX_SIGNED_BYTE
    height = 1.0 - np.abs(flat).sum(axis=1)
    below = np.maximum(-height, 0.0)[:, None]
    flat = flat - np.where(flat >= 0, below, -below)
    out = np.column_stack([flat, height])
    return out / np.linalg.norm(out, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def played():
    """A soft ball and a rigid one fall on the floor."""
    soft = co.ball("seat_foam", radius=0.04, at=(0, 0, 0.06))
    stone = co.ball("granite", radius=0.03, at=(0.12, 0, 0.05))
    return co.simulate_scene(co.build_scene(soft, stone, duration=0.15, fps=60))


def read(block):
    length = int.from_bytes(block[:4], "little")
    return json.loads(block[4 : 4 + length]), block[4 + length :]


def array(spec, data):
    offset, count, kind = spec
    return np.frombuffer(data, f"<{kind}", count, offset)


def summed(raw, frames, axes, kind):
    """What the page does with ``encode_time_deltas``."""
    wide = np.dtype(kind).itemsize
    planes = raw.reshape(wide, -1).T.copy().view(kind).reshape(axes, frames, -1)
    return np.cumsum(planes, axis=1, dtype=kind).transpose(1, 2, 0)


def test_differences_in_time_give_the_values_back_even_where_they_wrap_around():
    values = np.random.default_rng(1).integers(-32768, 32767, (5, 7, 3)).astype("<i2")
    np.testing.assert_array_equal(summed(encode_time_deltas(values), 5, 3, "<i2"), values)


def test_a_normal_in_two_bytes_is_within_a_degree_and_a_half():
    n = np.random.default_rng(2).normal(size=(20_000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n[:6] = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    angle = np.degrees(np.arccos(np.clip((decode_octahedral(encode_octahedral(n)) * n).sum(axis=1), -1, 1)))
    assert angle.max() < 1.5


def test_vertices_and_normals_of_the_take_are_those_of_the_video(played):
    cast = bind_scene(played.prepared)
    recording = record_trajectory(cast, played.trajectory)
    header, data = read(viewer_recording(played.prepared, cast, played.outcome, recording))
    assert header["video"]["time"] == recording.time.tolist()
    assert [o["rigid"] for o in header["objects"]] == [False, True]
    times = played.trajectory.time
    numbers = [int(np.argmin(np.abs(times - time))) for time in recording.time]
    assert_played(cast, [played.trajectory.frames[k] for k in numbers], header, data)


def assert_played(cast, frames, header, data):
    """The page's vertices lie within .05 mm of the video's, its normals within 1.5 degrees."""
    count = len(frames)
    posed = [cast.skin.pose(frame) for frame in frames]
    for k, (told, mine) in enumerate(zip(header["video"]["objects"], cast.vertices, strict=True)):
        pose = array(told["pose"], data).reshape(count, 12).astype(float)
        shift, normal = np.zeros((count, len(mine), 3)), None
        if "residual" in told:
            shift = RESIDUAL_STEP_M * summed(array(told["residual"], data), count, 3, "<i2")
            normal = summed(array(told["normal"], data), count, 2, "<i1")
        for t, (place, turned) in enumerate(posed):
            R = pose[t, :9].reshape(3, 3)
            found = (cast.skin.rest[mine] + shift[t]) @ R.T + pose[t, 9:]
            assert np.abs(found - place[mine]).max() < NEAR, (k, t)
            if normal is not None:
                cosine = ((decode_octahedral(normal[t]) @ R.T) * turned[mine]).sum(axis=1)
                assert np.degrees(np.arccos(np.clip(cosine.min(), -1, 1))) < 1.5, (k, t)


def bent(particles, time):
    """What is soft is twisted and squeezed, what is rigid turned: all of it falls."""
    out, deformed = particles.position.copy(), np.zeros((particles.count, 3, 3))
    rigid = np.array([t.kind == "rigid" for t in particles.treatments])[particles.part]
    for k in np.unique(particles.object):
        mine = particles.object == k
        middle = out[mine].mean(axis=0)
        stretch = np.eye(3) if rigid[mine].all() else np.diag([1 + 0.3 * time, 1, 1 - 0.3 * time])
        F = Rotation.from_rotvec([0.4 * time, 0.9 * time, -0.5 * time]).as_matrix() @ stretch
        out[mine] = (out[mine] - middle) @ F.T + middle - [0, 0, 0.1 * time]
        deformed[mine] = F
    return Frame(time, out, deformed)


SEVEN = tuple(SHOWCASE_SCENE_BUILDERS)[:7]


@pytest.mark.slow
@pytest.mark.parametrize("name", SEVEN)
def test_the_page_plays_every_scene_of_the_showcase_as_its_video_does(name):
    prepared = co.prepare_scene(co.showcase_scene(name))
    cast = bind_scene(prepared)
    frames = [bent(prepared.particles, t) for t in (0.0, 0.5, 1.0)]
    header, data = read(pack_recording(prepared.scene, prepared.parts, cast, record_frames(cast, frames), {}, None))
    assert_played(cast, frames, header, data)


def test_a_recording_thins_out_and_keeps_its_beginning(played):
    whole = record_trajectory(bind_scene(played.prepared), played.trajectory, fps=60)
    assert len(whole.time) == len(played.trajectory.frames)
    assert whole.every(2).time.tolist() == whole.time[::2].tolist()


def test_stress_is_kept_and_the_scale_ends_at_its_largest(played):
    stress = played.trajectory.frames[-1].stress
    assert stress is not None and stress.max() > 0
    rigid = played.prepared.particles.object == 1
    assert (stress[rigid] == 0).all()
    np.testing.assert_array_equal(stress_bytes(np.array([0.0, 0.25, 1.0, 2.0]), 1.0), [0, 128, 255, 255])


def test_an_object_that_only_turns_leaves_nothing_but_its_pose(played):
    """The control: a pose without the rotation leaves residuals of centimetres."""
    p = played.prepared.particles
    R = Rotation.from_rotvec([0.3, -1.2, 0.4]).as_matrix()
    turned = Frame(0.0, p.position @ R.T, np.broadcast_to(R, (p.count, 3, 3)))
    cast = bind_scene(played.prepared)
    residual = record_frames(cast, [turned]).objects[0][0].residual
    assert np.abs(residual).max() <= 1
    still = SceneBinding._pose
    try:
        SceneBinding._pose = lambda self, k, frame: (np.eye(3), still(self, k, frame)[1])
        assert np.abs(record_frames(cast, [turned]).objects[0][0].residual).max() > 100
    finally:
        SceneBinding._pose = still
