"""Real objects of several parts described by what somebody answered who looked at them."""

import pytest

from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from corporeal.recognition.metadata_recognition import substance_hint
from corporeal.recognition.parts_by_name import identify_parts
from recorded_scenes import check_answered, check_chosen, grounded, rows

NAMES = (
    "armchair_kaolin",
    "plant_potted_market",
    "lamp_barn_khronos",
    "flight_helmet_khronos",
    "drill_gazebo",
    "hammer_gazebo",
    "water_bottle_khronos",
    "guitar_market",
    "tea_set_polyhaven",
    "cabinet_polyhaven",
)


@pytest.fixture(scope="module")
def described(shared_assets):
    """Name → (scene, inventory, field)."""
    whole = AssembleConfig(objects="one")  # as they were when the questions were answered
    made = {n: assemble([shared_assets / "objects" / f"{n}.glb"], whole) for n in NAMES}
    return {name: (scene, *grounded(scene, "real")) for name, scene in made.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_real_object_is_grounded_from_recordings_and_every_number_says_why(described, name):
    scene, inventory, field = described[name]
    check_answered(scene, inventory)
    check_chosen(scene, field, identify_parts(scene, substance_hint).catalogue, "real")


def test_every_recording_is_of_one_of_these_objects():
    assert {row["scene"].partition("/")[0] for row in rows("real")} == set(NAMES)


def test_no_recording_of_a_real_object_is_left_over(described):
    asked = [row for _, inventory, _ in described.values() for row in inventory.transcript]
    assert len(asked) == len(rows("real"))


def test_one_mesh_of_several_materials_keeps_its_pieces_and_their_shares(described):
    (drill,) = described["drill_gazebo"][2].pieces
    assert {p.words.name: p.material.name for p in drill} == {
        "body": "glass_filled_nylon",
        "battery": "battery_cell",
        "chuck": "steel",
        "side handle": "glass_filled_nylon",
    }
    (bottle,) = described["water_bottle_khronos"][2].pieces
    assert [(p.words.name, p.words.volume_share) for p in bottle] == [
        ("bottle", pytest.approx(0.82)),
        ("cap", pytest.approx(0.08)),
        ("holder", pytest.approx(0.10)),
    ]


def test_a_size_in_the_wrong_unit_is_reported(described):
    (said,) = described["armchair_kaolin"][1].warnings
    assert "--extent armchair_0=0.9" in said
