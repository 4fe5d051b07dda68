"""Every prop is a body: closed, shaded outwards, of real size, with real matter in it."""

import numpy as np
import prop_soundness
import pytest

from corporeal.showcase.prop_models import PROP_BUILDERS

# Matter [cm³] and size [mm] of each prop: wall area × wall where hollow, volume where solid.
TABLE = {
    "rubber_duck": (63.9, (126, 84, 110)),
    "soda_can": (5.18, (66, 66, 115)),
    "mud_pile": (2587, (237, 268, 91)),
    "vase": (792.3, (188, 188, 281)),
    "ball": (5565, (220, 220, 220)),
    "armchair": (97480, (788, 712, 923)),
    "floor_lamp": (2844, (430, 430, 1550)),
    "couch": (535400, (895, 1754, 839)),
    "potted_ficus": (11640, (820, 874, 1264)),
    "small_tree": (1190, (665, 617, 1076)),
    "sand_pile": (95595, (1181, 1218, 196)),
    "snow_heap": (97920, (1238, 1182, 241)),
    "steel_ball": (522.7, (100, 100, 100)),
    "rubber_ball": (522.7, (100, 100, 100)),
    "snowman": (213500, (687, 1145, 1202)),
    "book": (954.2, (158, 210, 32)),
    "mug": (139.2, (113, 82, 94)),
    "cushion": (17630, (469, 469, 154)),
    "tumbler": (84.9, (70, 70, 100)),
    "honey": (110.2, (40, 40, 90)),
    "ketchup": (164.1, (60, 60, 60)),
    "wooden_ball": (65.2, (50, 50, 50)),
}


def picture_bytes(part):
    return b"" if part.finish.texture is None else part.finish.texture.tobytes()


def test_the_menu_has_all_props():
    assert set(PROP_BUILDERS) == set(TABLE)


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLE)
def test_every_part_is_closed_and_faces_outwards(models, name):
    for part in models[name].parts:
        body = prop_soundness.measure_soundness(part)
        assert body.closed, part.name
        assert body.shaded_outwards > 0.95, part.name
        assert np.allclose(np.linalg.norm(part.mesh.normals, axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("name", TABLE)
def test_a_prop_has_its_real_size_and_matter(models, name):
    matter, size = TABLE[name]
    model = models[name]
    low, high = model.bounds()
    assert low[2] == pytest.approx(0, abs=1e-4), "it stands on the floor"
    assert 1e3 * (high - low) == pytest.approx(size, abs=1)
    assert 1e6 * sum(prop_soundness.measure_soundness(p).matter for p in model.parts) == pytest.approx(matter, rel=0.02)


@pytest.mark.parametrize("name", TABLE)
def test_parts_touch_and_do_not_overlap(models, name):
    assert prop_soundness.overlap_fraction(models[name].parts) < 1.5e-3


# One for each way of making a surface: marching, booleans, lathes, mounds, growth, drawing.
@pytest.mark.parametrize("name", ["mug", "armchair", "vase", "mud_pile", "potted_ficus", "book"])
def test_the_same_code_makes_the_same_prop(models, name):
    for first, again in zip(models[name].parts, PROP_BUILDERS[name]().parts, strict=True):
        assert np.array_equal(first.mesh.vertices, again.mesh.vertices)
        assert np.array_equal(first.mesh.faces, again.mesh.faces)
        assert np.array_equal(first.mesh.uv, again.mesh.uv)
        assert picture_bytes(first) == picture_bytes(again)


def test_textures_are_small(models):
    for part in (p for m in models.values() for p in m.parts):
        texture = part.finish.texture
        assert texture is None or (texture.dtype == np.uint8 and max(texture.shape[:2]) <= 512)
