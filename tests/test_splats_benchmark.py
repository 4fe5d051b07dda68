"""The benchmark of Gaussians: rows as promised, and nothing measured twice."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corporeal.io.photos.transforms_json import write_views

HERE = Path(__file__).parent
ROW = {"scene", "preset", "masked", "views", "size", "psnr", "psnr_on_objects", "ssim", "deep", "near",
       "gaussians", "two_cores_s", "clock_s"}  # fmt: skip


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE / "splats"))
    monkeypatch.syspath_prepend(str(HERE.parent / "benchmarks"))
    monkeypatch.delitem(sys.modules, "splats", raising=False)
    import splats

    small = replace(splats.TRAINING_PRESETS["draft"], gaussians=200, steps=15)
    monkeypatch.setitem(splats.TRAINING_PRESETS, "draft", small)
    monkeypatch.setattr(splats, "LARGE", (500, 64))
    yield splats
    sys.modules.pop("splats", None)


def test_rows_and_page_are_made_from_one_run(bench, tmp_path, monkeypatch, capsys):
    from splat_scenes import around, blobs, pictured

    views, masks = pictured(blobs(), around(16, (40, 40)), (0.5, 0.5, 0.5))
    depth = np.where(masks, np.float32(3), np.float32(np.inf))
    views = replace(views, object_of_pixel=masks.astype(np.int32) - 1, depth=depth)
    write_views(tmp_path / "tiny" / "views", views)
    monkeypatch.setattr(bench, "PAGE", tmp_path / "page.md")
    out = tmp_path / "out"
    words = ["x", str(tmp_path / "tiny"), "--out", str(out), "--presets", "draft", "--docs"]
    monkeypatch.setattr(sys, "argv", words)
    bench.main()
    page = (tmp_path / "page.md").read_text()
    assert "| tiny | draft | pictures, masks |" in page and "0k Gaussians of degree 3" in page
    row = bench.kept(out, "tiny-draft-masks", lambda: pytest.fail("measured twice"))
    assert set(row) == ROW and row["views"] == 16 and row["psnr_on_objects"] < row["psnr"]
    assert 0 <= row["deep"] <= 1 and 0 <= row["near"] <= 1
    capsys.readouterr()
