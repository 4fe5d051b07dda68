"""A new format is one file with a reader and one row of the registry."""

import os
import re
import struct

import numpy as np
import pytest

import corporeal as co
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.registry import load_function
from corporeal.io import registry
from corporeal.io.input_files import input_kind, list_input_files
from corporeal.io.registry import READERS, Reader, reader_of, suffixes_of
from corporeal.io.splat.load_splat import load_splat

MESH_READER = '''
"""Toy: a line "x y z" for each vertex, four of them: a tetrahedron, +Z up, in centimetres."""

from pathlib import Path

import numpy as np

from corporeal.core.types import Finish, Surface
from corporeal.io.mesh.raw_mesh import NODE_NAMES_KEY, RawMesh

FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def read_toy(path: Path) -> RawMesh:
    corners = np.loadtxt(path, ndmin=2)
    extras = {NODE_NAMES_KEY: ["wedge"]}
    shape = Surface("wedge", 0, 0, vertices=corners, triangles=FACES, extras=extras)
    return RawMesh((shape,), (Finish("plain"),), unit=0.01)


def toy_companions(path: Path) -> list[Path]:
    return [path.with_suffix(".notes")]
'''
SPLAT_READER = '''
"""Toy: "TOYS", then the place of each Gaussian as three floats; all alike otherwise."""

from pathlib import Path

import numpy as np

from corporeal.core.types import Gaussians


def read_toy(path: Path, data: memoryview) -> Gaussians:
    mean = np.frombuffer(data, "<f4", offset=4).reshape(-1, 3)
    one = np.ones((len(mean), 1), np.float32)
    return Gaussians(
        mean=mean.copy(),
        rotation=one * np.float32((1, 0, 0, 0)),
        scale=one * np.float32((0.1, 0.1, 0.1)),
        opacity=one[:, 0],
        sh=one[:, None] * np.zeros((1, 3), np.float32),
    )
'''


def register(monkeypatch, folder, module, text, **row):
    """Write a module, and give the registry one row more, in the process that reads meshes, too."""
    (folder / f"{module}.py").write_text(text)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]))
    made = Reader(read=f"{module}:read_toy", **row)
    monkeypatch.setattr(registry, "READERS", (*READERS, made))


@pytest.fixture
def toy_mesh(tmp_path, monkeypatch):
    register(
        monkeypatch,
        tmp_path,
        "toy_mesh_reader",
        MESH_READER,
        name="Toy",
        kind="mesh",
        suffixes=(".toymesh",),
        usual_up="+z",
        companions="toy_mesh_reader:toy_companions",
    )
    path = tmp_path / "models" / "wooden_wedge.toymesh"
    path.parent.mkdir()
    path.write_text("0 0 0\n20 0 0\n0 10 0\n0 0 5\n")
    path.with_suffix(".notes").write_text("a wedge")
    return path


@pytest.fixture
def toy_splat(tmp_path, monkeypatch):
    register(
        monkeypatch,
        tmp_path,
        "toy_splat_reader",
        SPLAT_READER,
        name="Toy splat",
        kind="splat",
        suffixes=(".toysplat",),
        signatures=(b"TOYS",),
        usual_up="+z",
    )
    path = tmp_path / "garden.toysplat"
    path.write_bytes(b"TOYS" + struct.pack("<9f", *range(9)))
    return path


def test_a_mesh_format_is_one_file_and_one_row(toy_mesh):
    assert input_kind([toy_mesh]) == "model"
    for asked in (toy_mesh, toy_mesh.parent):
        scene = co.load_scene(asked)
        assert [thing.class_name for thing in scene.objects] == ["wooden wedge"]
        places = np.concatenate([s.vertices for s in scene.surfaces])
        np.testing.assert_allclose(np.ptp(places, axis=0), (0.2, 0.1, 0.05), rtol=1e-6)
    assert list_input_files([toy_mesh]) == [toy_mesh, toy_mesh.with_suffix(".notes")]


def test_errors_of_the_command_line_list_the_mesh_format(toy_mesh, tmp_path, command):
    (tmp_path / "what.xyz").write_text("0 0 0")
    code, said = command("run", tmp_path / "what.xyz", "--out", tmp_path / "run")
    assert code != 0
    assert re.search(r"model\s\(\.glb, .*\.toymesh\s+are\s+read\)", said.err, re.DOTALL), said.err
    toy_mesh.write_text("no numbers")
    code, said = command("run", toy_mesh, "--out", tmp_path / "run")
    assert code != 0 and "cannot be read as TOYMESH" in " ".join(said.err.split())


def test_a_package_that_a_reader_needs_is_named(toy_mesh, monkeypatch):
    needy = Reader("Toy", "mesh", (".toymesh",), "a:b", packages=("no_such_module",), extra="toys")
    monkeypatch.setattr(registry, "READERS", (needy,))
    with pytest.raises(BadFileError, match=r"needs no_such_module.*'corporeal\[toys\]'"):
        co.load_scene(toy_mesh)


def test_a_splat_format_is_one_file_and_one_row(toy_splat, tmp_path):
    assert input_kind([toy_splat]) == "splat"
    assert list_input_files([toy_splat]) == [toy_splat]
    np.testing.assert_array_equal(load_splat(toy_splat).mean, np.arange(9).reshape(3, 3))
    renamed = toy_splat.rename(tmp_path / "photo.jpg")
    assert load_splat(renamed).count == 3, "the content decides"
    with pytest.raises(UserError, match="holds a splat, which must be reconstructed first"):
        co.load_scene(renamed.rename(toy_splat))


def test_errors_list_the_splat_format(toy_splat):
    toy_splat.write_bytes(bytes(range(256)) * 9)
    with pytest.raises(BadFileError, match=r"no Gaussian splat.*PLY.*\.splat and Toy splat are"):
        load_splat(toy_splat)


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: f"{reader.name}, {reader.kind}")
def test_every_row_names_functions_that_are_there(reader):
    for module in reader.packages:
        pytest.importorskip(module)
    for place in filter(None, (reader.read, reader.matches, reader.companions)):
        assert callable(load_function(place))
    assert all(suffix == suffix.lower() and suffix[0] == "." for suffix in reader.suffixes)


def test_what_shares_a_suffix_is_recognised_by_its_content(tmp_path):
    assert sorted(s for s in set(suffixes_of()) if suffixes_of().count(s) > 1) == [".ply"]
    path = tmp_path / "a.ply"
    mesh = "element face 1\nproperty list uchar int vertex_indices\n"
    for words, kind in (("element chunk 9\n", "splat"), (mesh, "mesh"), ("", None)):
        path.write_text(f"ply\nformat ascii 1.0\n{words}end_header\n")
        found = reader_of(path)
        assert (found and found.kind) == kind
