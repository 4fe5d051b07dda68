"""Whom to thank for a model is said in all that is made from it."""

import csv
import json
import subprocess

import imageio_ffmpeg
import pytest
import trimesh

from corporeal.render import figures
from pool_models import glb

BY_TABLE = "CC-BY-4.0; Ada <ada@example.org>"
BY_FILE = "(c) Bo, CC-BY-SA-3.0"


@pytest.fixture
def typed(monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(figures, "PANEL_SIZE_PX", (130, 98))

    def type_(*words):
        code, said = command(*words)
        assert code == 0, said.err

    return type_


def a_pool(folder):
    """Two models: of one a table says whose it is, of the other its own file."""
    for name, sides, asset in (("box", (0.3, 0.3, 0.3), {}), ("plank", (0.4, 0.1, 0.2), {"copyright": BY_FILE})):
        fine = trimesh.creation.box(sides).subdivide().subdivide()
        (folder / name).mkdir(parents=True)
        (folder / name / f"{name}.glb").write_bytes(glb(fine.vertices, fine.faces, **asset))
    with (folder / "manifest.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(("file", "licence", "attribution"))
        table.writerow(("box/box.glb", "CC-BY-4.0", "Ada <ada@example.org>"))


def told_by(video):
    """What players show of a video's tags."""
    probe = subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(video)], capture_output=True, text=True).stderr
    said = dict(line.split(":", 1) for line in probe.splitlines() if ":" in line)
    return {key.strip(): value.strip() for key, value in said.items()}


@pytest.mark.slow
def test_scene_video_and_report_name_the_makers_of_what_a_pool_gave(typed, tmp_path):
    a_pool(tmp_path / "models")
    typed("assemble", "--from", "models", "--classes", "box", "plank", "--views", "0")
    folder = tmp_path / "scenes" / "box-plank-0"
    objects = json.loads((folder / "composition.json").read_text())["objects"]
    assert {o["licence"] for o in objects} == {"CC-BY-4.0", "CC-BY-SA-3.0"}
    short = ("--duration", "0.1", "--width", "64", "--height", "48", "--quality", "draft")
    typed("run", folder / "scene.toml", *short)
    run = tmp_path / "runs" / "box-plank-0"
    page = (run / "report.html").read_text()
    tags = told_by(run / "video.mp4")
    assert tags["copyright"] == tags["comment"] == f"{BY_TABLE}; {BY_FILE}"
    for credit in (BY_TABLE, BY_FILE):
        assert f"<li>{credit.replace('<', '&lt;').replace('>', '&gt;')}</li>" in page
