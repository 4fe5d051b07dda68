"""A chair gives where its cushion is, and nowhere else.

A steel ball of 4 kg is thrown onto the armchair of the showcase, through all stages.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from corporeal.core.store import DATA_FILE, load
from corporeal.discretization import discretization_plan
from corporeal.geometry.rotation import fit_rigid_motion
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import STAGE_FOLDERS, Settings
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.showcase import showcase_scenes
from corporeal.simulation.residual_shape import box_diagonal, mean_of_largest
from corporeal.simulation.trajectory_files import read_trajectory

SCENE = "ball-on-armchair"
FEW = 5_000
"""Particles of a grid so coarse that the experiment takes seconds."""


@pytest.fixture(scope="module")
def thrown(tmp_path_factory):
    """Throw the ball once for each rule; give how every part changed its shape."""
    patch = pytest.MonkeyPatch()
    ball = showcase_scenes.PlacedModel("steel_ball", (0.06, 0.0, 0.55), velocity=(0.0, 0.0, -2.5))
    chair = showcase_scenes.PlacedModel("armchair", without=("back_cushion",))
    told = showcase_scenes.ShowcaseComposition("", (chair, ball), view=(1.0, -1.0, 0.4), duration=0.2)
    patch.setitem(showcase_scenes.SHOWCASE_SCENE_BUILDERS, SCENE, lambda: told)

    @cache
    def shapes(stiffness, particles=FEW):
        coarse = replace(discretization_plan.QUALITY_PRESETS["draft"], particles=particles)
        patch.setitem(discretization_plan.QUALITY_PRESETS, "draft", coarse)
        folder = tmp_path_factory.mktemp(stiffness)
        file = run_pipeline.write_showcase(SCENE, folder / "input")
        settings = Settings(fill=FillConfig(stiffness=stiffness))
        silent = lambda verb: lambda fraction, words: None  # noqa: E731
        run_pipeline.run([file], folder, settings, silent, until="simulate")
        parts, particles = (load(folder / STAGE_FOLDERS[v] / DATA_FILE) for v in ("segment", "fill"))
        video = read_trajectory(folder / STAGE_FOLDERS["simulate"])
        names = [entry.name for entry in parts.catalogue]
        return {name: changes(video, particles.part == k) for k, name in enumerate(names)}

    yield shapes
    patch.undo()


def changes(video, mine):
    """Largest shape error [-] and squeeze [m] of some particles, at any time."""
    start = video.frames[0].position[mine].astype(float)
    error, squeeze = [], []
    for frame in video.frames:
        now = frame.position[mine].astype(float)
        shift = np.linalg.norm(fit_rigid_motion(start, now, np.ones(len(now))).undo(now) - start, axis=1)
        error.append(np.sqrt(np.mean(shift**2)) / box_diagonal(start))
        squeeze.append(mean_of_largest(shift))
    return max(error), max(squeeze)


@pytest.mark.slow
def test_a_chair_with_a_stiff_frame_and_a_soft_cushion_deforms_only_in_the_cushion(thrown):
    shape = thrown("true")
    frame_error, frame_squeeze = shape["frame"]
    cushion_error, cushion_squeeze = shape["seat_cushion"]
    assert frame_error < 1e-6 and frame_squeeze < 1e-6
    assert cushion_error > 5e-3 and 0.03 < cushion_squeeze < 0.1


@pytest.mark.slow
def test_under_the_published_cap_the_wood_of_the_same_chair_gives_too(thrown):
    """The control: with E capped the frame bends more than the cushion does."""
    shape = thrown("capped")
    assert shape["frame"][0] > 5e-3
    assert shape["frame"][1] > shape["seat_cushion"][1]
