"""A roof of rays over what no camera looked along is halved, and nothing else is."""

import numpy as np
import pytest
import trimesh

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import camera_rows
from corporeal.reconstruction.surface.hull_top import MIN_SAID_HEIGHT_FRACTION, HullTop, lower_hull_top
from corporeal.render.camera_placement import CameraAim, camera_from_aim

SIDE, AWAY, STEEP = 160, 6.0, 40.0
"""Pictures [px], distance, and how steeply cameras look down [deg]."""
WIDE, WALL = 0.5, 0.25
"""Radius of a round box, and the height of its walls."""
RISE = AWAY * np.sin(np.radians(STEEP)) - WALL
GRAZES = float(np.degrees(np.arctan2(RISE, AWAY * np.cos(np.radians(STEEP)) + WIDE)))
"""Slope of the rays that graze the far eaves from across the box [deg]."""
WIDTH = 2 * AWAY * np.tan(np.radians(15)) / SIDE
"""Of a pixel."""
PIXEL = WIDTH / np.cos(np.radians(STEEP))
"""Height that makes a pixel's difference."""


def rows(steep):
    """Cameras all around that look down at an angle."""
    turns = np.radians(np.arange(0, 360, 15))
    flat, high = AWAY * np.cos(np.radians(steep)), AWAY * np.sin(np.radians(steep))
    aims = [CameraAim((flat * np.cos(t), flat * np.sin(t), high), (0.0, 0.0, 0.0), 30.0, SIDE, SIDE) for t in turns]
    cameras = camera_rows(tuple(camera_from_aim(aim) for aim in aims))
    return np.concatenate([cameras, np.full((len(cameras), 2), float(SIDE))], axis=1)


def tent(slope):
    """A round box with a cone on it, in fine triangles; slope of its roof [deg]."""
    turns = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    ring = WIDE * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    top = [(0.0, 0.0, WALL + WIDE * np.tan(np.radians(slope)))]
    walls = [np.column_stack([ring, np.full(48, z)]) for z in (0.0, WALL)]
    mesh = trimesh.convex.convex_hull(np.concatenate([*walls, top]))
    for _ in range(4):
        mesh = mesh.subdivide()
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces).astype(np.int64))


def halved(mesh, known=0.0, still=False, steep=STEEP):
    """Ask about a surface that photographs know so far."""
    count = len(mesh.vertices)
    with ThreadPool(1) as pool:
        belief, stays = np.broadcast_to(known, count), np.full(count, still)
        return lower_hull_top(mesh, belief, stays, rows(steep), (SIDE, SIDE), pool)


def test_a_roof_of_grazing_rays_is_lowered_to_its_middle_and_reported():
    mesh = tent(GRAZES)
    made, roof = halved(mesh)
    ridge = WIDE * np.tan(np.radians(GRAZES))
    assert made.vertices[:, 2].max() == pytest.approx(WALL + ridge / 2, abs=PIXEL)
    top = made.vertices[:, 2].max()
    assert roof.share == pytest.approx((mesh.vertices[:, 2].max() - top) / top)
    rise = AWAY * np.sin(np.radians(STEEP)) - mesh.vertices[:, 2].max() / 2
    assert np.tan(np.radians(roof.lowest)) == pytest.approx(rise / (AWAY * np.cos(np.radians(STEEP))))
    [said] = roof.warnings
    assert f"±{roof.share:.0%}" in said and "from low down" in said


def test_walls_below_the_eaves_stay_where_they_are():
    mesh = tent(GRAZES)
    made, _ = halved(mesh)
    low = mesh.vertices[:, 2] < WALL - PIXEL
    assert np.array_equal(made.vertices[low], mesh.vertices[low])
    assert np.array_equal(made.vertices[:, :2], mesh.vertices[:, :2])


@pytest.mark.parametrize(
    ("mesh", "how"),
    [
        (tent(GRAZES), {"known": 0.9}),
        (tent(GRAZES), {"still": True}),
        (tent(0.0), {}),
        (tent(20.0), {}),
        (tent(GRAZES), {"steep": 15.0}),
    ],
    ids=["photographs know it", "something stands on it", "flat", "below the rays", "looked along"],
)
def test_what_something_holds_stays(mesh, how):
    made, roof = halved(mesh, **how)
    lost = mesh.vertices[:, 2].max() - made.vertices[:, 2].max()
    assert lost <= PIXEL
    assert roof.share <= MIN_SAID_HEIGHT_FRACTION and not roof.warnings


def test_nothing_goes_below_what_photographs_know_of_a_roof():
    mesh = tent(GRAZES)
    z, known = mesh.vertices[:, 2], WALL + 0.8 * WIDE * np.tan(np.radians(GRAZES))
    patch = (mesh.vertices[:, 0] > 0) & (z > WALL) & (z <= known)
    made, roof = halved(mesh, known=patch.astype(float))
    reached, top = z[patch].max(), made.vertices[:, 2].max()
    assert np.array_equal(made.vertices[z < reached - PIXEL], mesh.vertices[z < reached - PIXEL])
    assert top == pytest.approx((reached + z.max()) / 2, abs=PIXEL)
    assert 0 < roof.share < MIN_SAID_HEIGHT_FRACTION < halved(mesh)[1].share


def test_a_speck_that_photographs_know_holds_no_roof():
    mesh = tent(GRAZES)
    area = np.bincount(mesh.triangles.ravel(), np.repeat(mesh.areas / 3, 3))
    high = np.flatnonzero(mesh.vertices[:, 2] > WALL + 0.9 * WIDE * np.tan(np.radians(GRAZES)))
    speck = np.zeros(len(mesh.vertices))
    speck[high[area[high].argmin()]] = 1.0
    assert 0 < speck @ area < WIDTH**2
    assert halved(mesh, known=speck)[1] == halved(mesh)[1]


def test_little_doubt_is_not_reported():
    assert not HullTop(MIN_SAID_HEIGHT_FRACTION, 40.0).warnings
