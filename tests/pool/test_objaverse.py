"""Objaverse, in a small copy of the package's cache that is made here; no network."""

import gzip
import json
import sys
import types
import urllib.error

import pytest

from corporeal.core.errors import UserError
from corporeal.pool import objaverse
from corporeal.pool.objaverse import WantedModels
from corporeal.pool.pool_index import IndexConfig, OriginConfig, index_pool
from pool_models import plain_ball

MUG, VASE, LOOSE, ABSENT = "8476c4170df2", "8ff7f1f24653", "c786b97d08b9", "139331da7445"
PATHS = {
    MUG: f"glbs/000-023/{MUG}.glb",
    VASE: f"glbs/000-023/{VASE}.glb",
    LOOSE: f"glbs/000-024/{LOOSE}.glb",
    ABSENT: f"glbs/000-024/{ABSENT}.glb",
}
LVIS = {"mug": [MUG, ABSENT], "vase": [VASE], "mouse_(computer_equipment)": []}


def zipped(path, value):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(json.dumps(value).encode()))


def annotation(uid, license, user):
    return {
        "uid": uid,
        "name": f"Nice thing {uid[:2]}",
        "license": license,
        "user": {"username": user.lower(), "displayName": user},
        "viewerUrl": f"https://sketchfab.com/3d-models/{uid}",
    }


@pytest.fixture
def cache(tmp_path):
    root = tmp_path / ".objaverse" / "hf-objaverse-v1"
    zipped(root / "object-paths.json.gz", PATHS)
    zipped(root / "lvis-annotations.json.gz", LVIS)
    notes = {MUG: annotation(MUG, "by", "Ada"), VASE: annotation(VASE, "by-nc-sa", "Bo")}
    zipped(root / "metadata" / "000-023.json.gz", notes)
    for k, uid in enumerate((MUG, VASE, LOOSE)):
        file = root / PATHS[uid]
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(plain_ball(1.0 + 0.1 * k))
    return root


def config(**wanted):
    return IndexConfig(OriginConfig("objaverse", wanted=WantedModels(**wanted)))


def test_what_lies_in_the_cache_becomes_assets_with_class_licence_and_maker(cache, tmp_path):
    pool = index_pool([cache], tmp_path / "pool", config())
    assert pool.rejections == ()
    mug, vase = pool.classes["mug"][0], pool.classes["vase"][0]
    assert mug.name == f"mug_{MUG[:8]}"
    assert (mug.licence, vase.licence) == ("CC-BY-4.0", "CC-BY-NC-SA-4.0")
    url = f"https://sketchfab.com/3d-models/{MUG}"
    assert mug.attribution == f"Nice thing 84 by Ada ({url})" and mug.source == url
    assert not mug.metric, "makers use any unit"
    assert mug.file == (cache / PATHS[MUG]).resolve()
    loose = pool.asset(f"objaverse_{LOOSE[:8]}")
    assert loose.licence == "unknown" and loose.source == f"objaverse:{LOOSE}"


def test_only_the_wanted_categories_are_indexed(cache, tmp_path):
    pool = index_pool([cache], tmp_path / "pool", config(classes=("vase",)))
    assert list(pool.classes) == ["vase"] and len(pool.assets) == 1


def test_categories_are_chosen_in_words(cache):
    assert objaverse.choose_models(LVIS, WantedModels(("Mug", "vase"), 1)) == [ABSENT, VASE]
    assert objaverse.choose_models(LVIS, WantedModels(("mouse (computer equipment)",))) == []
    with pytest.raises(UserError, match=r"'mouse'\. Did you mean: mouse \(computer equipment\)"):
        objaverse.choose_models(LVIS, WantedModels(("mouse",)))


def fake_package(monkeypatch, cache, calls, fail=False):
    """Stand in for the package, which downloads into the same cache."""

    def load_objects(uids):
        if fail:
            raise urllib.error.URLError("no route to host")
        calls.append(sorted(uids))
        (cache / PATHS[ABSENT]).write_bytes(plain_ball(2.0))

    module = types.ModuleType("objaverse")
    module.load_lvis_annotations = lambda: LVIS
    module.load_annotations = lambda uids: calls.append("annotations")
    module.load_objects = load_objects
    monkeypatch.setitem(sys.modules, "objaverse", module)
    monkeypatch.setattr(objaverse, "OBJAVERSE_CACHE", cache)


def test_what_is_wanted_is_downloaded_by_the_package(cache, tmp_path, monkeypatch):
    calls = []
    fake_package(monkeypatch, cache, calls)
    pool = index_pool([], tmp_path / "pool", config(classes=("mug",), per_class=2))
    assert calls == ["annotations", sorted([MUG, ABSENT])]
    assert len(pool.classes["mug"]) == 2 and len(pool.assets) == 2


def test_without_network_one_line_says_what_can_be_done(cache, tmp_path, monkeypatch):
    fake_package(monkeypatch, cache, [], fail=True)
    with pytest.raises(UserError, match=r"no route to host.*index what is there"):
        index_pool([], tmp_path / "pool", config(classes=("mug",)))


def test_without_the_package_one_line_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "objaverse", None)
    with pytest.raises(UserError, match=r"pip install 'corporeal\[objaverse\]'"):
        index_pool([], tmp_path / "pool", config(classes=("mug",)))


def test_without_a_cache_one_line_says_how_to_get_one(tmp_path):
    with pytest.raises(UserError, match=r"object-paths\.json\.gz is not there"):
        index_pool([tmp_path], tmp_path / "pool", config())


def test_the_package_itself_reads_this_layout(cache, monkeypatch):
    """Hold the copy made here against the real package, where it is installed."""
    package = pytest.importorskip("objaverse")
    monkeypatch.setattr(package, "_VERSIONED_PATH", str(cache))
    assert set(package.load_uids()) == set(PATHS)
    assert package.load_lvis_annotations() == LVIS
    assert package.load_annotations([MUG])[MUG]["license"] == "by"
    assert package.load_objects([MUG]) == {MUG: str(cache / PATHS[MUG])}
