from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from corporeal.core.errors import BadFileError, UserError
from corporeal.geometry.box_placement import overlapping_boxes
from corporeal.geometry.scene_transforms import move_scene, object_boxes
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from glb_maker import Maker, cube

pytestmark = pytest.mark.usefixtures("mesh_reader_in_process")


@pytest.fixture
def models(tmp_path):
    """A duck of 10 cm, a can of 12 cm, a ball of 20 cm; all are cubes that hang somewhere."""
    sizes = {"duck": 0.1, "soda_can": 0.12, "ball": 0.2}
    return [cube(scale=[x] * 3, translation=[7, 3, -2]).save(tmp_path / f"{name}.glb") for name, x in sizes.items()]


def toml(folder, text):
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_a_single_object_is_put_on_the_floor(models):
    scene = assemble(models[:1])
    assert np.allclose(object_boxes(scene), [[[-0.05, -0.05, 0], [0.05, 0.05, 0.1]]])
    assert scene.objects[0].real_extent == pytest.approx(0.1)
    assert scene.warnings == ()


def test_several_files_stand_side_by_side_apart(models):
    scene = assemble(models)
    boxes = object_boxes(scene)
    assert [o.name for o in scene.objects] == ["duck_0", "soda_can_0", "ball_0"]
    assert np.allclose(boxes[:, 0, 2], 0)
    assert overlapping_boxes(boxes) == []
    assert (boxes[1:, 0, 0] - boxes[:-1, 1, 0] < 0.1).all()


def test_files_are_stacked_in_the_order_given(models):
    boxes = object_boxes(assemble(models, AssembleConfig(stack=True)))
    assert boxes[0, 0, 2] == 0
    gaps = boxes[1:, 0, 2] - boxes[:-1, 1, 2]
    assert (gaps > 0).all() and (gaps < 0.01).all()
    assert np.allclose(boxes.mean(axis=1)[:, :2], 0)


def test_drop_lifts_by_a_part_of_the_size(models):
    scene = assemble(models, AssembleConfig(drop=0.2))
    assert object_boxes(scene)[:, 0, 2] == pytest.approx([0.02, 0.024, 0.04])


def test_the_same_file_twice_is_two_objects(models):
    scene = assemble([models[0], models[0]])
    assert [o.name for o in scene.objects] == ["duck_0", "duck_1"]
    assert [s.object for s in scene.surfaces] == [0, 1]
    assert [s.finish for s in scene.surfaces] == [0, 1]


def test_a_folder_means_the_models_in_it(models):
    scene = assemble([models[0].parent])
    assert sorted(o.class_name for o in scene.objects) == ["ball", "duck", "soda can"]


@pytest.mark.parametrize("name", ["duck=0.5", "duck_0=0.5"])
def test_an_extent_gives_an_object_its_real_size(models, name):
    scene = assemble(models, AssembleConfig(extent=(name,)))
    sizes = np.diff(object_boxes(scene), axis=1).max(axis=(1, 2))
    assert sizes == pytest.approx([0.5, 0.12, 0.2])
    assert (scene.objects[0].real_extent, scene.objects[0].scale) == (0.5, 1.0)


def test_a_bare_extent_means_the_only_object(models):
    assert assemble(models[:1], AssembleConfig(extent=("0.3",))).objects[0].real_extent == 0.3
    with pytest.raises(UserError, match="NAME=METRES"):
        assemble(models, AssembleConfig(extent=("0.3",)))


@pytest.mark.parametrize("text", ["duck", "duck=", "duck=big", "duck=-1", "duck=nan", "=1", ""])
def test_an_extent_that_makes_no_sense_is_refused(models, text):
    with pytest.raises(UserError, match="NAME=METRES"):
        assemble(models, AssembleConfig(extent=(text,)))


def test_an_extent_for_an_unknown_object_lists_the_objects(models):
    with pytest.raises(UserError, match=r"no object 'cat'\. Choose one of: duck_0, soda_can_0"):
        assemble(models, AssembleConfig(extent=("cat=1",)))


def test_artist_units_are_doubted_and_a_size_proposed(tmp_path):
    path = cube(scale=[1.6] * 3).save(tmp_path / "duck.glb")
    (said,) = assemble([path]).warnings
    assert "--extent duck_0=0.1" in said
    assert assemble([path], AssembleConfig(extent=("duck=0.1",))).warnings == ()


def test_a_working_extent_scales_the_scene_but_not_the_real_objects(models):
    scene = assemble(models, AssembleConfig(working_extent=1.0))
    boxes = object_boxes(scene)
    assert (boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max() == pytest.approx(1)
    for thing, box in zip(scene.objects, boxes, strict=True):
        assert np.ptp(box, axis=0).max() == pytest.approx(thing.real_extent * thing.scale)
    assert scene.objects[0].real_extent == pytest.approx(0.1)


def test_a_scene_file_places_and_pushes_objects(models):
    text = """
    gravity = [0, 0, -1.62]
    duration = 1.25
    fps = 24
    [[object]]
    file = "duck.glb"
    name = "quack"
    position = [1, 2, 0.4]
    velocity = [0, 0, -2]
    extent = 0.3
    [[object]]
    file = "ball.glb"
    push = { acceleration = [3, 0, 0], to = 0.5 }
    """
    scene = assemble([toml(models[0].parent, text)])
    quack, ball = scene.objects
    assert (scene.gravity, scene.duration, scene.fps) == ((0, 0, -1.62), 1.25, 24)
    assert (quack.name, quack.velocity, quack.real_extent) == ("quack", (0, 0, -2), 0.3)
    assert ball.push is not None and ball.push.acceleration == (3, 0, 0)
    assert np.allclose(object_boxes(scene)[0], [[0.85, 1.85, 0.4], [1.15, 2.15, 0.7]])
    assert object_boxes(scene)[1, 0, 2] == 0
    assert overlapping_boxes(object_boxes(scene)) == []


def test_a_scene_file_can_speak_of_objects_within_its_file(tmp_path):
    room(tmp_path)
    text = """
    file = "room.glb"
    [[object]]
    name = "lamp_0"
    position = [0, 0, 2]
    velocity = [1, 0, 0]
    """
    chair, lamp = assemble([toml(tmp_path, text)]).objects
    assert (chair.velocity, lamp.velocity) == ((0, 0, 0), (1, 0, 0))
    boxes = object_boxes(assemble([tmp_path / "scene.toml"]))
    assert boxes[:, 0, 2] == pytest.approx([0, 2])
    with pytest.raises(BadFileError, match=r"no object 'sofa'\. Choose one of: chair_0, lamp_0"):
        assemble([toml(tmp_path, 'file = "room.glb"\n[[object]]\nname = "sofa"')])


def room(folder):
    made = Maker()
    mesh = made.mesh()
    made.node(name="chair_0", mesh=mesh, extras={"class": "chair"})
    made.node(name="lamp_0", mesh=mesh, translation=[0, 2, 0], extras={"class": "lamp"})
    return made.save(folder / "room.glb")


def test_several_objects_of_one_file_keep_their_places(tmp_path):
    scene = assemble([room(tmp_path)])
    assert object_boxes(scene)[:, 0, 2] == pytest.approx([0, 2])
    assert len(assemble([tmp_path / "room.glb"], AssembleConfig(objects="one")).objects) == 1


@pytest.mark.parametrize(("said", "meant"), [("", True), ("settled = false", False)])
def test_whether_objects_had_come_to_rest_is_stated_by_our_file_or_the_scene_file(models, tmp_path, said, meant):
    assert not assemble(models).settled
    assert not assemble([toml(tmp_path, 'file = "duck.glb"')]).settled
    (tmp_path / "ours").mkdir()
    write_glb(tmp_path / "ours" / "own.glb", replace(assemble(models), settled=True))
    assert assemble([tmp_path / "ours" / "own.glb"]).settled
    assert assemble([toml(tmp_path / "ours", f'file = "own.glb"\n{said}')]).settled is meant
    assert assemble([toml(tmp_path, 'file = "duck.glb"\nsettled = true')]).settled


def test_our_own_file_keeps_its_gravity_duration_and_height(models, tmp_path):
    scene = move_scene(assemble(models, AssembleConfig(duration=2.5, fps=25)), (0.0, 0.0, 1.0))
    (tmp_path / "ours").mkdir()
    write_glb(tmp_path / "ours" / "own.glb", scene)
    again = assemble([tmp_path / "ours" / "own.glb"])
    assert (again.duration, again.fps, again.gravity) == (2.5, 25, scene.gravity)
    assert np.allclose(object_boxes(again), object_boxes(scene), atol=1e-6)
    assert assemble([tmp_path / "ours" / "own.glb"], AssembleConfig(duration=1.5)).duration == 1.5


@pytest.mark.parametrize(("drop", "seconds"), [(0.0, 1.0), (10.0, 2.4), (100.0, 3.0)])
def test_the_time_watched_follows_from_the_fall(models, drop, seconds):
    assert assemble(models[:1], AssembleConfig(drop=drop)).duration == pytest.approx(seconds)


def test_objects_that_stand_in_each_other_are_reported(models):
    text = """
    [[object]]
    file = "duck.glb"
    position = [0, 0, 0]
    [[object]]
    file = "ball.glb"
    position = [0, 0, 0.05]
    """
    scene = assemble([toml(models[0].parent, text)])
    assert scene.warnings == ("duck_0 and ball_0 overlap at the start.",)


@pytest.mark.parametrize(
    ("first", "second", "at", "told"),
    [
        ((1, 0.1, 0.1), (0.1, 1, 0.1), "[0, 0, 0]", True),
        ((0.1, 0.1, 0.1), (0.1, 0.1, 0.1), "[0.03, 0, 0.02]", True),
        ((0.1, 0.1, 0.1), (0.1, 0.1, 0.1), "[0.1, 0, 0]", False),
        ((0.3, 0.3, 0.1), (0.1, 0.1, 0.1), "[0, 0, 0.1]", False),
    ],
)
@pytest.mark.parametrize("everted", [False, True])
def test_bars_that_cross_overlap_though_neither_holds_a_vertex(tmp_path, first, second, at, told, everted):
    for name, size in (("one", first), ("other", second)):
        bar = trimesh.creation.box((size[0], size[2], size[1]))  # glTF's y is up
        if everted:
            bar.invert()
        bar.export(tmp_path / f"{name}.glb")
    text = f"""
    [[object]]
    file = "one.glb"
    position = [0, 0, 0]
    [[object]]
    file = "other.glb"
    position = {at}
    """
    scene = assemble([toml(tmp_path, text)])
    assert any("overlap at the start" in s for s in scene.warnings) == told


def test_inputs_that_are_no_models_are_refused(tmp_path, models):
    (tmp_path / "empty").mkdir()
    (tmp_path / "photos" / "images").mkdir(parents=True)
    (tmp_path / "photos" / "images" / "a.JPG").write_bytes(b"")
    (tmp_path / "mesh.obj").write_text("v 0 0 0")
    (tmp_path / "zero.glb").write_bytes(b"")
    for inputs, said in (
        ([], "No input"),
        ([tmp_path / "none.glb"], "no such file"),
        ([tmp_path / "none"], "no such file"),
        ([tmp_path / "empty"], "holds no model"),
        ([tmp_path / "photos"], "holds 1 pictures and no model"),
        ([tmp_path / "mesh.obj"], "OBJ|no triangles"),
        ([tmp_path / "zero.glb"], "0 bytes"),
        ([tmp_path / "none.toml"], "no such file"),
        ([models[0], toml(tmp_path, 'file = "duck.glb"')], "stands alone"),
    ):
        with pytest.raises(UserError, match=said):
            assemble([Path(p) for p in inputs])


@pytest.mark.parametrize(
    "config",
    [
        AssembleConfig(drop=-1.0),
        AssembleConfig(drop=float("nan")),
        AssembleConfig(working_extent=0.0),
        AssembleConfig(duration=1e9),
        AssembleConfig(fps=0),
    ],
)
def test_options_out_of_reason_are_refused(models, config):
    with pytest.raises(UserError, match="Give a number from"):
        assemble(models, config)


def test_real_objects_collide_with_nothing_at_the_start(shared_assets):
    files = [shared_assets / "objects" / f"{n}.glb" for n in ("vase_smallhouse", "ball_smallhouse", "soda_can_coke")]
    for stack in (False, True):
        scene = assemble(files, AssembleConfig(stack=stack, drop=0.2))
        assert overlapping_boxes(object_boxes(scene)) == []
        assert scene.warnings == ()
        assert [o.class_name for o in scene.objects] == ["vase", "ball", "soda can coke"]


def test_a_size_is_doubted_as_the_real_object_has_it_not_the_scene(tmp_path):
    """A file that states how large the real thing is may hold it at any scale."""
    stated = {"class": "duck", "real_extent_m": 0.1}
    scene = assemble([cube(scale=[1.6] * 3, extras=stated).save(tmp_path / "a.glb")])
    assert scene.warnings == ()
    assert scene.objects[0].scale == pytest.approx(16.0)
    wrong = stated | {"real_extent_m": 1.6}
    (said,) = assemble([cube(scale=[0.1] * 3, extras=wrong).save(tmp_path / "b.glb")]).warnings
    assert "is 1.6 m large, but a duck is usually about 10 cm" in said


def test_a_working_extent_moves_the_walls_with_the_objects(models):
    room = '[[object]]\nfile = "ball.glb"\n[[wall]]\npoint = [0.3, 0, 0.1]\nnormal = [-1, 0, 0]\n'
    path = toml(models[0].parent, room)
    scene = assemble([path], AssembleConfig(working_extent=1.0))
    assert scene.objects[0].scale == pytest.approx(5.0)
    assert scene.walls[0].point == pytest.approx((1.5, 0.0, 0.5))
    assert scene.walls[0].normal == (-1, 0, 0)


# ---------------------------------------------------------------- meshes that state no unit


def stl(path, extent):
    """A cube as STL, which knows no unit."""
    trimesh.creation.box([extent, extent / 2, extent / 3]).export(path)
    return path


@pytest.mark.parametrize(
    ("name", "size", "metres", "said"),
    [
        ("bracket.stl", 45.0, 0.045, "in millimetres"),
        ("bracket.stl", 2.0, 2.0, "in metres"),
        ("bracket.obj", 0.3, 0.3, "in metres"),
        ("chair.stl", 90.0, 0.9, "in centimetres"),
        ("chair.off", 900.0, 0.9, "in millimetres"),
        ("duck.obj", 2.0, 0.0508, "in inches"),
        ("hammer.stl", 13.0, 0.3302, "in inches"),  # of 13 cm it would be but nearly a hammer
        ("chair.obj", 3e6, 0.9, "the size that a chair usually is"),
    ],
)
def test_a_mesh_without_a_unit_is_as_large_as_such_objects_are(tmp_path, name, size, metres, said):
    scene = assemble([stl(tmp_path / name, size)])
    assert scene.objects[0].real_extent == pytest.approx(metres)
    assert np.ptp(object_boxes(scene)[0], axis=0).max() == pytest.approx(metres)
    told = [w for w in scene.warnings if "states no unit" in w]
    assert len(told) == 1 and said in told[0] and "--unit or --extent" in told[0]


def placed(folder, *things):
    """A scene file that places cubes by hand: name of the file and extent, in its unit."""
    rows = []
    for k, (name, extent) in enumerate(things):
        stl(folder / name, extent)
        rows.append(f'[[object]]\nfile = "{name}"\nposition = [{k}, 0, 0]\n')
    return toml(folder, "".join(rows))


def test_a_mesh_that_fits_no_unit_is_in_that_of_the_scene_file_s_other_meshes(tmp_path):
    """A brick of 5 cm, placed by hand beside others in metres, was made 22 cm large."""
    scene = assemble([placed(tmp_path, ("plank.ply", 0.6), ("pipe.ply", 0.2), ("brick.ply", 0.05))])
    assert [o.real_extent for o in scene.objects] == pytest.approx([0.6, 0.2, 0.05])
    both = "plank.ply and pipe.ply state no unit: they were read in metres"
    assert any(s.startswith(both) and "20 cm to 60 cm large" in s for s in scene.warnings)
    assert any("brick.ply" in s and "as the other meshes are" in s for s in scene.warnings)
    assert any("but a brick is usually about 22 cm" in s for s in scene.warnings)


def test_a_class_of_many_sizes_is_far_off_by_its_smallest_and_largest(tmp_path):
    """A steel ball of 1 cm beside dominoes was made as large as a ball usually is, 20 cm."""
    scene = assemble([placed(tmp_path, ("plank.ply", 0.6), ("steel_ball.ply", 0.01))])
    assert scene.objects[1].real_extent == pytest.approx(0.01)


def test_an_extent_in_the_scene_file_is_believed(tmp_path):
    """It was answered by "Set its size with --extent", as if nobody had."""
    stl(tmp_path / "steel_ball.ply", 0.01)
    row = '[[object]]\nfile = "steel_ball.ply"\nextent = 0.01\n'
    assert assemble([toml(tmp_path, row)]).warnings == ()


@pytest.mark.parametrize("others", [[], [("plank.ply", 0.6), ("pipe.ply", 200.0)]])
def test_it_gets_its_usual_size_where_the_others_say_nothing_or_disagree(tmp_path, others):
    scene = assemble([placed(tmp_path, *others, ("brick.ply", 0.05))])
    assert scene.objects[-1].real_extent == pytest.approx(0.22)


def test_many_files_without_a_unit_are_one_sentence(tmp_path):
    names = [(f"thing{letter}.ply", 0.1) for letter in "abcdef"]
    told = [s for s in assemble([placed(tmp_path, *names)]).warnings if "no unit" in s]
    assert len(told) == 1
    assert told[0].startswith("thinga.ply, thingb.ply, thingc.ply and 3 more state no unit")


def test_a_person_knows_the_unit_better(tmp_path):
    path = stl(tmp_path / "bracket.stl", 45.0)
    inches = assemble([path], AssembleConfig(unit="in"))
    assert inches.objects[0].real_extent == pytest.approx(45 * 0.0254)
    asked = assemble([path], AssembleConfig(extent=("0.3",)))
    assert asked.objects[0].real_extent == 0.3
    assert not any("states no unit" in w for w in (*inches.warnings, *asked.warnings))


def test_a_mesh_of_no_likely_size_asks_for_its_unit(tmp_path):
    with pytest.raises(BadFileError, match=r"3e\+06 units large\. Give --unit, or --extent"):
        assemble([stl(tmp_path / "bracket.obj", 3e6)])


def test_a_mesh_may_state_which_axis_is_up(tmp_path):
    path = stl(tmp_path / "bracket.stl", 60.0)
    heights = [np.ptp(object_boxes(assemble([path], up=up))[0], axis=0)[2] for up in (None, "+x", "-y")]
    assert heights == pytest.approx([0.02, 0.06, 0.03])


def test_gltf_states_its_axes_and_unit(models):
    for refused in ({"up": "+x"}, {"config": AssembleConfig(unit="mm")}):
        with pytest.raises(BadFileError, match="Leave --up and --unit out"):
            assemble(models[:1], **refused)


@pytest.mark.parametrize("kind", [".fbx", ".blend"])
def test_what_only_blender_reads_comes_with_the_command_that_converts_it(tmp_path, kind):
    (tmp_path / f"chair{kind}").write_bytes(b"x")
    with pytest.raises(BadFileError, match=r"Convert it: blender --background .*chair\.glb"):
        assemble([tmp_path / f"chair{kind}"])
