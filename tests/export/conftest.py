"""A small run that holds all that an export must carry: rigid, soft, granular and metal."""

from dataclasses import replace

import pytest
from export_helpers import asked_of

import corporeal as co
from corporeal.export.export_target import ExportConfig, ExportRequest
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_scene
from corporeal.pipeline.run_pipeline import read_run

TITLE = "мяч ball 1"
"""A name with a space and letters that no identifier has."""


def scene_of_everything():
    """A falling steel block, a soft ball that meets the floor, and a heap of sand."""
    return co.build_scene(
        co.box("steel", (0.06, 0.04, 0.03), (0.0, 0.0, 0.3), (0.5, 0.0, -1.0), name="block"),
        co.ball("meat", 0.04, (0.2, 0.0, 0.041), (0.0, 0.1, -1.0), name=TITLE),
        co.box("dry_sand", (0.08, 0.08, 0.04), (-0.2, 0.0, 0.021), name="heap"),
        duration=0.1,
        fps=40,
    )


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory):
    """The folder of a finished simulation, in a place with a space and other letters."""
    place = tmp_path_factory.mktemp("run") / "опыт 1"
    place.mkdir()
    path = place / "scene.glb"
    co.write_glb(path, scene_of_everything())
    return co.run([path], place / "runs", until="simulate")


@pytest.fixture(scope="session")
def played(run_folder):
    return read_run(run_folder).played


@pytest.fixture(scope="session")
def asked(played):
    return asked_of(played)


@pytest.fixture
def written(asked, tmp_path):
    """Write a target; returns its folder."""

    def write(writer, of=asked):
        folder = tmp_path / f"out {len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        writer(of, folder)
        return folder

    return write


@pytest.fixture(scope="session")
def settled():
    """Three boxes that lie on one another and on the floor, not simulated."""
    scene = co.build_scene(
        co.box("wood", (0.2, 0.2, 0.04), (0.0, 0.0, 0.02), name="board"),
        co.box("steel", (0.06, 0.06, 0.05), (0.03, 0.0, 0.065), name="block"),
        co.box("wood", (0.05, 0.05, 0.05), (0.03, 0.01, 0.115), name="cube"),
    )
    prepared = co.prepare_scene(replace(scene, settled=True))
    motion = motion_of_scene(prepared)
    return ExportRequest(physical_scene(prepared, motion), motion, ExportConfig())
