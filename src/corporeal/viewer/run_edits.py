"""Edited copies of runs; the original is not changed."""

import math
import re
import secrets
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from corporeal.core.errors import UserError
from corporeal.materials.library import find_material
from corporeal.materials.quantities import KEY_STEM_OF_FIELD, QUANTITIES
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import Settings, read_run_request
from corporeal.pipeline.settings import validate_assemble
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.recognition.readable_names import safe_name
from corporeal.scene.initial_state import parse_initial_velocity, parse_lift
from corporeal.viewer.run_queue import QueuedRun

ANNOTATIONS_FILE = "annotations.yaml"
UNIT_KEY_SUFFIXES = {"Pa": "_Pa", "kg/m³": "_kg_m3", "-": ""}
"""How an annotation's key says a unit; other quantities cannot be changed in the page."""
DETAIL_LEVELS = ("draft", "normal", "fine")
MAX_NUMBERED_RUNS = 1000
"""Runs of one name, counted up."""


def free_run_name(runs: Path, wanted: str) -> str:
    """Return a folder's name that is free: the wanted one, or that with a number.

    Raises:
        UserError: There is nothing left of the wanted name.
    """
    base = safe_name(wanted).strip("._- ") or "scene"
    stem = re.sub(r"-\d+$", "", base)
    for name in (base, *(f"{stem}-{k}" for k in range(2, MAX_NUMBERED_RUNS))):
        if not (runs / name).exists():
            return name
    raise UserError(f"There are too many runs called {stem}.")


def prepare_changed_run(run: Path, made: StageResults, asked: Mapping[str, Any]) -> tuple[QueuedRun, Settings]:
    """Prepare a run that differs from another as a page asks; its annotations are written.

    Args:
        run: The other one's folder; not changed.
        made: What its stages made.
        asked: ``parts``: number of a part → ``material`` and ``values`` (field → SI); ``detail``; ``drop`` in sizes of
            the object; ``objects``: number of an object → ``lift`` [m] and ``velocity`` [m/s].

    Raises:
        UserError: Something asked is not known, or a value lies outside its measured range.
    """
    before = read_run_request(run)
    settings, runs = before.settings, run.parent
    changes = _annotations(made, asked.get("parts", {}))
    settings = replace(
        settings,
        fill=replace(settings.fill, detail=_detail(asked.get("detail", settings.fill.detail))),
        assemble=_initial_state(made, asked, settings.assemble),
    )
    validate_assemble(settings.assemble)
    name = free_run_name(runs, run.name)
    folder = runs / name
    folder.mkdir()
    if changes:
        old = settings.describe.annotations
        merged = _merge_annotations(yaml.safe_load(Path(old).read_text()) if old else {}, changes)
        path = folder / ANNOTATIONS_FILE
        path.write_text(yaml.safe_dump(merged, sort_keys=False), encoding="utf-8")
        settings = replace(settings, describe=replace(settings.describe, annotations=path))
    inputs = tuple(str(path) for path in before.inputs)
    return QueuedRun(secrets.token_hex(8), name, inputs), settings


def _detail(word: Any) -> Any:
    if word not in DETAIL_LEVELS:
        raise UserError(f"Unknown detail. Choose one of: {', '.join(DETAIL_LEVELS)}.")
    return word


def _initial_state(made: StageResults, asked: Mapping[str, Any], before: AssembleConfig) -> AssembleConfig:
    """Return how objects begin: what is not asked for is as it was."""
    changes = asked.get("objects", {})
    if not isinstance(changes, dict):
        raise UserError("The changes of objects are no table.")
    lift, velocity = (dict(map(parse_lift, before.lift)), dict(map(parse_initial_velocity, before.velocity)))
    objects = made.assembled.scene.objects
    for name, change in changes.items():
        k = int(name) if str(name).isdecimal() else -1
        if not 0 <= k < len(objects) or not isinstance(change, dict):
            raise UserError(f"There is no object {name!r}.")
        if "lift" in change:
            lift[objects[k].name] = finite_number(change["lift"], "The lift")
        if "velocity" in change:
            said = change["velocity"]
            if not isinstance(said, list) or len(said) != 3:
                raise UserError("A velocity is not three numbers.")
            x, y, z = (finite_number(x, "A velocity") for x in said)
            velocity[objects[k].name] = (x, y, z)
    return replace(
        before,
        drop=finite_number(asked.get("drop", before.drop), "The drop"),
        lift=tuple(f"{name}={metres:g}" for name, metres in lift.items()),
        velocity=tuple(f"{name}={x:g},{y:g},{z:g}" for name, (x, y, z) in velocity.items()),
    )


def finite_number(value: Any, what: str) -> float:
    """Return a finite number that a page sent; ``what`` names it.

    Raises:
        UserError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UserError(f"{what} is no number.")
    return float(value)


def _annotations(made: StageResults, parts: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
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
        material = find_material(str(change.get("material", field.materials[k].name))).name
        annotation: dict[str, Any] = {"material": material}
        if values := change.get("values"):
            annotation["values"] = _values(material, values)
        annotations.setdefault(scene.objects[part.object].name, {})[part.name] = annotation
    return annotations


def _values(material: str, values: Any) -> dict[str, float]:
    """Return values under the keys of an annotation; each inside its measured range."""
    ranges, out = find_material(material).ranges, {}
    for name, value in values.items() if isinstance(values, dict) else ():
        if name not in ranges or QUANTITIES[name].unit not in UNIT_KEY_SUFFIXES:
            raise UserError(f"{name!r} of {material} cannot be changed.")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UserError(f"{name} of {material} is no number.")
        low, high = ranges[name].low, ranges[name].high
        if not low * (1 - 1e-6) <= value <= high * (1 + 1e-6):
            raise UserError(f"{name} of {material} lies outside its range, {low:g} to {high:g}.")
        key = f"{KEY_STEM_OF_FIELD.get(name, name)}{UNIT_KEY_SUFFIXES[QUANTITIES[name].unit]}"
        out[key] = min(max(float(value), low), high)
    return out


def _merge_annotations(old: Any, new: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the annotations of a file with new ones in their place."""
    merged = dict(old) if isinstance(old, dict) else {}
    for owner, parts in new.items():
        before = merged.get(owner)
        whole = {} if before is None else before if isinstance(before, dict) else {"material": before}
        merged[owner] = {**whole, "parts": {**whole.get("parts", {}), **parts}}
    return merged
