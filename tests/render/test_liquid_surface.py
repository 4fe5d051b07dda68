"""A liquid's surface in a picture lies where its particles end."""

import numpy as np
import pytest

from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.render.liquid_surface import liquid_surface

SPACING = 0.003


def block(count=10):
    axis = (np.arange(count) + 0.5) * SPACING
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)


def test_a_block_keeps_its_size_and_looks_outwards():
    found = liquid_surface(block(), SPACING)
    size = 10 * SPACING
    assert found.vertices.min(axis=0) == pytest.approx(0, abs=0.15 * SPACING)
    assert found.vertices.max(axis=0) == pytest.approx(size, abs=0.15 * SPACING)
    volume = signed_volume(Mesh(found.vertices, found.triangles))
    assert volume == pytest.approx(size**3, rel=0.03)
    outward = np.sum(found.normals * (found.vertices - size / 2), axis=1)
    assert (outward > 0).mean() > 0.99


def test_a_drop_that_flew_off_is_a_ball_of_its_own():
    drop = np.array([[0.06, 0.0, 0.01]])
    found = liquid_surface(np.concatenate([block(), drop]), SPACING)
    there = found.vertices[found.vertices[:, 0] > 0.045]
    assert np.linalg.norm(there - drop, axis=1) == pytest.approx(0.6 * SPACING, rel=0.15)


def test_what_is_lost_is_left_out():
    lost = np.full((3, 3), np.nan)
    assert len(liquid_surface(np.concatenate([block(), lost]), SPACING).triangles) > 0
    assert len(liquid_surface(lost, SPACING).triangles) == 0
