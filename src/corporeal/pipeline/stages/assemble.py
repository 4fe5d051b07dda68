"""Assemble: place the objects of the input files in one scene, in metres."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import ObjectGrouping, Scene, SceneObject
from corporeal.discretization.object_scaling import parse_extent
from corporeal.geometry import box_placement
from corporeal.geometry.gaussian_transforms import UpAxis
from corporeal.geometry.scene_transforms import (
    convert_scene_unit,
    move_scene,
    object_boxes,
    overlapping_objects,
    resize_object,
    scale_scene,
    surfaces_bounding_box,
)
from corporeal.io.input_files import images_in_folder, is_scene_file, model_files_in, read_scene, videos_in_folder
from corporeal.io.load_model import MeshFrame, load_model, readable_model_formats
from corporeal.io.scene_toml import ObjectEntry, SceneFile
from corporeal.pipeline.settings import AssembleConfig, validate_assemble
from corporeal.recognition.length_unit_inference import InferredUnit, infer_length_unit, infer_shared_unit, unit_notes
from corporeal.recognition.readable_names import safe_name, unique_names
from corporeal.recognition.typical_extents import extent_warning
from corporeal.scene.initial_state import with_initial_state

MIN_DURATION_S, MAX_DURATION_S = 1.0, 3.0
"""Bounds of the default duration [s]."""
DEFAULT_FPS = 30
"""Default frames per second of the video."""


DEFAULT_CONFIG = AssembleConfig()


@dataclass(frozen=True)
class _FileObjects:
    """The objects of one file, which keep their arrangement among themselves."""

    scene: Scene
    ours: bool
    entry: ObjectEntry | None
    """The scene file's entry for the whole file; None: it is the scene file's ``file``."""
    metric: bool = True
    """Whether its lengths are metres; else the unit is not stated."""


def assemble(inputs: Sequence[Path], config: AssembleConfig = DEFAULT_CONFIG, up: UpAxis | None = None) -> Scene:
    """Return one scene from models, a folder of them, or one ``scene.toml``.

    Args:
        inputs: Input paths.
        config: How.
        up: Up axis of mesh files; None: as stated, or as usual for the format.

    Raises:
        UserError: A file cannot be used, or the options don't fit what the files hold.
    """
    validate_assemble(config)
    plan = _scene_file_for([Path(p) for p in inputs])
    frame = MeshFrame(up, config.unit)
    blocks = _apply_extents(_unique_names(_read(plan, config.objects, frame)), config.extent)
    scene = _merge_blocks(plan, _place_blocks(blocks, plan, config.stack))
    scene = _at_working_extent(scene, config.working_extent)
    scene = with_initial_state(_lift_objects(scene, config.drop), config.lift, config.velocity)
    return _with_timing(_with_overlaps_named(scene), blocks, plan, config)


def _scene_file_for(inputs: list[Path]) -> SceneFile:
    """Return a scene file for the inputs."""
    if not inputs:
        raise UserError("No input. Name a model, several of them, or a scene.toml.")
    if any(map(is_scene_file, inputs)):
        if len(inputs) > 1:
            step = "Name the models in the scene file instead."
            raise BadFileError(inputs[0], "a scene file stands alone.", step)
        return read_scene(inputs[0])
    files = [f for p in inputs for f in (_models_in(p) if p.is_dir() else [p])]
    if len(files) == 1:
        return SceneFile(files[0], file=files[0])
    return SceneFile(inputs[0], objects=tuple(ObjectEntry(file=f) for f in files))


def _models_in(folder: Path) -> list[Path]:
    found = model_files_in(folder)
    if found:
        return found
    if pictures := images_in_folder(folder):
        places = list(dict.fromkeys(str(picture.parent) for picture in pictures))
        what = f"the folder holds {len(pictures)} pictures and no model. They lie in {places[0]}"
        step = "Name that folder, to reconstruct what they show."
        if len(places) > 1:
            what += f" and {len(places) - 1} more folders"
            step = "Put the photographs of one object into one folder, and name that."
        raise BadFileError(folder, f"{what}.", step)
    if videos := videos_in_folder(folder):
        what = f"the folder holds {len(videos)} videos and no model."
        raise BadFileError(folder, what, f"Name the video itself: {videos[0]}.")
    step = "Name a model, a folder of models, or photographs with poses."
    raise BadFileError(folder, f"the folder holds no model ({readable_model_formats()}) and no pictures.", step)


def _read(plan: SceneFile, objects: ObjectGrouping, frame: MeshFrame) -> list[_FileObjects]:
    """Read every file once per use, with what the scene file states of its objects."""
    blocks = []
    if plan.file is not None:
        model = load_model(plan.file, objects, frame)
        blocks.append(_FileObjects(model.scene, model.ours, None, model.metric))
    for entry in plan.objects:
        if entry.file is None:
            blocks[0] = replace(blocks[0], scene=_apply_entry(blocks[0].scene, entry, plan))
            continue
        single = entry.name or entry.class_name or entry.extent
        model = load_model(entry.file, "one" if single else objects, frame)
        scene = model.scene
        for k in range(len(scene.objects)):
            scene = _with_object(scene, k, entry)
        metric = model.metric or entry.extent is not None
        blocks.append(_FileObjects(scene, model.ours, entry, metric))
    return blocks


def _apply_entry(scene: Scene, entry: ObjectEntry, plan: SceneFile) -> Scene:
    """Apply an entry to the object of the scene's own file that it names."""
    names = [o.name for o in scene.objects]
    if entry.name not in names:
        step = f"Choose one of: {', '.join(names)}."
        raise BadFileError(plan.path, f"{plan.file} has no object {entry.name!r}.", step)
    return _with_object(scene, names.index(entry.name), entry)


def _with_object(scene: Scene, k: int, entry: ObjectEntry) -> Scene:
    obj = scene.objects[k]
    obj = replace(
        obj,
        name=entry.name or obj.name,
        class_name=entry.class_name or obj.class_name,
        velocity=entry.velocity or obj.velocity,
        push=entry.push or obj.push,
        wind=entry.wind or obj.wind,
        path=entry.path or obj.path,
    )
    objects = (*scene.objects[:k], obj, *scene.objects[k + 1 :])
    scene = replace(scene, objects=objects)
    return scene if entry.extent is None else resize_object(scene, k, entry.extent)


def _unique_names(blocks: list[_FileObjects]) -> list[_FileObjects]:
    """Return the blocks with names that occur once in the whole scene."""
    names = iter(unique_names([safe_name(o.name) for b in blocks for o in b.scene.objects]))
    return [
        replace(b, scene=replace(b.scene, objects=tuple(replace(o, name=next(names)) for o in b.scene.objects)))
        for b in blocks
    ]


def _apply_extents(blocks: list[_FileObjects], extents: tuple[str, ...]) -> list[_FileObjects]:
    """Scale objects to the extents asked for, and warn of implausible ones."""
    alone = len(blocks) == len(blocks[0].scene.objects) == 1
    only = blocks[0].scene.objects[0].name if alone else ""
    wanted = [parse_extent(text, only) for text in extents]
    used, blocks = set(), _in_metres(blocks, dict(wanted))
    for i, block in enumerate(blocks):
        scene, messages = block.scene, []
        for k, obj in enumerate(scene.objects):
            hits = [w for w in wanted if _matches_object(w[0], obj)]
            used.update(hits)
            said = block.entry is not None and block.entry.extent is not None
            if hits:
                scene = resize_object(scene, k, hits[-1][1])
            elif said:  # set by the scene file
                continue
            elif sentence := extent_warning(obj.name, obj.class_name, obj.real_extent):
                messages.append(sentence)
        messages = [s for s in messages if not block.ours]
        blocks[i] = replace(block, scene=replace(scene, warnings=(*scene.warnings, *messages)))
    for name, _ in wanted:
        if name not in {n for n, _ in used}:
            names = [o.name for b in blocks for o in b.scene.objects]
            raise UserError(f"--extent: no object {name!r}. Choose one of: {', '.join(names)}.")
    return blocks


def _in_metres(blocks: list[_FileObjects], wanted: Mapping[str, float]) -> list[_FileObjects]:
    """Find the units of files that state none, by an extent asked for or by their sizes."""
    blocks = [b if b.metric else _scaled_to_extent(b, wanted) for b in blocks]
    alone = {i: _with_likely_unit(b) for i, b in enumerate(blocks) if not b.metric}
    found = []
    for i, guess in alone.items():
        block, largest = blocks[i], _largest_object(blocks[i])
        file = Path(block.scene.source)
        if block.entry is not None and block.entry.position is not None:
            others = (other for k, other in alone.items() if k != i)
            guess = infer_shared_unit(guess, file, largest.real_extent, others)
        if guess is None:
            what = f"states no unit, and {largest.name} is {largest.real_extent:.4g} units large."
            step = "Give --unit, or --extent NAME=METRES."
            raise BadFileError(file, what, step)
        found.append(guess)
        blocks[i] = replace(block, scene=convert_scene_unit(block.scene, guess.metres), metric=True)
    first = blocks[0].scene
    notes = (*first.warnings, *unit_notes(found))
    return [replace(blocks[0], scene=replace(first, warnings=notes)), *blocks[1:]]


def _scaled_to_extent(block: _FileObjects, wanted: Mapping[str, float]) -> _FileObjects:
    """Return a block in metres if the extent of one of its objects is given."""
    for thing in block.scene.objects:
        asked = [extent for name, extent in wanted.items() if _matches_object(name, thing)]
        if asked:
            scene = convert_scene_unit(block.scene, asked[-1] / thing.real_extent)
            return replace(block, scene=scene, metric=True)
    return block


def _with_likely_unit(block: _FileObjects) -> InferredUnit | None:
    thing = _largest_object(block)
    return infer_length_unit(Path(block.scene.source), thing.class_name, thing.real_extent)


def _largest_object(block: _FileObjects) -> SceneObject:
    return max(block.scene.objects, key=lambda o: o.real_extent)


def _matches_object(words: str, obj: SceneObject) -> bool:
    """Return whether these words name this object."""
    asked = set(words.lower().replace("_", " ").split())
    exactly = words in (obj.name, Path(obj.source).stem)
    return exactly or asked <= set(obj.class_name.lower().split())


def _at_working_extent(scene: Scene, extent: float | None) -> Scene:
    """Scale everything about the origin, which lies on the floor."""
    if extent is None:
        return scene
    return scale_scene(scene, extent / float(np.ptp(surfaces_bounding_box(scene.surfaces), axis=0).max()))


def _place_blocks(blocks: list[_FileObjects], plan: SceneFile, stack: bool) -> list[_FileObjects]:
    """Move each block to its position, or onto the floor beside or above the others."""
    free = [i for i, b in enumerate(blocks) if b.entry and b.entry.position is None]
    fixed = [i for i in range(len(blocks)) if i not in free]
    for i in fixed:
        blocks[i] = replace(blocks[i], scene=_place_as_stated(blocks[i], plan))
    if not free:
        return blocks
    boxes = np.stack([surfaces_bounding_box(blocks[i].scene.surfaces) for i in free])
    shifts = box_placement.stack_shifts(boxes) if stack else box_placement.row_shifts(boxes)
    if fixed:
        right = max(surfaces_bounding_box(blocks[i].scene.surfaces)[1, 0] for i in fixed)
        width = (boxes + shifts[:, None])[..., 0]
        shifts[:, 0] += right - width.min() + box_placement.ROW_GAP_FRACTION * np.ptp(width)
    for i, shift in zip(free, shifts, strict=True):
        blocks[i] = replace(blocks[i], scene=move_scene(blocks[i].scene, shift))
    return blocks


def _place_as_stated(block: _FileObjects, plan: SceneFile) -> Scene:
    """Return a block where the scene file puts it, or as its own file poses it, above the floor."""
    scene = block.scene
    box = surfaces_bounding_box(scene.surfaces)
    if block.entry is not None and block.entry.position is not None:
        return move_scene(scene, box_placement.floor_shifts(box[None])[0] + block.entry.position)
    if len(scene.objects) == 1 and not block.ours:
        scene = move_scene(scene, box_placement.floor_shifts(box[None])[0])
    elif box[0, 2] < 0 or not block.ours:
        scene = move_scene(scene, np.array([0.0, 0.0, -box[0, 2]]))
    names = [o.name for o in scene.objects]
    for entry in plan.objects:
        if entry.file is None and entry.position is not None:
            k = names.index(safe_name(entry.name or ""))
            own = surfaces_bounding_box([s for s in scene.surfaces if s.object == k])
            scene = move_scene(scene, box_placement.floor_shifts(own[None])[0] + entry.position, k)
    return scene


def _lift_objects(scene: Scene, drop: float) -> Scene:
    """Lift every object by a multiple of its size above its support."""
    if drop == 0:
        return scene
    for k, rise in enumerate(box_placement.lift_heights(object_boxes(scene), drop)):
        scene = move_scene(scene, np.array([0.0, 0.0, rise]), k)
    return scene


def _with_overlaps_named(scene: Scene) -> Scene:
    """Warn of overlapping objects: they would burst apart."""
    pairs = ((scene.objects[a].name, scene.objects[b].name) for a, b in overlapping_objects(scene))
    messages = tuple(f"{a} and {b} overlap at the start." for a, b in pairs)
    return replace(scene, warnings=scene.warnings + messages)


def _merge_blocks(plan: SceneFile, blocks: list[_FileObjects]) -> Scene:
    objects, surfaces, finishes, warnings, hints = [], [], [], [], []
    for scene in (b.scene for b in blocks):
        o, f = len(objects), len(finishes)
        surfaces += [replace(s, object=s.object + o, finish=s.finish + f) for s in scene.surfaces]
        objects += scene.objects
        finishes += scene.finishes
        warnings += scene.warnings
        hints += scene.hints
    return Scene(
        name=_title(plan, blocks),
        source=str(plan.path),
        objects=tuple(objects),
        surfaces=tuple(surfaces),
        finishes=tuple(finishes),
        walls=plan.walls,
        warnings=tuple(dict.fromkeys(warnings)),
        hints=tuple(dict.fromkeys(hints)),
    )


def _title(plan: SceneFile, blocks: list[_FileObjects]) -> str:
    """Return the scene's name: the scene file's, or its folder's, or the models'."""
    if is_scene_file(plan.path):
        return scene_title(plan.path)
    return safe_name("-".join(b.scene.name for b in blocks))[:60] or "scene"


def scene_title(path: Path) -> str:
    """Return what the scene of a scene file is called."""
    return safe_name(path.resolve().parent.name if path.stem == "scene" else path.stem) or "scene"


def _with_timing(scene: Scene, blocks: list[_FileObjects], plan: SceneFile, config: AssembleConfig) -> Scene:
    """Set gravity, duration and the like: the options first, then the scene file, then our GLB."""
    own = blocks[0].scene if len(blocks) == 1 and blocks[0].ours else None
    scene = replace(
        scene,
        gravity=plan.gravity or (own or scene).gravity,
        walls=(*scene.walls, *(own.walls if own else ())),
        fps=config.fps or plan.fps or (own.fps if own else DEFAULT_FPS),
        settled=(own or scene).settled if plan.settled is None else plan.settled,
    )
    raised = config.drop or config.lift  # long enough for the fall
    known = own.duration if own and not raised else None
    stated = config.duration or plan.duration or known
    return replace(scene, duration=stated or _default_duration(scene))


def _default_duration(scene: Scene) -> float:
    """Return three times the longest fall and a second more [s], and at least until the last force ends."""
    fall = 0.0
    g = -scene.gravity[2]
    for obj, height in zip(scene.objects, object_boxes(scene)[:, 0, 2], strict=True):
        v = obj.velocity[2]
        if g > 0:
            fall = max(fall, (v + math.sqrt(v * v + 2 * g * max(height, 0.0))) / g)
    forces = [f for o in scene.objects for f in (o.push, o.wind) if f is not None]
    ends = [f.end for f in forces if math.isfinite(f.end)]
    ends += [o.path.time[-1] for o in scene.objects if o.path is not None]
    forced = max(ends, default=0.0) + 0.5
    return round(max(min(max(3 * fall + 1, MIN_DURATION_S), MAX_DURATION_S), forced), 1)
