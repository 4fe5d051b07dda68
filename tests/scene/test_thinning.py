"""A hull of few corners holds all of the original, and is hardly larger."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from corporeal.geometry.convex_hull import convex_hull_of, simplify_convex


def hull(mesh):
    return convex_hull_of(np.asarray(mesh.vertices, float), 0.0)


ROUND = {
    "ball": trimesh.creation.icosphere(3, 0.1),
    "cylinder": trimesh.creation.cylinder(0.05, 0.2, sections=200),
    "cone": trimesh.creation.cone(0.1, 0.2, sections=180),
}


@pytest.mark.parametrize("most", [16, 64])
@pytest.mark.parametrize("name", ROUND)
def test_nothing_of_the_original_sticks_out(name, most):
    original = hull(ROUND[name])
    few = simplify_convex(original, most)
    assert 8 <= len(few.vertices) <= most < len(original.vertices)
    planes = ConvexHull(few.vertices).equations
    assert (original.vertices @ planes[:, :3].T + planes[:, 3]).max() < 1e-7
    # It stands where it stood: the upright box is the same.
    for side in (np.min, np.max):
        np.testing.assert_allclose(side(few.vertices, axis=0), side(original.vertices, axis=0), atol=1e-7)
    assert few.volume > original.volume


def test_more_corners_are_closer():
    original = hull(ROUND["ball"])
    excess = [simplify_convex(original, most).volume / original.volume - 1 for most in (16, 32, 64)]
    assert excess[0] > excess[1] > excess[2]
    # A dodecahedron about a sphere is 32.5 % larger, and the excess goes as one over the faces:
    # 64 corners, three faces at each, have 34.
    assert excess[2] == pytest.approx(0.325 * 12 / 34, rel=0.15)


def test_a_flat_face_stays_where_it_was():
    """A cylinder with a slope for a top keeps it: something may lie there."""
    angle = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    x, y = 0.1 * np.cos(angle), 0.1 * np.sin(angle)
    low, high = np.zeros_like(x), 0.05 + 0.2 * x
    rings = [np.column_stack([x, y, z]) for z in (low, high)]
    original = convex_hull_of(np.concatenate(rings), 0.0)
    few = simplify_convex(original, 40)
    normal = np.array([-0.2, 0, 1]) / np.hypot(0.2, 1)
    tops = [(h.vertices @ normal).max() for h in (original, few)]
    assert tops[1] == pytest.approx(tops[0], abs=1e-7)


def test_what_has_few_corners_already_stays_as_it_is():
    original = hull(trimesh.creation.box((1, 2, 3)))
    assert simplify_convex(original, 64) is original
