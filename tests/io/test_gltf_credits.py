"""Whose a model is, as its file says."""

import pytest

from corporeal.io.gltf.gltf_credits import credit_of_document
from corporeal.io.gltf.gltf_document import GltfDocument
from corporeal.io.gltf.gltf_reader import read_glb
from glb_maker import cube

SKETCHFAB = {
    "author": "Ada (https://sketchfab.com/ada)",
    "license": "CC-BY-4.0 (http://creativecommons.org/licenses/by/4.0/)",
    "source": "https://sketchfab.com/3d-models/x",
    "title": "Old Chair",
}


def said(tmp_path, **asset):
    made = cube()
    made.json["asset"] |= asset
    return made.save(tmp_path / "x.glb")


def test_what_sketchfab_writes_is_understood(tmp_path):
    path = said(tmp_path, extras=SKETCHFAB)
    credit = credit_of_document(GltfDocument(path))
    assert credit.licence.startswith("CC-BY-4.0")
    assert credit.attribution == ("Old Chair by Ada (https://sketchfab.com/ada) (https://sketchfab.com/3d-models/x)")
    assert read_glb(path).objects[0].credit == f"{credit.licence}; {credit.attribution}"


@pytest.mark.parametrize(
    ("copyright", "licence"),
    [
        ("CC0, public domain", "CC0"),
        ("(c) 2023 Wayfair, CC-BY-NC-SA-4.0", "CC-BY-NC-SA-4.0"),
        ("2017 Bo, CC BY 4.0 International", "CC BY 4.0"),
        ("Copyright Smith, all rights reserved", ""),
        ("accbyte and mitten", ""),
    ],
)
def test_a_licence_is_found_in_a_copyright_line(tmp_path, copyright, licence):
    credit = credit_of_document(GltfDocument(said(tmp_path, copyright=copyright)))
    assert (credit.licence, credit.attribution) == (licence, copyright)
    assert credit.words == copyright, "the licence is not said twice"


@pytest.mark.parametrize("asset", [{}, {"extras": 3}, {"extras": {"license": 7}}, {"copyright": ["x"]}])
def test_a_file_that_says_nothing_of_use_gives_nothing(tmp_path, asset):
    assert credit_of_document(GltfDocument(said(tmp_path, **asset))).words == ""


def test_a_credit_is_one_line_that_can_be_written_anywhere(tmp_path):
    credit = credit_of_document(GltfDocument(said(tmp_path, copyright="a\u0000b\nc \ud800 " + "x" * 999)))
    assert credit.attribution.startswith("a b c ? xxx") and len(credit.attribution) == 500
