"""Bodies start free of each other and of the floor, near each other, and upright."""

from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
import trimesh
from bodies import ball, body, box, table

from corporeal.core.errors import UnknownChoiceError
from corporeal.geometry.convex_hull import tip_angle
from corporeal.scene.arrange_bodies import BodyArrangement, arrange_bodies
from corporeal.scene.settling_body import scene_unit_of

THINGS = [table(), box(0.2, 0.1, 0.3), ball(0.1), box(0.1, 0.1, 0.1)]
DOWN = np.array([0.0, 0.0, -1.0])


def clouds(poses):
    made = []
    for thing, pose in zip(THINGS, poses, strict=True):
        mesh = trimesh.Trimesh(thing.vertices, thing.triangles)
        points, _ = trimesh.sample.sample_surface(mesh, 3000, seed=0)
        made.append(pose.world(np.concatenate([points, thing.vertices])))
    return made


@pytest.mark.parametrize("arrangement", get_args(BodyArrangement))
@pytest.mark.parametrize("seed", [0, 1])
def test_nothing_touches_at_the_start(arrangement, seed):
    poses = arrange_bodies(THINGS, arrangement, np.random.default_rng(seed))
    placed = clouds(poses)
    assert min(c[:, 2].min() for c in placed) > 1e-3
    for i, (thing, pose) in enumerate(zip(THINGS, poses, strict=True)):
        for j, cloud in enumerate(placed):
            if i != j:
                points = pose.body(cloud)
                assert not thing.shape.inside(points).any()
                assert thing.shape.closest(points)[0].min() > 1e-3
    everything = np.concatenate(placed)
    assert np.ptp(everything[:, :2], axis=0).max() < 2 * scene_unit_of(THINGS)


def test_what_is_dropped_starts_close_above():
    poses = arrange_bodies(THINGS, "stack", np.random.default_rng(0))
    placed = sorted(clouds(poses), key=lambda c: c[:, 2].min())
    assert placed[0][:, 2].min() < 0.02
    for below, above in pairwise(placed):
        assert above[:, 2].min() < below[:, 2].max() + 0.02


def test_what_stands_starts_upright_and_what_does_not_is_tumbled():
    pole = body(trimesh.creation.cylinder(0.005, 0.5), "pole")
    things = [table(), pole]
    poses = [arrange_bodies(things, "scatter", np.random.default_rng(k)) for k in range(4)]
    assert all(p[0].rotation[2, 2] == pytest.approx(1, abs=1e-9) for p in poses)
    assert np.ptp([p[1].rotation[2, 2] for p in poses]) > 0.1
    yaws = [np.arctan2(*p[0].rotation[1::-1, 0]) for p in poses]
    assert np.ptp(yaws) > 0.5


def test_a_slanted_underside_is_put_flat_on_the_floor():
    mesh = trimesh.creation.box([0.4, 0.4, 0.4])
    slanted = np.array(mesh.vertices)
    slanted[slanted[:, 2] < 0, 2] += 0.05 * slanted[slanted[:, 2] < 0, 0]
    thing = body(trimesh.Trimesh(slanted, mesh.faces), "slanted")
    assert tip_angle(thing.hull, thing.centre, DOWN) == 0
    assert thing.upright.tip > 0.7
    (pose,) = arrange_bodies([thing], "scatter", np.random.default_rng(0))
    heights = np.sort(pose.world(thing.vertices)[:, 2])
    assert np.ptp(heights[:4]) < 1e-6


def test_a_box_tips_at_the_angle_of_its_diagonal():
    thing = box(0.2, 0.3, 0.4)
    assert tip_angle(thing.hull, thing.centre, DOWN) == pytest.approx(np.arctan(0.1 / 0.2))
    assert thing.steadiest.tip == pytest.approx(np.arctan(0.15 / 0.1))
    assert abs(thing.steadiest.down[0]) == pytest.approx(1)
    assert thing.upright.top == pytest.approx(0.06)


def test_a_ball_stands_on_nothing():
    assert tip_angle(ball(0.1).hull, np.zeros(3), np.array([0.6, 0.48, 0.64])) < 0.1


def test_unknown_arrangements_are_refused():
    with pytest.raises(UnknownChoiceError, match="scatter"):
        arrange_bodies(THINGS, "heap", np.random.default_rng(0))  # type: ignore[arg-type]
