from dataclasses import asdict, fields, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.types import Inventory, ObjectDescription, Video
from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline import run_files, run_pipeline
from corporeal.pipeline.run_pipeline import Settings, _Run, read_run_request, run
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.recognition.typical_extents import extent_warning
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from glb_maker import cube
from sample_scenes import plain, scene


def silent(verb):
    return lambda fraction, words: None


def test_a_run_remembers_what_it_was_asked(tmp_path):
    wanted = Settings(describe=DescribeConfig(annotations=Path("said.yaml")), fill=FillConfig(detail="fine"))
    with pytest.raises(UserError):
        run([tmp_path / "nowhere.glb"], tmp_path / "run", wanted, silent)
    asked = read_run_request(tmp_path / "run")
    assert asked.inputs == [(tmp_path / "nowhere.glb").resolve()]
    assert asked.settings == wanted


def test_a_failed_run_says_why(tmp_path):
    with pytest.raises(UserError):
        run([tmp_path / "nowhere.glb"], tmp_path / "run", Settings(), silent)
    said = store.read_json(tmp_path / "run" / "run.json")
    assert said["state"] == "failed"
    assert "nowhere.glb" in said["error"]


def test_a_run_that_was_moved_finds_its_video(tmp_path):
    made = Path("runs/a/9-video")
    there = tmp_path / "moved"
    store.write_json(there / "run.json", {"state": "finished", "inputs": [], "settings": {}})
    store.save(there / "9-video" / store.DATA_FILE, Video(made / "video.mp4", 30, 64, 64))
    store.finish_result(there / "9-video", "key", None, 1.0)
    assert run_pipeline.read_run(there).rendered_video.path == there / "9-video" / "video.mp4"


def test_an_edited_annotation_makes_its_answers_stale(tmp_path):
    path = tmp_path / "said.yaml"
    path.write_text("a: steel")
    before = run_pipeline.digests_of_named_files(DescribeConfig(annotations=path))
    path.write_text("a: glass")
    assert run_pipeline.digests_of_named_files(DescribeConfig(annotations=path)) != before


def test_recordings_that_a_run_writes_do_not_make_it_stale_and_those_it_reads_do(tmp_path):
    def names(**config):
        return run_pipeline.digests_of_named_files(DescribeConfig(**config))

    (tmp_path / "one.json").write_text("{}")
    written, read = names(record=tmp_path), names(vlm=f"replay:{tmp_path}")
    (tmp_path / "two.json").write_text("{}")
    assert names(record=tmp_path) == written
    assert names(vlm=f"replay:{tmp_path}") != read


def test_other_weights_in_a_folder_make_what_they_saw_stale(tmp_path):
    (tmp_path / "model.safetensors").write_text("1")
    config = ReconstructConfig(semantic=f"clip:{tmp_path}")
    before = run_pipeline.digests_of_named_files(config)
    (tmp_path / "model.safetensors").write_text("2")
    assert before and run_pipeline.digests_of_named_files(config) != before


def test_a_finished_run_stays_fresh_whatever_lies_in_the_working_directory(tmp_path, monkeypatch):
    """Values such as the engine "cpu" were looked for on the disk, as if each named a file."""
    monkeypatch.chdir(tmp_path)
    path = cube().save(tmp_path / "cube.glb")
    done = []

    def tell(verb):
        return lambda fraction, words: done.append(verb)

    run([path], tmp_path / "run", Settings(), tell, until="fill")
    assert done
    done.clear()
    values = [v for f in fields(Settings) for v in asdict(getattr(Settings(), f.name)).values()]
    for value in {"cpu", *(v for v in values if isinstance(v, str) and v)}:
        Path(value).write_text("in the way")
    run([path], tmp_path / "run", Settings(), tell, until="fill")
    assert not done
    for f in fields(Settings):
        assert run_pipeline.digests_of_named_files(getattr(Settings(), f.name)) == []


def test_memory_is_counted_in_megabytes():
    assert 10 < run_files.peak_memory_mb() < 100_000


def test_a_size_that_a_model_has_judged_is_doubted_once():
    objects = [(name, [("mesh", plain(), {})]) for name in ("vase_0", "vase_01", "hut_0")]
    table = [extent_warning(name, "vase", 9.0) for name, _ in objects]
    made = replace(scene(*objects), warnings=("vase_0 and hut_0 overlap at the start.", *table))
    words = [ObjectDescription(name, "", (), usual_extent=None) for name, _ in objects]
    assert run_files.remaining_warnings(made, Inventory(tuple(words))) == made.warnings
    words[0] = replace(words[0], usual_extent=0.25)
    assert run_files.remaining_warnings(made, Inventory(tuple(words))) == (
        "vase_0 and hut_0 overlap at the start.",
        *table[1:],
    )


@pytest.fixture
def building(monkeypatch, tmp_path):
    """Keep scenes in a fresh folder; give it with the names of the scenes that were built."""
    built = []

    def write(name, folder):
        built.append(name)
        store.write_bytes(folder / f"{name}.glb", f"{name} as built".encode())
        return folder / f"{name}.glb"

    monkeypatch.setenv(store.CACHE_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr(run_pipeline, "write_showcase", write)
    return tmp_path / "cache" / "scenes", built


def test_a_scene_of_our_own_is_built_once_for_each_state_of_the_code(building, tmp_path, monkeypatch):
    kept, built = building
    for run_name in ("a", "b"):
        path = run_pipeline.write_cached_showcase("duck-on-mud", tmp_path / run_name)
        assert path.read_bytes() == b"duck-on-mud as built"
    assert built == ["duck-on-mud"]
    run_pipeline.write_cached_showcase("duck-on-can", tmp_path / "a")
    monkeypatch.setattr(store, "source_digest", lambda: "edited")
    run_pipeline.write_cached_showcase("duck-on-mud", tmp_path / "a")
    assert built == ["duck-on-mud", "duck-on-can", "duck-on-mud"]
    # Of each scene only the newest is kept.
    assert len(list(kept.iterdir())) == 2


def test_a_scene_that_cannot_be_kept_is_built_each_time(building, tmp_path):
    kept, built = building
    kept.parent.write_text("in the way")
    for run_name in ("a", "b"):
        assert run_pipeline.write_cached_showcase("duck-on-mud", tmp_path / run_name).exists()
    assert len(built) == 2


def test_a_scene_file_keeps_its_name_beside_photographs(tmp_path):
    """It was called 0-reconstruct, as the folder that what was reconstructed lies in."""
    made = tmp_path / "run" / "0-reconstruct"
    made.mkdir(parents=True)
    cube().save(made / "bananas.glb")
    (tmp_path / "fall.toml").write_text('file = "bananas"\n')
    (tmp_path / "bananas").mkdir()
    (tmp_path / "bananas" / "transforms.json").touch()
    asked = _Run([tmp_path / "fall.toml"], tmp_path / "run", Settings(), silent)
    asked.made = asked.made.having("reconstruct", SimpleNamespace(names=("bananas",)))
    assert asked._assemble(tmp_path / "run" / "1-assemble", lambda *_: None).name == "fall"
