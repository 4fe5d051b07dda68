"""A video drawn from Gaussians shows the matter's motion."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.ndimage import binary_dilation
from scipy.spatial.transform import Rotation

from corporeal.core.errors import UserError
from corporeal.core.types import (
    FeatureCloud,
    Finish,
    Frame,
    Gaussians,
    Inventory,
    Law,
    Material,
    MaterialField,
    Part,
    PartDescription,
    Particles,
    Parts,
    Reconstruction,
    Scene,
    SceneObject,
    Structure,
    Surface,
    Trajectory,
)
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.pipeline.stages import video as stage
from corporeal.pipeline.stages.video import VideoConfig, render_video
from corporeal.reconstruction.gaussians import rasteriser_numba
from corporeal.render import colours, video_file
from corporeal.render.camera_placement import CameraAim, camera_from_aim
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult
from sample_ledger import ledger

SMALL = VideoConfig(width=128, height=96, quality="draft", stills=True)
TURN = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
EYE = camera_from_aim(CameraAim((4.0, -3.0, 2.0), (0.5, 0.0, 0.5), 30.0, 96, 80))


def cube(k):
    return trimesh.creation.box(bounds=[[1.5 * k - 0.5, -0.5, 0], [1.5 * k + 0.5, 0.5, 1]])


def clad(k, count=1500, degree=3, colour=(0.8, 0.1, 0.1)):
    """Gaussians on cube k that look a little different from every side."""
    rng = np.random.default_rng(k)
    points, _ = trimesh.sample.sample_surface(cube(k), count, seed=k)
    sh = 0.02 * rng.normal(size=(count, (degree + 1) ** 2, 3))
    sh[:, 0] = (np.array(colour) - 0.5) / SH_DC_COEFFICIENT
    q = rng.normal(size=(count, 4))
    return Gaussians(
        mean=np.asarray(points),
        rotation=q / np.linalg.norm(q, axis=1, keepdims=True),
        scale=rng.uniform(0.02, 0.05, (count, 3)),
        opacity=np.full(count, 0.9),
        sh=sh,
    )


def together(*some):
    names = ("mean", "rotation", "scale", "opacity", "sh")
    owner = np.repeat(np.arange(len(some)), [g.count for g in some])
    return Gaussians(**{n: np.concatenate([getattr(g, n) for g in some]) for n in names}), owner


class Frames(Sequence):
    """Two cubes; the second one moves by F and shift, from the second frame on."""

    def __init__(self, particles, F, shift, count):
        self.particles, self.F, self.shift, self.count = particles, F, np.array(shift), count

    def __len__(self):
        return self.count

    def __getitem__(self, k):
        if not 0 <= k < self.count:
            raise IndexError
        p = self.particles
        x, F = p.position.copy(), np.tile(np.eye(3), (p.count, 1, 1))
        if k:
            mine = p.object == 1
            x[mine], F[mine] = x[mine] @ self.F.T + self.shift, self.F
        return Frame(k / 60, x, F)


def play(F=TURN, shift=(0.0, 0.0, 0.3), count=3):
    surfaces = tuple(
        Surface(f"cube_{k}", k, 0, np.asarray(cube(k).vertices), np.asarray(cube(k).faces)) for k in (0, 1)
    )
    things = tuple(SceneObject(f"cube_{k}", "cube", 1.0) for k in (0, 1))
    scene = Scene("two", "", things, surfaces, (Finish("green", (0.0, 0.8, 0.0, 1.0)),))
    owner = np.repeat([0, 1], 12)
    parts = Parts(owner, owner, np.ones(24), (Part("a", 0, "node"), Part("b", 1, "node")))
    axis = np.linspace(-0.45, 0.45, 10)
    lattice = np.stack(np.meshgrid(axis, axis, axis + 0.5), -1).reshape(-1, 3)
    points = np.concatenate([lattice, lattice + np.array([1.5, 0, 0])])
    thing = np.repeat([0, 1], len(lattice))
    particles = Particles(
        points, points * 0, np.full(len(points), 1e-3), np.full(len(points), 1e3), thing, thing,
        0.1, (), np.zeros((0, 3)), thing[:0], (1.0, 1.0),
    )  # fmt: skip
    made = (Material("rubber", Law.NEO_HOOKEAN, 1e6, 0.45, 1e3), Material("steel", Law.COROTATED, 2e11, 0.3, 7850.0))
    pair, words = np.full((3, 3), 0.5), PartDescription("thing", "rubber")
    field = MaterialField(made, (Structure("solid"),) * 2, (words,) * 2, pair, pair)
    trajectory = Trajectory(
        Path("nowhere"), np.arange(count) / 60, ledger(np.arange(count) / 60), Frames(particles, F, shift, count)
    )
    return SimulationResult(PreparedScene(scene, Inventory(()), parts, field, particles), trajectory)


def made_of(played, gaussians, owner):
    """Say that a scene was made of Gaussians."""
    none = np.zeros((0, 3))
    cloud = FeatureCloud(none, none, none, none, np.zeros(0, int))
    boxes = np.array([mesh.bounds for mesh in (cube(0), cube(1))])
    names = tuple(o.name for o in played.prepared.scene.objects)
    found = Reconstruction(gaussians, owner, cloud, np.zeros(0, int), names, boxes, 1.0, np.eye(4))
    return replace(played, reconstruction=found)


def puppet(gaussians, owner, played):
    return stage._gaussian_deformer(SMALL, made_of(played, gaussians, owner))


def test_objects_that_move_rigidly_look_as_they_do_to_the_inverse_camera():
    played = play()
    gaussians, owner = together(clad(0), clad(1))
    only = replace(gaussians, opacity=np.where(owner == 1, gaussians.opacity, 0.0))
    after = puppet(only, owner, played).at(played.trajectory.frames[1], None)
    back = np.eye(4)
    back[:3, :3], back[:3, 3] = TURN, (0.0, 0.0, 0.3)
    there = replace(EYE, world_from_camera=np.linalg.inv(back) @ EYE.world_from_camera)
    one, two = rasteriser_numba.render(after, EYE), rasteriser_numba.render(only, there)
    assert one.alpha.mean() > 0.03
    np.testing.assert_allclose(one.rgb, two.rgb, atol=5e-6)
    np.testing.assert_allclose(one.alpha, two.alpha, atol=5e-6)
    wrong = replace(after, sh=only.sh)
    assert np.abs(rasteriser_numba.render(wrong, EYE).rgb - two.rgb).max() > 5e-3, "colours must turn too"


def test_gaussians_follow_particles_of_their_own_object_and_the_rest_stands_still():
    played = play()
    gaussians, owner = together(clad(0), clad(1), clad(1))
    owner = np.where(owner == 2, -1, owner)
    after = puppet(gaussians, owner, played).at(played.trajectory.frames[1], None)
    np.testing.assert_array_equal(after.mean[owner == -1], gaussians.mean[owner == -1])
    np.testing.assert_array_equal(after.sh[owner == -1], gaussians.sh[owner == -1])
    np.testing.assert_allclose(after.mean[owner == 0], gaussians.mean[owner == 0], atol=1e-6)
    there = gaussians.mean[owner == 1] @ TURN.T + [0, 0, 0.3]
    np.testing.assert_allclose(after.mean[owner == 1], there, atol=1e-6)


def test_gaussians_stretch_with_the_matter():
    F = np.diag([1.4, 1.0, 0.6])
    played = play(F)
    gaussians, owner = together(clad(0), clad(1))
    round_ = replace(gaussians, scale=np.full_like(gaussians.scale, 0.03))
    after = puppet(round_, owner, played).at(played.trajectory.frames[1], None)
    wanted = np.tile([0.018, 0.03, 0.042], ((owner == 1).sum(), 1))
    np.testing.assert_allclose(np.sort(after.scale[owner == 1], axis=1), wanted, rtol=1e-6)


def still(folder, number):
    return np.asarray(stage.Image.open(folder / f"stills/{number:05d}.png")).astype(int)


def reddish(picture):
    return (picture[..., 0] > 1.6 * picture[..., 1]) & (picture[..., 0] > 60)


def greenish(picture):
    return (picture[..., 1] > 1.6 * picture[..., 0]) & (picture[..., 1] > 60)


@pytest.fixture(scope="module")
def videos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("videos")
    played = made_of(play(np.eye(3), (0.0, 0.0, 0.6)), *together(clad(0), clad(1)))
    made = render_video(played, SMALL, folder / "gaussians")
    render_video(played, replace(SMALL, look="surfaces"), folder / "surfaces")
    assert len(video_file.read_frames(made.path, [0, 1, 2])) == 3
    return folder


def test_a_scene_made_of_gaussians_is_drawn_from_them(videos):
    one, other = still(videos / "gaussians", 0), still(videos / "surfaces", 0)
    assert reddish(one).mean() > 0.1 and not greenish(one).any()
    assert greenish(other).mean() > 0.1 and not reddish(other).any()
    both = reddish(one) & greenish(other)
    assert both.sum() > 0.8 * max(reddish(one).sum(), greenish(other).sum())


def test_objects_of_gaussians_cast_shadows_on_the_usual_floor(videos):
    one, other = still(videos / "gaussians", 2), still(videos / "surfaces", 2)
    floor = ~binary_dilation(reddish(one) | greenish(other), iterations=5)
    assert floor.mean() > 0.3
    assert np.abs(one - other)[floor].mean() < 3.0, "the same floor with the same shadows"
    assert one[floor].min() < 0.8 * np.median(one[floor]), "there is a shadow"


def test_the_picture_follows_the_motion(videos):
    first, last = (np.argwhere(reddish(still(videos / "gaussians", k))) for k in (0, 2))
    assert first[:, 0].min() > last[:, 0].min() + 5, "the second cube was lifted"


def test_what_stands_still_is_carried_and_lit_once(tmp_path, monkeypatch):
    """As in most videos of photographs that say nothing of what is to happen."""
    carried, carry = [], stage.MovingGaussians.at
    monkeypatch.setattr(stage.MovingGaussians, "at", lambda *given: carried.append(1) or carry(*given))
    played = made_of(play(np.eye(3), (0.0, 0.0, 0.0), 5), *together(clad(0), clad(1)))
    render_video(played, SMALL, tmp_path / "still")
    assert len(carried) == 1
    np.testing.assert_array_equal(still(tmp_path / "still", 0), still(tmp_path / "still", 4))
    played = made_of(play(np.eye(3), (0.0, 0.0, 0.6), 3), *together(clad(0), clad(1)))
    render_video(played, SMALL, tmp_path / "lifted")
    assert len(carried) == 3, "once before it moves, and once after"


def test_colours_can_tell_what_objects_are(tmp_path):
    played = made_of(play(), *together(clad(0), clad(1)))
    render_video(played, replace(SMALL, colour_by="object"), tmp_path)
    picture = still(tmp_path, 0)
    for k in (0, 1):
        wanted = 255 * np.array(colours.colour_from_hex(colours.OBJECT_COLOURS[k]))
        assert (np.abs(picture - wanted).max(axis=-1) < 4).sum() > 300
    render_video(played, replace(SMALL, colour_by="speed"), tmp_path)
    slow = 255 * colours.ramp_colours(np.zeros(1))[0]
    assert (np.abs(still(tmp_path, 0) - slow).max(axis=-1) < 4).sum() > 300


def test_surfaces_can_be_coloured_too(tmp_path):
    render_video(play(), replace(SMALL, colour_by="young_pa"), tmp_path)
    picture = still(tmp_path, 0)
    soft = picture[..., 2] > 1.3 * picture[..., 0]
    stiff = picture[..., 0] > 1.3 * picture[..., 2]
    assert soft.sum() > 300 and stiff.sum() > 300


def test_gaussians_that_are_not_there_cannot_be_rendered(tmp_path):
    with pytest.raises(UserError, match="look 'surfaces'"):
        render_video(play(), replace(SMALL, look="gaussians"), tmp_path)
