"""A folder of models becomes a pool; every file gets in or has a reason."""

from corporeal.pool.index import index, read_pool


def test_every_real_object_is_let_in(shared_assets, tmp_path):
    folders = [shared_assets / "objects", shared_assets / "ycb"]
    pool = index(folders, tmp_path / "pool")
    assert len(pool.assets) == 55
    assert pool.rejections == ()
    assert len(pool.classes) >= 25
    duck = pool.asset("duck_khronos")
    assert duck.class_name == "duck" and not duck.metric
    assert duck.licence == "SCEA-Shared-Source-1.0" and "Sony" in duck.attribution
    assert duck.file == (shared_assets / "objects" / "duck_khronos.glb").resolve()
    assert read_pool(tmp_path / "pool") == pool
