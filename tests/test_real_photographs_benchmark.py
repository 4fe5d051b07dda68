"""The table of real photographs: what is measured of a set whose truth is known, and what fails."""

import json
import re
import tomllib

import numpy as np
import pytest
import real_measures as measure
import real_photographs as benchmark
import trimesh
from colmap_writer import write_colmap
from PIL import Image

from corporeal.core.types import Camera
from corporeal.geometry.mesh import Mesh
from corporeal.io.photos.colmap import read_colmap
from corporeal.multiview.similarity_transform import apply_similarity_to_cameras, similarity_matrix
from corporeal.reconstruction.gaussians import training_schedule
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from patterned_scene import OF_SLAB, patterned, photographs, ring

COUNT = 16
FACTS = measure.Known(unit=0.5, floor=True, sides=(0.1, 0.12, 0.08), height=0.12)


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    """A set of a block whose poses are turned and twice as large; one whose poses are broken."""
    folder = tmp_path_factory.mktemp("sets")
    good, bad = folder / "block", folder / "broken"
    aims = ring(np.arange(COUNT) * 360 / COUNT, (160, 120), height=0.25, away=0.35)
    cameras = photographs(good / "images", aims)
    stage = RayScene(patterned())
    for name in ("masks", "sparse/0"):
        (good / name).mkdir(parents=True)
    for k, aim in enumerate(aims):
        mask = np.uint8(255) * (identify_triangles(stage, aim)[0] >= OF_SLAB)
        Image.fromarray(mask).save(good / "masks" / f"photo_{k:03d}.png")
    rng = np.random.default_rng(0)
    slab = np.concatenate([rng.uniform(-0.2, 0.2, (400, 2)), np.zeros((400, 1))], axis=1)
    turn = similarity_matrix(np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]]), 2.0, (1.0, 2.0, 3.0))
    names = tuple(f"photo_{k:03d}.jpg" for k in range(COUNT))
    seen = slab @ turn[:3, :3].T + turn[:3, 3], np.full((400, 3), 90, np.uint8)
    write_colmap(good / "sparse" / "0", apply_similarity_to_cameras(cameras, turn), names, *seen)
    for name in ("images", "sparse/0"):
        (bad / name).mkdir(parents=True)
    (bad / "sparse" / "0" / "cameras.txt").write_text("nothing\n")
    (bad / "sparse" / "0" / "images.txt").write_text("nothing\n")
    return folder


@pytest.mark.slow
def test_a_row_measures_what_is_known_and_is_kept(sets, tmp_path, monkeypatch):
    small = training_schedule.TrainingPreset(3000, 1, 120, 160)
    monkeypatch.setitem(training_schedule.TRAINING_PRESETS, "preview", small)
    monkeypatch.setattr(measure, "known", lambda folder: FACTS)
    row = benchmark.row_of(sets / "block", "all", "preview", tmp_path)
    assert "why" not in row, row
    assert row["registered"] == COUNT and row["watertight"] and row["objects"] == 1
    assert row["iou"] > 0.7 and row["up_off_deg"] < 5, row
    assert abs(row["size_off"]) < 0.2 and row["psnr_thing"] > 12, row
    monkeypatch.setattr(benchmark, "reconstruct", None)
    again = benchmark.row_of(sets / "block", "all", "preview", tmp_path)
    assert again == json.loads(json.dumps(row)), "kept"
    shown = benchmark.cells(row, COUNT)
    assert len(shown) == len(benchmark.HEADS) and shown[3] == "16/16" and shown[-1] == ""


def test_a_set_that_fails_is_a_row_that_says_why(sets, tmp_path):
    row = benchmark.row_of(sets / "broken", "all", "preview", tmp_path)
    assert "sparse/0" in row["why"] or "images" in row["why"]
    shown = benchmark.cells(row, 0)
    assert shown[-1] == row["why"] and shown[3] == "–"


def test_errors_of_poses_do_not_see_a_similarity_but_a_wrong_camera(sets, tmp_path):
    given = read_colmap(sets / "block" / "sparse" / "0")
    cameras = [given.lens(i) for i in given.images]
    poses = [i.world_from_camera.copy() for i in given.images]
    poses[3][:3, 3] += 0.5
    way = similarity_matrix(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), 0.3, (4.0, 5.0, 6.0))
    made = [Camera(s.K, w, s.width, s.height) for s, w in zip(cameras, poses, strict=True)]
    write_colmap(tmp_path, apply_similarity_to_cameras(made, way), tuple(i.name for i in given.images))
    found = measure.pose_errors(read_colmap(tmp_path), given)
    assert found.registered == COUNT and found.right == COUNT - 1
    assert found.angle < 1e-3 and found.place < 1e-4
    np.testing.assert_allclose(found.given_from_found @ way, np.eye(4), atol=1e-3)


def test_a_size_is_compared_with_both_yardsticks():
    vertices = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], float)
    mesh = Mesh(vertices, trimesh.convex.convex_hull(vertices).faces)
    came = measure.Came((mesh,), np.array([0, 0, 1.0]), (mesh,))
    facts = measure.Known(unit=0.1, sides=(0.1, 0.19, 0.3), all_sides=(0.101, 0.2, 0.3))
    row = measure.sizes(came, facts)
    assert row["size_off"] == pytest.approx(0.2 / 0.19 - 1)
    assert row["size_off_all"] == pytest.approx(0.1 / 0.101 - 1)
    assert row["volume_m3"] == pytest.approx(0.006)
    row |= {"set": "box", "case": "all", "training": "draft", "seconds": 0.0}
    assert "+5.3%, -1.0%" in benchmark.cells(row, 0)


def test_sides_are_of_all_objects_together_and_volume_is_of_the_largest():
    box = trimesh.creation.box((1, 1, 1))
    things = tuple(
        Mesh(np.array(box.vertices) * size + [x, 0, size / 2], np.array(box.faces)) for size, x in ((1.0, 0), (0.5, 2))
    )
    came = measure.Came(things, np.array([0, 0, 1.0]), things)
    row = measure.sizes(came, measure.Known(unit=0.1, sides=(0.275, 0.1, 0.1)))
    assert row["size_off"] == pytest.approx(0) and row["volume_m3"] == pytest.approx(0.001)


def test_the_floor_is_the_plane_with_most_points(sets):
    given = read_colmap(sets / "block" / "sparse" / "0")
    normal = measure.floor_normal(given, np.random.default_rng(0))
    np.testing.assert_allclose(normal, (0, -1, 0), atol=1e-6)


PAGE = r"- \*(?P<set>[^*]+)\*(?: at (?P<training>\w+))?: (?P<said>.*)"


def read_page(kind):
    """Return rows, lines of the table, and notes of sets that make a page, as the page has them."""
    lines = benchmark.page_of(kind).read_text(encoding="utf-8").splitlines()
    table = [tuple(line[2:-2].split(" | ")) for line in lines if line.startswith("| ")][1:]
    listed = [match.groupdict() for line in lines if (match := re.fullmatch(PAGE, line))]
    rows = [
        {"set": m["set"], "case": "bare", "training": m["training"], "warnings": [m["said"]]}
        for m in listed
        if m["training"]
    ]
    return rows, table, {m["set"]: m["said"] for m in listed if not m["training"]}


@pytest.mark.parametrize("kind", benchmark.TITLES)
def test_writing_a_page_again_gives_the_page(kind, tmp_path, monkeypatch):
    """What had been added to its head by hand was lost by that."""
    rows, table, told = read_page(kind)
    more = tomllib.loads(benchmark.NOTES.read_text(encoding="utf-8")).get(kind, {}).get("sets", {})
    assert more.keys() <= told.keys(), "each note has its set on the page"
    own = {name: note.removesuffix(f". {more.get(name)}") for name, note in told.items()}
    known = lambda folder: measure.Known(note=own.get(folder.name, ""))  # noqa: E731
    monkeypatch.setattr(measure, "known", known)
    page = benchmark.page_of(kind)
    monkeypatch.setattr(benchmark, "DOCS", tmp_path)
    said = re.search("Written by `(.*?)`", page.read_text(encoding="utf-8"))
    names = dict.fromkeys(row[0] for row in table)
    benchmark.write_docs(rows, table, [tmp_path / name for name in names], kind, said[1])
    assert (tmp_path / page.name).read_text("utf-8") == page.read_text("utf-8")


@pytest.mark.parametrize(
    ("note", "more", "both"),
    [("A pot.", "It is new.", "A pot. It is new."), ("--wall", "Half.", "--wall. Half."),
     ("", "Half.", "Half."), ("A pot.", "", "A pot."), ("", "", "")],
)  # fmt: skip
def test_what_is_reported_beside_follows_what_is_known(note, more, both):
    assert benchmark.with_more(note, more) == both
