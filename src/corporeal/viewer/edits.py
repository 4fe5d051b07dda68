"""A run like another, with what a page changed: never in the old run's folder."""

import math
import re
import secrets
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from corporeal.core.errors import UserError
from corporeal.materials.library import find
from corporeal.materials.quantities import QUANTITIES
from corporeal.pipeline.results import Results
from corporeal.pipeline.runner import Settings, reopen
from corporeal.pipeline.settings.assemble_config import validate as validate_assemble
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.recognition.words import safe
from corporeal.scene.beginnings import said_lift, said_velocity
from corporeal.viewer.queue import Asked

ANNOTATIONS = "annotations.yaml"
SPELT = {"Pa": "_Pa", "kg/m³": "_kg_m3", "-": ""}
"""How an annotation's key says a unit; other quantities cannot be changed in the page."""
DETAILS = ("draft", "normal", "fine")
MOST = 1000
"""Runs of one name, counted up."""


def new_name(runs: Path, wanted: str) -> str:
    """Return a folder's name that is free: the wanted one, or that with a number.

    Raises:
        UserError: There is nothing left of the wanted name.

    """
    base = safe(wanted).strip("._- ") or "scene"
    stem = re.sub(r"-\d+$", "", base)
    for name in (base, *(f"{stem}-{k}" for k in range(2, MOST))):
        if not (runs / name).exists():
            return name
    raise UserError(f"There are too many runs called {stem}.")


def changed(run: Path, made: Results, asked: Mapping[str, Any]) -> tuple[Asked, Settings]:
    """Prepare a run that differs from another as a page asks; its annotations are written.

    Args:
        run: The other one's folder; not changed.
        made: What its verbs made.
        asked: ``parts``: number of a part → ``material`` and ``values`` (field → SI); ``detail``;
            ``drop`` in sizes of the object; ``objects``: number of an object → ``lift`` [m] and
            ``velocity`` [m/s].

    Raises:
        UserError: Something asked is not known, or a value lies outside its measured range.

    """
    before = reopen(run)
    settings, runs = before.settings, run.parent
    changes = _annotations(made, asked.get("parts", {}))
    settings = replace(
        settings,
        fill=replace(settings.fill, detail=_detail(asked.get("detail", settings.fill.detail))),
        assemble=_beginning(made, asked, settings.assemble),
    )
    validate_assemble(settings.assemble)
    name = new_name(runs, run.name)
    folder = runs / name
    folder.mkdir()
    if changes:
        old = settings.describe.annotations
        merged = _merged(yaml.safe_load(Path(old).read_text()) if old else {}, changes)
        path = folder / ANNOTATIONS
        path.write_text(yaml.safe_dump(merged, sort_keys=False), encoding="utf-8")
        settings = replace(settings, describe=replace(settings.describe, annotations=path))
    inputs = tuple(str(path) for path in before.inputs)
    return Asked(secrets.token_hex(8), name, inputs), settings


def _detail(word: Any) -> Any:
    if word not in DETAILS:
        raise UserError(f"Unknown detail. Choose one of: {', '.join(DETAILS)}.")
    return word


def _beginning(made: Results, asked: Mapping[str, Any], before: AssembleConfig) -> AssembleConfig:
    """Return how objects begin: what is not asked for is as it was."""
    changes = asked.get("objects", {})
    if not isinstance(changes, dict):
        raise UserError("The changes of objects are no table.")
    lift, velocity = dict(map(said_lift, before.lift)), dict(map(said_velocity, before.velocity))
    objects = made.assembled.scene.objects
    for name, change in changes.items():
        k = int(name) if str(name).isdecimal() else -1
        if not 0 <= k < len(objects) or not isinstance(change, dict):
            raise UserError(f"There is no object {name!r}.")
        if "lift" in change:
            lift[objects[k].name] = number(change["lift"], "The lift")
        if "velocity" in change:
            said = change["velocity"]
            if not isinstance(said, list) or len(said) != 3:
                raise UserError("A velocity is no three numbers.")
            x, y, z = (number(x, "A velocity") for x in said)
            velocity[objects[k].name] = (x, y, z)
    return replace(
        before,
        drop=number(asked.get("drop", before.drop), "The drop"),
        lift=tuple(f"{name}={metres:g}" for name, metres in lift.items()),
        velocity=tuple(f"{name}={x:g},{y:g},{z:g}" for name, (x, y, z) in velocity.items()),
    )


def number(value: Any, what: str) -> float:
    """Return a finite number that a page sent; ``what`` names it.

    Raises:
        UserError: It is none.

    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UserError(f"{what} is no number.")
    return float(value)


def _annotations(made: Results, parts: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return object → part → its annotation, as in an annotation file."""
    scene, catalogue, field = made.scene, made.parts, made.field
    if not isinstance(parts, dict):
        raise UserError("The changes of parts are no table.")
    annotations: dict[str, dict[str, Any]] = {}
    for name, change in parts.items():
        k = int(name) if str(name).isdecimal() else -1
        if not 0 <= k < len(catalogue.catalogue) or not isinstance(change, dict):
            raise UserError(f"There is no part {name!r}.")
        part = catalogue.catalogue[k]
        material = find(str(change.get("material", field.materials[k].name))).name
        annotation: dict[str, Any] = {"material": material}
        if values := change.get("values"):
            annotation["values"] = _values(material, values)
        annotations.setdefault(scene.objects[part.object].name, {})[part.name] = annotation
    return annotations


def _values(material: str, values: Any) -> dict[str, float]:
    """Return values under the keys of an annotation; each inside its measured range."""
    ranges, out = find(material).ranges, {}
    for name, value in values.items() if isinstance(values, dict) else ():
        if name not in ranges or QUANTITIES[name].unit not in SPELT:
            raise UserError(f"{name!r} of {material} cannot be changed.")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UserError(f"{name} of {material} is no number.")
        low, high = ranges[name].low, ranges[name].high
        if not low * (1 - 1e-6) <= value <= high * (1 + 1e-6):
            raise UserError(f"{name} of {material} lies outside its range, {low:g} to {high:g}.")
        out[name + SPELT[QUANTITIES[name].unit]] = min(max(float(value), low), high)
    return out


def _merged(old: Any, new: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the annotations of a file with new ones in their place."""
    merged = dict(old) if isinstance(old, dict) else {}
    for owner, parts in new.items():
        before = merged.get(owner)
        whole = (
            {} if before is None else before if isinstance(before, dict) else {"material": before}
        )
        merged[owner] = {**whole, "parts": {**whole.get("parts", {}), **parts}}
    return merged
