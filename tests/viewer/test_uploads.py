"""Files that come through the page, from strangers too."""

import http.client
import io
import stat
import zipfile

import pytest

from corporeal.core.errors import BadFileError, UserError
from corporeal.viewer import zip_unpack as unpacking
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.uploads import INBOX_FOLDER, UploadInbox, UploadLimits, upload_route
from corporeal.viewer.web_app import SiteOptions, make_app
from corporeal.viewer.zip_unpack import unpack_zip
from viewer_server import LOCAL, serving


def packed(*files, kind=zipfile.ZIP_DEFLATED):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", kind) as archive:
        for name, content in files:
            archive.writestr(name, content)
    return data.getvalue()


def special(mode):
    entry = zipfile.ZipInfo("images/link.jpg")
    entry.external_attr = mode << 16
    return entry


def lying_size():
    """The directory says that the file is small."""
    data = bytearray(packed(("a.jpg", b"\0" * (8 << 20))))
    at = data.rindex(b"PK\x01\x02")
    data[at + 24 : at + 28] = (100).to_bytes(4, "little")
    return bytes(data)


PHOTO = ("images/0001.jpg", b"\xff\xd8" + bytes(100))
BAD = {
    "bomb": packed(PHOTO, ("images/b.jpg", b"\0" * (300 << 20))),
    "many bombs": packed(*((f"{k}.txt", b"\0" * (1 << 20)) for k in range(70))),
    "parent": packed(("../evil.jpg", b"x")),
    "deep parent": packed(("images/../../evil.jpg", b"x")),
    "absolute": packed(("/tmp/evil.jpg", b"x")),
    "drive": packed(("C:\\evil.jpg", b"x")),
    "backslash": packed(("images\\..\\..\\evil.jpg", b"x")),
    "link": packed((special(stat.S_IFLNK | 0o777), "/etc/passwd")),
    "pipe": packed((special(stat.S_IFIFO | 0o600), b"")),
    "nested": packed(("more.zip", packed(PHOTO))),
    "program": packed(("run.sh", b"#!/bin/sh")),
    "hidden": packed((".ssh/a.txt", b"x")),
    "too deep": packed(("a/b/c/d/e/f.jpg", b"x")),
    "too many": packed(*((f"{k}.txt", b"") for k in range(unpacking.MAX_ZIP_ENTRIES + 1))),
    "no name": packed(("images/\x01.jpg", b"x")),
    "twice": packed(("a.jpg", b"x"), ("a.jpg", b"y")),
    "lying size": lying_size(),
    "cut": packed(PHOTO)[:-30],
    "empty": packed(),
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("name", BAD)
def test_a_hostile_zip_is_refused_and_nothing_lies_outside(name, tmp_path):
    source, inside = tmp_path / "photos.zip", tmp_path / "in"
    inside.mkdir()
    source.write_bytes(BAD[name])
    with pytest.raises(BadFileError, match=r"^photos.zip: .*\.$"):
        unpack_zip(source, inside / "photos", most=64 << 20)
    assert {p.name for p in tmp_path.iterdir()} == {"photos.zip", "in"}
    assert {p.name for p in inside.iterdir()} <= {"photos"}
    held = sum(p.stat().st_size for p in inside.rglob("*") if p.is_file())
    assert held <= 65 << 20
    assert not any(p.is_symlink() for p in inside.rglob("*"))


def test_photographs_with_their_poses_come_out_as_they_went_in(tmp_path):
    files = (PHOTO, ("transforms.json", b"{}"), ("sparse/0/cameras.bin", b"\1\2"))
    (tmp_path / "a.zip").write_bytes(packed(*files))
    assert unpack_zip(tmp_path / "a.zip", tmp_path / "photos") == 3
    for name, content in files:
        assert (tmp_path / "photos" / name).read_bytes() == content


@pytest.fixture
def server(tmp_path):
    runs = tmp_path / "runs"
    runs.mkdir()
    # The disk of who runs this may be nearly full.
    inbox = UploadInbox(runs, UploadLimits(free_disk_bytes=0))
    with serving(make_app(SiteOptions(RunStore((), runs), works=True), LOCAL, (upload_route(inbox),))) as made:
        made.runs, made.inbox = runs, inbox
        yield made


def put(server, data):
    return server.ask("/files", "PUT", data, X_Corporeal="1")


def left(server):
    return sorted(p.name for p in server.runs.glob(f"{INBOX_FOLDER}/*/*"))


def test_an_upload_is_known_by_its_first_bytes_and_gets_a_name_of_ours(server):
    found = put(server, b"glTF" + bytes(100)).json
    assert (found["kind"], found["size"], left(server)) == ("glb", 104, ["scene.glb"])
    assert put(server, packed(PHOTO)).json["kind"] == "zip"
    assert left(server) == ["photos", "scene.glb"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "data",
    [b"", b"{}", b'{"asset": {"version": "2.0"}}', b'file = "/etc/passwd"', b"\x7fELF" + bytes(50),
     b"solid x", b"<svg onload=alert(1)>", BAD["parent"], BAD["link"], BAD["cut"]],
)  # fmt: skip
def test_what_is_not_understood_is_refused_in_a_sentence_and_leaves_nothing(server, data):
    answer = put(server, data)
    assert answer.status == 400 and answer.json["error"].endswith(".")
    assert left(server) == []
    assert server.ask("/runs").status == 200


def test_a_file_is_counted_while_it_comes_whatever_it_says_of_itself(server):
    server.inbox.limits = UploadLimits(file_bytes=10_000, free_disk_bytes=0)
    answer = put(server, b"glTF" + bytes(20_000))
    assert answer.status == 400 and "the most that a page takes" in answer.json["error"]
    assert left(server) == []

    def endless():
        yield b"glTF"
        for _ in range(50):
            yield bytes(1000)

    link = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    link.request("PUT", "/files", endless(), {"X-Corporeal": "1"}, encode_chunked=True)
    assert link.getresponse().status == 400
    assert left(server) == []


@pytest.mark.parametrize("said", ["10", "abc", "-5"])
def test_a_wrong_length_does_no_harm(server, said):
    link = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    link.putrequest("PUT", "/files")
    for name, value in (("X-Corporeal", "1"), ("Content-Length", said)):
        link.putheader(name, value)
    link.endheaders(b"nonsense" * 4)
    assert 400 <= link.getresponse().status < 500
    assert server.ask("/runs").status == 200 and left(server) == []


def test_the_disk_keeps_its_spare_room(server):
    server.inbox.limits = UploadLimits(free_disk_bytes=1 << 60)
    answer = put(server, b"glTF")
    assert answer.status == 400 and answer.json["error"].startswith("The disk is nearly full: ")
    assert left(server) == []


@pytest.mark.slow
def test_every_hostile_file_is_taken_in_or_refused_and_the_server_lives(server, shared_assets):
    folder = shared_assets / "hostile"
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    assert files
    for path in files:
        answer = put(server, path.read_bytes())
        assert answer.status in (200, 400), path
        assert answer.status == 200 or answer.json["error"], path
    assert server.ask("/runs").status == 200
    kept = {p.name for p in server.runs.glob(f"{INBOX_FOLDER}/*/*")}
    assert kept <= {"scene.glb", "splat.ply", "photos"}


def test_only_uploads_are_found_in_the_inbox(tmp_path):
    inbox = UploadInbox(tmp_path)
    for name in ("", "..", "../x", "0" * 16, "/etc", "0123456789abcdeg"):
        with pytest.raises(UserError, match="no such upload"):
            inbox.find(name)
