"""Compared methods, as changes of the default settings.

Folders of an evaluation of dynamics.

``OUT/SCENE/METHOD/`` is a run as ``corporeal run`` leaves it, done up to simulate, so that ``pipeline.read_back`` reads
it. The reference, ours at a finer detail, is a run like any other.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.fields.field_specification import FIELD_READERS, parse_field_specification
from corporeal.pipeline.run_pipeline import Settings

OURS_NAME = "ours"
BASELINE_NAMES = ("single", "capped", "one", "omniphysgs", "vomp", "pixie", "table")
ReferenceDetail = Literal["normal", "fine"]
"""Details of a reference."""
INPUT_FOLDER = "input"
"""Folder of a scene for the file that all of its runs read, where the scene has none."""
NUMBERS_FILE = "dynamics.json"
"""In a run's folder: what is compared of it."""


def run_folder(out: Path, scene: str, method: str) -> Path:
    """Return the folder of one method's run of one scene."""
    return out / scene / method


def reference_folder(out: Path, scene: str, detail: ReferenceDetail) -> Path:
    """Return the folder of the run that a scene's other runs are compared with."""
    return out / scene / f"reference-{detail}"


METHOD_WORDS = {
    OURS_NAME: "ours",
    "single": "one velocity field for all objects",
    "capped": "stiffness capped by the published rule",
    "one": "one soft material for everything, all solid",
    "omniphysgs": "our laws with one E, ν and ρ, and one velocity field",
    "vomp": "numbers of VoMP's field",
    "pixie": "numbers and laws of Pixie's field",
    "table": "numbers of a table",
}
"""Method → what it is, in words."""


@dataclass(frozen=True)
class Method:
    """One method of a comparison."""

    name: str
    """Names its folders."""
    spec: str
    """As typed; of a field ("vomp:fields/") with the path."""


OUR_METHOD = Method(OURS_NAME, OURS_NAME)


def parse_method(spec: str) -> Method:
    """Read what --against names.

    Raises:
        UserError: There is no such method, or its files are missing.
    """
    name, colon, _ = spec.partition(":")
    if name not in BASELINE_NAMES or (colon and name in ("single", "capped", "omniphysgs")):
        raise UnknownChoiceError("baseline", spec, [_said(n) for n in BASELINE_NAMES])
    if name not in ("single", "capped"):
        parse_field_specification(spec) if name not in FIELD_READERS else _existing(spec)
    return Method(name, spec)


def _said(name: str) -> str:
    return f"{name}:PATH" if name in FIELD_READERS else name


def _existing(spec: str) -> None:
    path = Path(spec.partition(":")[2]).expanduser()
    if not spec.partition(":")[2] or not path.exists():
        raise UserError(f"--against {spec}: no such file or folder. Check the path.")


def method_settings(method: Method, base: Settings, scene: str) -> Settings:
    """Return what a method runs a scene with.

    Args:
        method: Which.
        base: Ours.
        scene: Its name; of a folder of fields PATH/SCENE/ or PATH/SCENE.npz is taken where it is.
    """
    if method.name == OURS_NAME:
        return base
    if method.name == "capped":
        return replace(base, fill=replace(base.fill, stiffness="capped"))
    if method.name == "single":
        return replace(base, simulate=replace(base.simulate, contact="single"))
    field = _of_scene(method, scene) if method.name in FIELD_READERS else method.spec
    changed = replace(base, ground=replace(base.ground, field=field))
    if method.name != "omniphysgs":
        return changed
    return replace(changed, simulate=replace(base.simulate, contact="single"))


def _of_scene(method: Method, scene: str) -> str:
    path = Path(method.spec.partition(":")[2]).expanduser()
    suffix = FIELD_READERS[method.name][1]
    own = (path / scene, path / f"{scene}{suffix}")
    return f"{method.name}:{next((p for p in own if p.exists()), path)}"
