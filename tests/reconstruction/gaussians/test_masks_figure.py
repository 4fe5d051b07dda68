"""The report shows what was taken for objects, over the photographs."""

import json

import numpy as np
from PIL import Image

from corporeal.reconstruction.masks_figure import FAINT_CONTRAST_FRACTION, OUTLINE_RGB, draw_masks_over, masks_figure
from corporeal.render.contact_sheet import TILE_GAP_PX

GREY = 100


def square(height, width):
    mask = np.zeros((height, width), bool)
    mask[10:30, 20:50] = True
    return mask


def test_what_is_no_object_is_paler_and_its_outline_is_drawn(tmp_path):
    picture = np.full((48, 64, 3), GREY, np.uint8)
    draw_masks_over([picture] * 9, np.stack([square(48, 64)] * 9), [f"{k}.jpg" for k in range(9)],
               tmp_path / "objects.png")  # fmt: skip
    page = np.asarray(Image.open(tmp_path / "objects.png").convert("RGB"))
    first = page[TILE_GAP_PX : TILE_GAP_PX + 48, TILE_GAP_PX : TILE_GAP_PX + 64]
    assert (first[20, 35] == GREY).all()
    assert (first[5, 5] == int(255 - FAINT_CONTRAST_FRACTION * (255 - GREY))).all()
    assert (first[10, 35] == OUTLINE_RGB).all()
    assert (first[20, 20] == OUTLINE_RGB).all()
    assert (np.all(page == OUTLINE_RGB, axis=-1).sum()) == 6 * 96, "six of nine are shown"


def photographs(folder, count=8):
    """Write grey photographs with poses."""
    frames = []
    for k in range(count):
        Image.fromarray(np.full((48, 64, 3), GREY, np.uint8)).save(folder / f"{k}.png")
        pose = np.eye(4)
        pose[0, 3] = k
        frames.append({"file_path": f"{k}.png", "transform_matrix": pose.tolist()})
    said = {"camera_angle_x": 0.8, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(said))


def test_masks_of_another_folder_are_drawn_over_whole_photographs(tmp_path):
    photographs(tmp_path)
    masks_figure(tmp_path, None, tmp_path / "objects.png")
    assert not (tmp_path / "objects.png").exists(), "there are no masks"
    (tmp_path / "drawn").mkdir()
    for k in range(8):
        mask = Image.fromarray(np.uint8(255 * square(48, 64)))
        mask.save(tmp_path / "drawn" / f"{k}.png")
    masks_figure(tmp_path, tmp_path / "drawn", tmp_path / "objects.png")
    page = np.asarray(Image.open(tmp_path / "objects.png").convert("RGB"))
    assert np.all(page == OUTLINE_RGB, axis=-1).sum() == 6 * 96
    pale = int(255 - FAINT_CONTRAST_FRACTION * (255 - GREY))
    assert np.all(page == pale, axis=-1).sum() == 6 * (48 * 64 - 20 * 30), "not white outside"
