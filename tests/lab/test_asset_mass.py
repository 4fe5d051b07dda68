"""Things of a pool are weighed as what will be simulated."""

import numpy as np
import pytest
import trimesh

from corporeal.lab.corpus import assemble_corpus
from corporeal.lab.corpus.assemble_corpus import asset_mass_properties
from corporeal.pool.asset_pool import PoolAsset


@pytest.fixture
def dumbbell(tmp_path):
    """A steel ball at the top and a wooden one of the same size at the bottom, Y-up in the file."""
    scene = trimesh.Scene()
    for name, height in (("steel", 0.3), ("wood", -0.3)):
        ball = trimesh.creation.icosphere(3, radius=0.2)
        ball.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(name=name))
        scene.add_geometry(ball.apply_translation([0.0, height, 0.0]), name, name)
    file = tmp_path / "dumbbell.glb"
    file.write_bytes(scene.export(file_type="glb"))
    return PoolAsset("dumbbell", "dumbbell", file, str(file), "0" * 64, "", "", 1.0, False, 1, 0.0, 0)


def test_what_is_heavier_at_the_top_has_its_centre_there(dumbbell, tmp_path):
    inertial = asset_mass_properties(dumbbell, 0.5)
    volume = 4 / 3 * np.pi * 0.1**3
    assert np.allclose(inertial.centre[:2], 0.0, atol=2e-3)
    heavy, light = 7850 * volume, 600 * volume
    assert inertial.mass == pytest.approx(heavy + light, rel=0.03)
    height = 0.15 * (heavy - light) / (heavy + light)
    assert inertial.centre[2] == pytest.approx(height, rel=0.02)
    own = 0.4 * (heavy + light) * 0.1**2
    assert inertial.inertia[2, 2] == pytest.approx(own, rel=0.03)
    apart = heavy * (0.15 - height) ** 2 + light * (0.15 + height) ** 2
    assert inertial.inertia[0, 0] == pytest.approx(own + apart, rel=0.03)


def test_nothing_is_weighed_twice(dumbbell, tmp_path, monkeypatch):
    first = asset_mass_properties(dumbbell, 0.5, tmp_path)
    monkeypatch.setattr(assemble_corpus, "fill", None)
    again = asset_mass_properties(dumbbell, 0.5, tmp_path)
    assert again.mass == first.mass
    assert np.array_equal(again.centre, first.centre)
    assert np.array_equal(again.inertia, first.inertia)
    with pytest.raises(TypeError):
        asset_mass_properties(dumbbell, 0.6, tmp_path)
