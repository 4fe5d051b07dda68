"""Temporary files are gone when what needed them is done."""

import os
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from PIL import Image

from corporeal.core.errors import UserError
from corporeal.reconstruction.gaussian_source import gaussians_from_source
from corporeal.reconstruction.reconstruct_config import ReconstructConfig

RUN = """
import sys
from pathlib import Path
import corporeal as co
from corporeal.pipeline.run_pipeline import run
folder = Path(sys.argv[1])
scene = co.build_scene(co.ball("rubber", 0.05, (0.0, 0.0, 0.06)), duration=0.02, fps=50)
co.write_glb(folder / "ball.glb", scene)
(folder / "tetrahedron.obj").write_text(
    "v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nv 0 0 1\\nf 1 3 2\\nf 1 2 4\\nf 2 3 4\\nf 1 4 3\\n"
)
co.load_scene(folder / "tetrahedron.obj")
result = co.simulate_scene(scene)
assert len(result.trajectory.time) == 2 and len(list(Path(sys.argv[2]).iterdir())) == 1
run([folder / "ball.glb"], folder / "run", until="simulate")
"""


def test_a_process_that_ends_leaves_no_temporary_files(tmp_path):
    """A mesh read by a child process, a simulation in memory, and a run."""
    place = tmp_path / "temporary"
    place.mkdir()
    subprocess.run(
        [sys.executable, "-c", RUN, str(tmp_path), str(place)],
        check=True,
        capture_output=True,
        env=os.environ | {"TMPDIR": str(place)},
    )
    assert (tmp_path / "run").is_dir()
    assert list(place.iterdir()) == []


def test_photographs_without_a_folder_of_a_run_leave_no_temporary_files(tmp_path, monkeypatch):
    photos, place = tmp_path / "photos", tmp_path / "temporary"
    photos.mkdir()
    place.mkdir()
    rng = np.random.default_rng(0)
    for k in range(5):
        picture = rng.integers(0, 255, (48, 64, 3), np.uint8)
        Image.fromarray(picture).save(photos / f"{k}.png")
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    with pytest.raises(UserError, match="5 photographs are too few"):
        gaussians_from_source(photos, ReconstructConfig(), None, lambda fraction, words: None)
    assert list(place.iterdir()) == []
