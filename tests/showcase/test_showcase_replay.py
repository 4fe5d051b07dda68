"""The ten scenes described by what somebody answered who looked at their pictures."""

from functools import partial

import pytest

from corporeal.pipeline.run_pipeline import write_showcase
from corporeal.pipeline.stages.assemble import assemble
from corporeal.recognition.metadata_recognition import substance_hint
from corporeal.recognition.parts_by_name import identify_parts
from corporeal.showcase import showcase_scenes
from recorded_scenes import FOLDER, check_answered, check_chosen, grounded, rows

MACHINE = ("/work", "/tmp", "/home", "/Users", "C:\\")


@pytest.fixture(scope="module")
def written(models, tmp_path_factory):
    """Every scene as its own GLB says it: name → scene."""
    folder = tmp_path_factory.mktemp("showcase")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(showcase_scenes, "PROP_BUILDERS", {name: partial(models.get, name) for name in models})
        return {name: assemble([write_showcase(name, folder)]) for name in showcase_scenes.SHOWCASE_SCENE_BUILDERS}


@pytest.fixture(scope="module")
def described(written):
    """Name → (scene, inventory, field), with nobody to take a picture."""

    def refused(*args):
        raise AssertionError("a replay takes no pictures")

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("corporeal.description.query_scene.render_portraits", refused)
        return {name: (s, *grounded(s, "showcase")) for name, s in written.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(showcase_scenes.SHOWCASE_SCENE_BUILDERS))
def test_every_question_is_answered_from_recordings(described, name):
    scene, inventory, _ = described[name]
    check_answered(scene, inventory)


@pytest.mark.parametrize("name", list(showcase_scenes.SHOWCASE_SCENE_BUILDERS))
def test_what_was_answered_is_what_is_simulated_and_every_number_says_why(described, name):
    scene, _, field = described[name]
    check_chosen(scene, field, identify_parts(scene, substance_hint).catalogue, "showcase")


def test_no_recording_is_left_over(described):
    asked = [row for _, inventory, _ in described.values() for row in inventory.transcript]
    assert len(asked) == len(rows("showcase"))


@pytest.mark.parametrize("folder", ["showcase", "real"])
def test_recordings_say_who_answered_and_nothing_of_a_machine(folder):
    for path in FOLDER.glob(f"{folder}/*"):
        assert path.suffix == ".json"
        text = path.read_text(encoding="utf-8")
        assert not [word for word in MACHINE if word in text], path.name
    said = rows(folder)
    assert said
    assert {row["model"] for row in said} == {"by hand, from the sheets"}
