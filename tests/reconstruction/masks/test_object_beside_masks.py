"""Something of another colour that stands beside what masks show is told, and a print is not."""

import numpy as np
import pytest
from painted_scene import FLOOR, OTHER, scene

from corporeal.io.photos.transforms_json import write_views
from corporeal.multiview.epipolar import projection_matrix
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussian_source import find_or_grow_masks
from corporeal.reconstruction.masks.floor_parallax import find_standing_regions
from corporeal.reconstruction.masks.grown_masks import grown_masks
from corporeal.reconstruction.masks.object_beside_masks import find_object_beside_masks
from corporeal.reconstruction.masks.region_growing import widen_silhouettes
from corporeal.reconstruction.reconstruct_config import ReconstructConfig

GROUND = GroundPlane(np.array([0.0, 0.0, 1.0]), FLOOR, 1.0, 0.01)


def told(views, masks, floor):
    stands = find_standing_regions(views, masks, floor, find_viewed_region(views.cameras))
    assert stands is not None
    return find_object_beside_masks(stands, masks, widen_silhouettes(masks))


@pytest.mark.parametrize("floor", [GROUND, None], ids=["floor", "no floor"])
def test_what_stands_beside_it_is_reported_and_where(floor):
    views, masks, _ = scene(other="ball")
    found = told(views, masks, floor)
    assert found is not None and 0.1 < found.as_large < 0.7  # (.2 / .5)², and a hull is fat
    camera = views.cameras[found.view]
    u, v, depth = projection_matrix(camera) @ [*OTHER, 1.0]
    assert abs(u / depth / camera.width - found.across) < 0.06
    assert abs(v / depth / camera.height - found.down) < 0.06


@pytest.mark.parametrize("other", [None, "disc"])
@pytest.mark.parametrize("floor", [GROUND, None], ids=["floor", "no floor"])
def test_a_floor_and_a_print_on_it_are_no_objects(floor, other):
    views, masks, _ = scene(other=other)
    assert told(views, masks, floor) is None


def test_what_masks_hold_is_not_beside_them():
    views, masks, _ = scene(other="ball")
    blue = views.rgb[..., 2].astype(int) > 1.5 * views.rgb[..., 0]
    both = masks | blue
    assert told(views, both, GROUND) is None


@pytest.mark.slow
def test_a_run_says_what_was_left_out_until_masks_are_corrected(tmp_path):
    views, _, _ = scene(other="ball")
    photos, made = tmp_path / "photos", tmp_path / "made"
    write_views(photos, views)
    asked = [find_or_grow_masks(ReconstructConfig(), photos, made, lambda share, words: None)]
    said = [w for w in asked[0].warnings if w.startswith("Something else stands on the floor")]
    assert len(said) == 1 and "give masks of all" in said[0]
    assert grown_masks(photos, made).beside == said[0], "it is said again when nothing is grown"
    next(iter((made / "masks").glob("*.png"))).unlink()
    assert grown_masks(photos, made).beside == ""
