"""Amazon Berkeley Objects, in a small copy of its layout that is made here."""

import csv
import gzip
import io
import json

import pytest

from corporeal.core.errors import UserError
from corporeal.pool import abo
from corporeal.pool.pool_index import IndexConfig, OriginConfig, index_pool
from pool_models import plain_ball

COLUMNS = (
    "3dmodel_id,path,meshes,materials,textures,images,image_height_max,image_height_min,"
    "image_width_max,image_width_min,vertices,faces,extent_x,extent_y,extent_z"
).split(",")


def words(*values):
    return [{"language_tag": tag, "value": value} for tag, value in values]


@pytest.fixture
def root(tmp_path):
    """Three products, one listed twice, and one model that was not unpacked."""
    root = tmp_path / "abo"
    models = {"B01": 0.4, "B02": 0.05, "B03": 0.3}
    table = io.StringIO()
    writer = csv.DictWriter(table, COLUMNS)
    writer.writeheader()
    for k, (name, radius) in enumerate({**models, "B09": 1.0}.items()):
        said = dict.fromkeys(COLUMNS, "1") | {"3dmodel_id": name, "path": f"{k}/{name}.glb"}
        writer.writerow(said | {f"extent_{axis}": str(2 * radius) for axis in "xyz"})
        if name in models:
            file = root / "3dmodels" / "original" / f"{k}" / f"{name}.glb"
            file.parent.mkdir(parents=True)
            file.write_bytes(plain_ball(radius))
    (root / "3dmodels" / "metadata").mkdir()
    (root / "3dmodels" / "metadata" / "3dmodels.csv.gz").write_bytes(gzip.compress(table.getvalue().encode()))
    listings = [
        {
            "item_id": "B01",
            "3dmodel_id": "B01",
            "product_type": [{"value": "OTTOMAN"}],
            "item_name": words(("de_DE", "Hocker"), ("en_US", "Round  Ottoman, Blue")),
        },
        {"item_id": "B01b", "3dmodel_id": "B01", "product_type": [{"value": "CHAIR"}]},
        {"item_id": "B02", "3dmodel_id": "B02", "product_type": [{"value": "DRINKING_CUP"}]},
        {"item_id": "B07", "product_type": [{"value": "SHOES"}]},
    ]
    folder = root / "listings" / "metadata"
    folder.mkdir(parents=True)
    for name, items in (("0", listings[:2]), ("f", listings[2:])):
        text = "".join(json.dumps(item) + "\n" for item in items)
        (folder / f"listings_{name}.json.gz").write_bytes(gzip.compress(text.encode()))
    return root


def test_models_become_assets_with_product_types_and_attribution(root, tmp_path):
    pool = index_pool([root], tmp_path / "pool", IndexConfig(OriginConfig("abo")))
    assert pool.rejections == ()
    said = {a.name: (a.class_name, a.source, a.licence, a.metric) for a in pool.assets}
    assert said == {
        "abo_B01": ("ottoman", "abo:B01", "CC-BY-4.0", True),
        "abo_B02": ("drinking cup", "abo:B02", "CC-BY-4.0", True),
        "abo_B03": ("object", "abo:B03", "CC-BY-4.0", True),
    }
    ottoman = pool.asset("abo_B01")
    assert ottoman.credit == ("CC-BY-4.0; Round Ottoman, Blue, Amazon Berkeley Objects (c) Amazon.com")
    assert ottoman.extent == pytest.approx(0.8)


def test_a_mesh_that_is_not_as_large_as_the_table_says_is_not_in_metres(root):
    (root / "3dmodels" / "original" / "0" / "B01.glb").write_bytes(plain_ball(40.0))
    pool = index_pool([root], root / "pool", IndexConfig(OriginConfig("abo")))
    assert not pool.asset("abo_B01").metric


def test_copies_from_before_the_terms_were_eased_say_so(root):
    (root / "LICENSE-CC-BY-NC-4.0.txt").touch()
    assert {c.declared.licence for c in abo.abo_candidates(root)} == {"CC-BY-NC-4.0"}


def test_what_was_not_unpacked_is_passed_over_and_a_path_leads_nowhere_else(root, tmp_path):
    (tmp_path / "outside.glb").write_bytes(plain_ball())
    path = root / "3dmodels" / "metadata" / "3dmodels.csv.gz"
    text = gzip.decompress(path.read_bytes()).decode().replace("3/B09.glb", "../../../outside.glb")
    path.write_bytes(gzip.compress(text.encode()))
    assert [c.name for c in abo.abo_candidates(root)] == ["abo_B01", "abo_B02", "abo_B03"]


@pytest.mark.parametrize(
    ("file", "data", "said"),
    [
        ("3dmodels/metadata/3dmodels.csv.gz", b"no gzip", "cannot be read"),
        ("3dmodels/metadata/3dmodels.csv.gz", gzip.compress(b"a,b\n1,2\n", mtime=0), "no columns"),
        ("listings/metadata/listings_0.json.gz", gzip.compress(b'{"3dmodel_id"', mtime=0)[:-6], "cannot"),
        ("listings/metadata/listings_0.json.gz", gzip.compress(b'{"3dmodel_id"', mtime=0), "cannot be read"),
    ],
)
def test_a_broken_table_is_named(root, file, data, said):
    (root / file).write_bytes(data)
    with pytest.raises(UserError, match=said) as error:
        abo.abo_candidates(root)
    assert file.rsplit("/", 1)[1] in str(error.value)


def test_a_folder_of_another_layout_is_refused(tmp_path):
    with pytest.raises(UserError, match="abo-3dmodels"):
        abo.abo_candidates(tmp_path)
