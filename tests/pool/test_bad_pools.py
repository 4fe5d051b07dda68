"""Whatever lies in a folder, every file gets in or gets a reason, and none ends the work."""

import json
import os
import random

import numpy as np
import pytest

from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.pool import quality_gate
from corporeal.pool.pool_index import IndexConfig, OriginConfig, index_pool
from glb_maker import CUBE, CUBE_TRIANGLES
from pool_models import ball, checks, glb, plain_ball


def put(folder, **files):
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (folder / f"{name}.glb").write_bytes(data)
    return folder


def reasons(pool):
    return {r.source.rsplit("/", 1)[1].removesuffix(".glb"): r.reason for r in pool.rejections}


def with_json(data, change):
    """Change what stands in the JSON of a GLB, by text of the same length."""
    before, after = change
    assert before in data and len(before) == len(after)
    return data.replace(before, after, 1)


def hostile(kind, whole, rng):
    """One way or another to break a file."""
    if kind == 0:
        return whole[: rng.randrange(len(whole))]
    if kind == 1:
        return bytes(rng.randrange(256) for _ in range(2000))
    if kind == 2:
        return with_json(whole, (b'"count":', b'"cnt__":'))
    if kind == 3:
        at = whole.index(b'"count": ') + 9
        return whole[:at] + b"9" + whole[at + 1 :]
    if kind == 4:
        return with_json(whole, (b"5125", b"5999"))
    return b""


@pytest.mark.slow
def test_a_third_of_the_files_is_broken_and_the_rest_comes_out(tmp_path):
    rng = random.Random(0)
    for k in range(70):
        put(tmp_path / "in", **{f"good{k}": plain_ball(0.05 + 0.001 * k)})
    for k in range(30):
        put(tmp_path / "in", **{f"bad{k}": hostile(k % 6, plain_ball(0.2 + 0.001 * k), rng)})
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert {a.name for a in pool.assets} == {f"good{k}" for k in range(70)}
    said = reasons(pool)
    assert set(said) == {f"bad{k}" for k in range(30)}
    for name, reason in said.items():
        assert len(reason) > 10 and "internal error" not in reason, (name, reason)
        assert str(tmp_path) not in reason, "the file is named beside the reason"


def test_any_single_byte_may_be_wrong(tmp_path):
    rng = random.Random(1)
    whole = plain_ball(rings=10)
    for k in range(80):
        data = bytearray(whole)
        data[rng.randrange(len(data))] = rng.randrange(256)
        put(tmp_path / "in", **{f"x{k}": bytes(data)})
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert len(pool.assets) + len(pool.rejections) == 80
    assert not [r for r in pool.rejections if "internal error" in r.reason]


def test_real_hostile_files_get_a_reason_or_get_in(shared_assets, tmp_path):
    folder = shared_assets / "hostile" / "gltf_validator"
    pool = index_pool([folder], tmp_path / "pool")
    assert len(pool.rejections) > 100
    assert not [r for r in pool.rejections if "internal error" in r.reason or not r.reason]


def test_the_same_mesh_comes_in_once_unless_both_class_and_look_differ(tmp_path):
    vertices, triangles, uv = ball()
    plain, dressed = glb(vertices, triangles), glb(vertices, triangles, uv, checks(512, 512))
    put(tmp_path / "in" / "rubber ball", a=plain, b=dressed, c=glb(vertices * 1.01, triangles))
    put(tmp_path / "in" / "steel ball", d=plain + b"\0\0\0\0", e=dressed)
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert [a.name for a in pool.assets] == ["rubber_ball_a", "rubber_ball_c", "steel_ball_e"]
    assert reasons(pool) == dict.fromkeys("bd", "has the same mesh as rubber_ball_a")
    put(tmp_path / "more" / "steel ball", f=plain)
    pool = index_pool([tmp_path / "more"], tmp_path / "pool")
    assert reasons(pool)["f"] == "has the same mesh as steel_ball_e", "what came earlier counts too"


def test_hostile_words_do_not_harm_the_index(tmp_path):
    put(tmp_path / "in", a=plain_ball(copyright="x\ud800\u0000y", extras={"license": "\udfff"}))
    (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
    assert (asset.attribution, asset.licence) == ("x? y", "?")


def test_a_file_whose_name_is_no_text_gets_a_reason(tmp_path):
    put(tmp_path / "in", good=plain_ball())
    try:
        (tmp_path / "in" / os.fsdecode(b"caf\xe9.glb")).write_bytes(plain_ball(0.2))
    except OSError:
        pytest.skip("this file system has names in UTF-8 only")
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert [a.name for a in pool.assets] == ["good"]
    assert reasons(pool) == {"caf?": "its path is not plain text in UTF-8: rename it"}


def test_a_pool_of_one_class_is_a_pool(tmp_path):
    put(tmp_path / "in" / "ball", a=plain_ball(0.1), b=plain_ball(0.11), c=plain_ball(0.12))
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert list(pool.classes) == ["ball"] and len(pool.classes["ball"]) == 3


def test_when_nothing_is_good_the_pool_is_empty_and_says_why(tmp_path):
    put(tmp_path / "in", a=b"", b=b"{}")
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert pool.assets == () and set(reasons(pool)) == {"a", "b"}


def test_what_is_stated_to_be_in_metres_and_is_a_kilometre_large_stays_outside(tmp_path):
    put(tmp_path / "in", chair=plain_ball(500), thing=plain_ball(501), sofa=plain_ball(502))
    table = tmp_path / "said.csv"
    rows = "in/chair.glb,chair,yes\nin/thing.glb,gizmo,yes\nin/sofa.glb,sofa,no\n"
    table.write_text(f"file,class,metric\n{rows}")
    pool = index_pool([tmp_path / "in"], tmp_path / "pool", IndexConfig(OriginConfig(csv=table)))
    assert [a.name for a in pool.assets] == ["sofa"], "of which only the shape counts"
    assert not pool.assets[0].metric
    said = reasons(pool)
    assert "1e+03 m large; a chair is usually 0.9 m" in said["chair"]
    assert "metric = no" in said["chair"] and "1e+03 m large" in said["thing"]


@pytest.mark.parametrize(("size", "said"), [(1e-9, "units large"), (1e7, "units large"), (1e9, "impossible places")])
def test_sizes_that_single_precision_cannot_place_stay_outside(tmp_path, size, said):
    put(tmp_path / "in", x=plain_ball(size))
    assert said in reasons(index_pool([tmp_path / "in"], tmp_path / "pool"))["x"]


def test_numbers_that_are_none_are_named(tmp_path):
    vertices, triangles, _ = ball()
    vertices[100] = np.nan
    put(tmp_path / "in", x=glb(vertices, triangles))
    assert "(nan, nan, nan)" in reasons(index_pool([tmp_path / "in"], tmp_path / "pool"))["x"]


def soup(count, size, rng):
    """Triangles anywhere, none of which shares an edge with another."""
    corners = rng.random((count, 1, 3)) + size * (rng.random((count, 3, 3)) - 0.5)
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def test_a_soup_of_crumbs_stays_outside(tmp_path):
    put(tmp_path / "in", soup=glb(*soup(2000, 0.02, np.random.default_rng(0))))
    assert "crumbs" in reasons(index_pool([tmp_path / "in"], tmp_path / "pool"))["soup"]


def test_a_non_manifold_tangle_is_measured_like_any_other(tmp_path):
    """Every triangle shares its corners with dozens; open edges are recorded, never refused."""
    rng = np.random.default_rng(0)
    tangle = rng.integers(0, 60, (800, 3))
    put(tmp_path / "in", tangle=glb(rng.random((60, 3)), tangle))
    (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
    assert 0 < asset.open_edges < 1


@pytest.mark.parametrize(("gap", "things"), [(0.1, 2), (0.01, 1), (0.0, 1)])
def test_what_stands_apart_is_several_objects(tmp_path, gap, things):
    """Two balls with a gap between them, over their common extent; touching, they are one toy."""
    vertices, triangles, _ = ball(12)
    shift = 2 * 0.1 * (1 + gap / (1 - gap))
    both = np.concatenate([vertices, vertices + np.array([shift, 0, 0])])
    put(tmp_path / "in", pair=glb(both, np.concatenate([triangles, triangles + len(vertices)])))
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert len(pool.assets) == (things == 1)
    if things == 2:
        assert "holds 2 objects that stand apart; the largest has 50% of" in reasons(pool)["pair"]


def test_open_edges_are_counted(tmp_path):
    vertices, triangles, _ = ball(10)
    upper = (vertices[triangles, 2] > -1e-9).all(axis=1)
    put(tmp_path / "in", half=glb(vertices, triangles[upper]))
    (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
    edges = (3 * asset.triangles + 20) / 2  # the rim has 20 edges, of one triangle each
    assert asset.open_edges == pytest.approx(20 / edges, abs=1e-6)


def test_a_placeholder_is_distinguished_from_a_simple_object_by_its_picture(tmp_path):
    spread = np.stack([CUBE[:, 0], CUBE[:, 1]], 1)
    put(
        tmp_path / "in",
        box=glb(CUBE, CUBE_TRIANGLES, spread, checks(512, 512)),
        cube=glb(2 * CUBE, CUBE_TRIANGLES),
        sheet=glb(3 * CUBE, CUBE_TRIANGLES[:2], spread, checks(512, 512)),
    )
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert [a.name for a in pool.assets] == ["box"]
    assert reasons(pool)["cube"] == "has 12 triangles and no picture: a placeholder (at least 100)"
    assert reasons(pool)["sheet"] == "has 2 triangles: a placeholder (at least 12)"


def test_a_coarse_picture_stays_outside_unless_it_repeats_or_is_a_palette(tmp_path):
    size = iter((0.1, 0.11, 0.12, 0.13))

    def dressed(picture, repeat=1.0):
        vertices, triangles, uv = ball(radius=next(size))
        return glb(vertices, triangles, uv * repeat, picture)

    coarse = checks(128, 128)
    put(
        tmp_path / "in",
        coarse=dressed(coarse),
        tiled=dressed(coarse, 5),
        palette=dressed(coarse // 64 * 64),
        dots=dressed(coarse, 0.0),
    )
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert sorted(a.name for a in pool.assets) == ["dots", "palette", "tiled"]
    assert reasons(pool)["coarse"].startswith("its finest base-colour picture is 128 px across")
    assert pool.asset("tiled").texture == pytest.approx(640, rel=0.05)


def degenerate(share):
    """A ball, and as many triangles as make that share, each with its corners on one line."""
    vertices, triangles, _ = ball()
    count = round(len(triangles) * share / (1 - share))
    needles = np.linspace(-0.05, 0.05, 3 * count)[:, None] * [[1.0, 0, 0]]
    flat = len(vertices) + np.arange(3 * count).reshape(-1, 3)
    return np.concatenate([vertices, needles]), np.concatenate([triangles, flat])


@pytest.mark.parametrize(("share", "copied"), [(0.005, False), (0.05, True), (0.4, True)])
def test_triangles_without_area_are_cleaned_away(tmp_path, share, copied):
    put(tmp_path / "in", x=glb(*degenerate(share)))
    (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
    assert asset.file.is_relative_to(tmp_path / "pool") is copied
    (left,) = read_glb(asset.file).surfaces
    assert (len(left.triangles) == len(ball()[1])) is copied


def test_what_is_mostly_degenerate_stays_outside(tmp_path):
    put(tmp_path / "in", x=glb(*degenerate(0.6)))
    said = reasons(index_pool([tmp_path / "in"], tmp_path / "pool"))["x"]
    assert said == "60% of its triangles have no area"


def test_a_mistake_of_ours_ends_one_file_only(tmp_path, monkeypatch):
    put(tmp_path / "in", a=plain_ball(0.1), b=plain_ball(0.2))
    real = quality_gate.open_edge_fraction
    calls = []

    def once(mesh):
        calls.append(mesh)
        return real(mesh) if len(calls) > 1 else 1 / 0

    monkeypatch.setattr(quality_gate, "open_edge_fraction", once)
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert [a.name for a in pool.assets] == ["b"]
    assert "internal error (ZeroDivisionError" in reasons(pool)["a"]


def test_too_many_triangles_to_decimate_are_refused_at_once(tmp_path):
    put(tmp_path, x=plain_ball())
    scene = read_glb(tmp_path / "x.glb")
    with pytest.raises(quality_gate.ModelRejectedError) as refused:
        quality_gate.inspect_model(scene, max_read_triangles=2000)
    assert str(refused.value) == "has 2,208 triangles; at most 2,000 are decimated"


@pytest.mark.slow
def test_a_million_triangles_become_two_hundred_thousand(tmp_path):
    vertices, triangles, uv = ball(502, 0.1, bumps=0.05)
    assert len(triangles) > 1_000_000
    put(tmp_path / "in", big=glb(vertices, triangles, uv, checks(1024, 512)))
    (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
    assert 150_000 < asset.triangles <= 200_000
    (surface,) = read_glb(asset.file).surfaces
    assert len(surface.triangles) == asset.triangles
    assert asset.open_edges == 0.0


def test_every_rejection_is_in_the_index_with_its_class(tmp_path):
    put(tmp_path / "in" / "lamp", broken=b"glTF", tiny=glb(CUBE, CUBE_TRIANGLES))
    index_pool([tmp_path / "in"], tmp_path / "pool")
    kept = json.loads((tmp_path / "pool" / "pool.json").read_text())["rejections"]
    assert [r["class_name"] for r in kept] == ["lamp", "lamp"]
    assert all(r["reason"] for r in kept)
