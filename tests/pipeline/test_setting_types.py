"""Which settings name files that are read is declared by their types."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from corporeal.core.setting_types import ReadsPath, WritesPath, paths_read
from corporeal.description.describe_config import DescribeConfig
from corporeal.fields.field_specification import FIELD_READERS
from corporeal.materials.library_entry import SHIPPED_LIBRARY_FILES
from corporeal.pipeline.settings import FIELD_FILES, SHIPPED_LIBRARIES, GroundConfig, Settings
from corporeal.pipeline.stages.compose import ComposeConfig
from corporeal.reconstruction.reconstruct_config import ReconstructConfig

NO_PATHS = {"GroundConfig.floor", "GroundConfig.neutral", "ComposeConfig.count"}
"""Settings that are any string, and never a path."""


@dataclass(frozen=True)
class Some:
    """Settings of every sort."""

    file: Path | None = None
    out: Annotated[Path | None, WritesPath()] = None
    word: str = "cpu"
    spec: Annotated[str, ReadsPath(prefixes=("replay",))] = "metadata"
    masks: Annotated[str, ReadsPath(prefixes=("sam2",), names=("auto",))] = "auto"


def test_only_what_is_declared_is_a_path():
    assert paths_read(Some()) == []
    assert paths_read(Some(word="a.txt", spec="a.txt", out=Path("a"))) == []
    assert paths_read(Some(file=Path("a.yaml"))) == [Path("a.yaml")]
    assert paths_read(Some(spec="replay:a/b")) == [Path("a/b")]
    assert paths_read(Some(spec="openai:a/b")) == []
    assert paths_read(Some(masks="a/b")) == [Path("a/b")]
    assert paths_read(Some(masks="sam2:~/b")) == [Path.home() / "b"]


def test_our_own_settings_name_the_files_they_read():
    assert paths_read(GroundConfig(library="my.toml", field="vomp:here.npz")) == [Path("my.toml"), Path("here.npz")]
    assert paths_read(GroundConfig(field="one:E=2e6")) == []
    asked = DescribeConfig(annotations=Path("a.yaml"), record=Path("r"), critic="replay:c")
    assert paths_read(asked) == [Path("a.yaml"), Path("c")]
    seen = ReconstructConfig(masks="sam3:w", semantic="clip:v", structural="dinov2:u")
    assert paths_read(seen) == [Path("w"), Path("v"), Path("u")]
    assert paths_read(ComposeConfig(vlm="replay:f", record=Path("r"))) == [Path("f")]


def test_a_setting_that_is_any_string_says_whether_it_is_a_path():
    kinds = [*get_type_hints(Settings).values(), ComposeConfig]
    undeclared = {
        f"{kind.__name__}.{f.name}"
        for kind in kinds
        for f in fields(kind)
        if _any_string(get_type_hints(kind, include_extras=True)[f.name])
    }
    assert undeclared == NO_PATHS


def _any_string(hint: Any) -> bool:
    if get_origin(hint) is Annotated and any(isinstance(m, ReadsPath) for m in get_args(hint)):
        return False
    return hint is str or (str in get_args(hint) and tuple not in (get_origin(hint), hint))


def test_prefixes_and_names_are_those_that_are_understood():
    assert set(FIELD_FILES) == set(FIELD_READERS)
    assert set(SHIPPED_LIBRARIES) == set(SHIPPED_LIBRARY_FILES)
