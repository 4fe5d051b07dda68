"""Methods that are compared: what each changes of our settings, and nothing else."""

from dataclasses import dataclass, replace
from pathlib import Path

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.fields.specification import READERS, asked
from corporeal.lab.evaluation.dynamics.places import BASELINES, OURS
from corporeal.pipeline.runner import Settings

WORDS = {
    OURS: "ours",
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
    """Of ``places.METHODS``: names its folders."""
    spec: str
    """As typed; of a field ("vomp:fields/") with the path."""


ours = Method(OURS, OURS)


def method_of(spec: str) -> Method:
    """Read what --against names.

    Raises:
        UserError: There is no such method, or its files are missing.

    """
    name, colon, _ = spec.partition(":")
    if name not in BASELINES or (colon and name in ("single", "capped", "omniphysgs")):
        raise UnknownChoiceError("baseline", spec, [_said(n) for n in BASELINES])
    if name not in ("single", "capped"):
        asked(spec) if name not in READERS else _existing(spec)
    return Method(name, spec)


def _said(name: str) -> str:
    return f"{name}:PATH" if name in READERS else name


def _existing(spec: str) -> None:
    path = Path(spec.partition(":")[2]).expanduser()
    if not spec.partition(":")[2] or not path.exists():
        raise UserError(f"--against {spec}: no such file or folder. Check the path.")


def settings_of(method: Method, base: Settings, scene: str) -> Settings:
    """Return what a method runs a scene with.

    Args:
        method: Which.
        base: Ours.
        scene: Its name; of a folder of fields PATH/SCENE/ or PATH/SCENE.npz is taken where it is.

    """
    if method.name == OURS:
        return base
    if method.name == "capped":
        return replace(base, fill=replace(base.fill, stiffness="capped"))
    if method.name == "single":
        return replace(base, simulate=replace(base.simulate, contact="single"))
    field = _of_scene(method, scene) if method.name in READERS else method.spec
    changed = replace(base, ground=replace(base.ground, field=field))
    if method.name != "omniphysgs":
        return changed
    return replace(changed, simulate=replace(base.simulate, contact="single"))


def _of_scene(method: Method, scene: str) -> str:
    path = Path(method.spec.partition(":")[2]).expanduser()
    suffix = READERS[method.name][1]
    own = (path / scene, path / f"{scene}{suffix}")
    return f"{method.name}:{next((p for p in own if p.exists()), path)}"
