"""The public names: few, loaded when used, never shadowed, and clear about bad input."""

import pkgutil
import subprocess
import sys

import numpy as np
import pytest

import corporeal as co

HEAVY = ("numpy", "warp", "trimesh", "numba", "scipy", "corporeal.core.types")
CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


def test_importing_the_package_imports_nothing_heavy():
    asked = f"import sys, corporeal; print([m for m in {HEAVY} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


HELP = """
import sys
from corporeal import cli
sys.argv = ["corporeal", "--help"]
try:
    cli.main()
except SystemExit:
    pass
"""


@pytest.mark.parametrize(
    ("done", "unwanted"),
    [
        (HELP, "scipy numba warp trimesh matplotlib pydantic mujoco torch corporeal.pipeline.run_pipeline"),
        # What a run of a model has imported when its first verb begins.
        (
            "import corporeal.cli.validate_settings, corporeal.pipeline.run_pipeline",
            "numba warp trimesh networkx matplotlib mujoco torch pydantic_ai embreex scipy.ndimage "
            "corporeal.reconstruction.gaussians.train_gaussians corporeal.pipeline.stages.reconstruct "
            "corporeal.pipeline.stages.simulate "
            "corporeal.pipeline.stages.video corporeal.pipeline.run_files corporeal.io.photos.posed_photos",
        ),
    ],
)
def test_what_is_not_needed_to_begin_is_not_imported(done, unwanted):
    asked = f"{done}\nimport sys; print([m for m in {unwanted.split()} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert said.stdout.splitlines()[-1] == "[]"


def test_every_public_name_can_be_loaded_and_is_listed():
    assert all(getattr(co, name) is not None for name in co.__all__)
    assert set(co.__all__) <= set(dir(co))


def test_no_public_name_is_that_of_a_module_of_the_package():
    assert not set(co.__all__) & {module.name for module in pkgutil.iter_modules(co.__path__)}


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'bal'"):
        co.bal  # noqa: B018


def test_a_scene_holds_what_was_built_where_it_was_put():
    made = co.build_scene(co.ball("rubber", 0.1), co.ball("steel", 0.1, at=(1, 0, 0.5)))
    assert [thing.name for thing in made.objects] == ["ball", "ball_1"]
    assert made.objects[0].real_extent == pytest.approx(0.2, rel=0.01)
    assert np.allclose(made.surfaces[1].vertices.mean(axis=0), (1, 0, 0.5))
    assert made.warnings == ()


def test_bodies_that_stand_in_each_other_are_reported():
    made = co.build_scene(co.ball("rubber", 0.1), co.ball("steel", 0.1, at=(0.1, 0, 0.1)))
    assert made.warnings == ("ball and ball_1 overlap at the start.",)


MISTAKES = {
    "unknown material": (lambda: co.ball("rubbr", 0.1), "Unknown material 'rubbr'. Choose one of"),
    "negative radius": (lambda: co.ball("rubber", -1), "The radius of ball is -1. Give a positive"),
    "no radius": (lambda: co.cylinder("sand", float("nan"), 1), "The radius of cylinder is nan"),
    "flat box": (lambda: co.box("wood", (1, 1, 0)), "The height of box is 0.0"),
    "two sides": (lambda: co.box("wood", (1, 1)), "Give three finite numbers"),
    "endless speed": (lambda: co.ball("rubber", 0.1, velocity=(0, 0, float("inf"))), "velocity of ball is"),
    "open mesh": (lambda: co.solid("wood", CUBE, np.array([[0, 1, 2]])), "solid is not closed"),
    "nothing": (lambda: co.build_scene(), "at least one solid"),
    "in the floor": (
        lambda: co.build_scene(co.ball("rubber", 0.1, at=(0, 0, 0))),
        "ball reaches 0.1 m below the floor",
    ),
    "no time": (lambda: co.build_scene(co.ball("rubber", 0.1), duration=0), "The duration of scene is 0"),
    "no file": (lambda: co.load_scene("absent.glb"), "No such file: absent.glb. Check the path."),
}


@pytest.mark.parametrize(("mistake", "words"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_says_what_is_wrong_and_what_to_do(mistake, words):
    with pytest.raises(co.UserError) as told:
        mistake()
    assert words in str(told.value)


def test_a_splat_is_not_loaded_but_reconstructed(tmp_path):
    (tmp_path / "scene.ply").write_bytes(b"ply")
    with pytest.raises(co.UserError, match="must be reconstructed first"):
        co.load_scene(tmp_path / "scene.ply")


def test_an_unknown_engine_is_refused_with_the_menu():
    ready = co.prepare_scene(co.build_scene(co.ball("steel", 0.05)))
    with pytest.raises(co.UserError, match=r"Unknown engine 'gpu'\. Choose one of: .*reference"):
        co.build_engine(co.pose_problem(ready), "gpu")


def test_frames_without_a_folder_go_with_the_result():
    played = co.simulate_scene(co.build_scene(co.ball("steel", 0.05), duration=0.05, fps=20))
    folder = played.trajectory.folder
    assert len(played.trajectory.frames) == 2
    assert folder.exists()
    del played
    assert not folder.exists()


def test_a_scene_that_was_written_is_loaded_as_it_was(tmp_path):
    made = co.build_scene(co.ball("steel", 0.05, velocity=(1, 0, 0)), co.box("wood", (1, 1, 1), (2, 0, 0.5)))
    co.write_glb(tmp_path / "two.glb", made)
    again = co.load_scene(tmp_path / "two.glb")
    assert [o.velocity for o in again.objects] == [o.velocity for o in made.objects]
    assert np.allclose(again.surfaces[1].vertices.max(axis=0), (2.5, 0.5, 1.0), atol=1e-5)
