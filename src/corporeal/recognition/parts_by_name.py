"""Grouping of surfaces into parts by node, mesh and material of the file."""

import re
import unicodedata
import zlib
from collections.abc import Callable, Collection, Hashable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Int

from corporeal.core.types import SUBSTANCE_KEY, Finish, Part, Scene, Surface
from corporeal.recognition.readable_names import has_meaning, letter_runs

EXPORTER_WORDS = frozenset(
    "a aws blinn circle collada common cone001 cube curve cylinder default defaultmaterial "
    "diffuse export fbx finish fx geom geometry glb gltf grp group high id imported instance "
    "lambert lib lod low lp mat material materials matte mesh meshes model models nd node none "
    "nurbspath obj object objects part phong piece plain plane poly prim primitive residential "
    "root rootnode scene shader shape sketchfab sp sphere standard surface textured texture "
    "textures untitled uv vert visual collision wire x y z".split()
)
"""Words that exporters write whatever the object is."""
CAMEL_CASE_PATTERN = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")
"""Of a run of Latin letters without accents; in other runs a capital begins a word."""

GroupHint = Callable[[Surface, Finish], str]


@dataclass(frozen=True)
class PartsByName:
    """The parts of a scene, segmented by identity."""

    catalogue: tuple[Part, ...]
    """Object by object, in the scene's order."""
    part_of_surface: Int[np.ndarray, " S"]

    def surfaces(self, part: int) -> list[int]:
        """Numbers of the surfaces that make up one part."""
        return np.flatnonzero(self.part_of_surface == part).tolist()


def name_words(name: str, phrases: Collection[tuple[str, ...]] = ()) -> list[str]:
    """Split a name into lower-case words, without what exporters write.

    ``"M_LeatherParts.001"`` gives ``["leather", "parts"]``.

    Args:
        name: Of a node, a mesh, a finish or a file.
        phrases: Of two words in which such a word means something: "yoga mat", "ice cube".
    """
    found = [w.lower() for run in letter_runs(name) for w in _cut_camel_case(run)]
    pairs = [pair in phrases for pair in pairwise(found)]
    meant = [a or b for a, b in zip([False, *pairs], [*pairs, False], strict=True)]
    return [w for w, m in zip(found, meant, strict=False) if m or _is_meaningful_word(w)]


def _is_meaningful_word(word: str) -> bool:
    return has_meaning(word) and word not in EXPORTER_WORDS


def _cut_camel_case(run: str) -> list[str]:
    """Cut a run of letters where a capital follows a small letter."""
    if run.isascii():
        return CAMEL_CASE_PATTERN.findall(run)
    inner = range(1, len(run))
    cuts = [0, *(k for k in inner if run[k - 1].islower() and run[k].isupper()), len(run)]
    return [run[a:b] for a, b in pairwise(cuts)]


def strip_accents(text: str) -> str:
    """Return a text without accents: "Mülltonne" as "Mulltonne"."""
    apart = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return "".join(c for c in apart if not unicodedata.combining(c))


def identify_parts(scene: Scene, hint: GroupHint = lambda surface, finish: "") -> PartsByName:
    """Identify the parts of every object.

    A node whose extras state a substance is a part. Other surfaces of an object form one part when they wear the same
    finish, unless ``hint`` (what the names say of the material) differs.
    """
    looks = [_finish_key(finish) for finish in scene.finishes]
    members = _object_surfaces(scene)
    catalogue: list[Part] = []
    part_of_surface = np.zeros(len(scene.surfaces), dtype=np.int64)
    for number in range(len(scene.objects)):
        groups = _surface_groups(scene, members[number], looks, hint)
        names = _part_names(scene, number, groups)
        for (key, surfaces), name in zip(groups.items(), names, strict=True):
            found_by = "whole object" if len(groups) == 1 else str(key[0])
            part_of_surface[surfaces] = len(catalogue)
            catalogue.append(Part(name, number, found_by))
    return PartsByName(tuple(catalogue), part_of_surface)


def _object_surfaces(scene: Scene) -> list[list[int]]:
    members: list[list[int]] = [[] for _ in scene.objects]
    for k, surface in enumerate(scene.surfaces):
        members[surface.object].append(k)
    return members


def _surface_groups(
    scene: Scene, members: list[int], looks: list[Hashable], hint: GroupHint
) -> dict[tuple[Hashable, ...], list[int]]:
    groups: dict[tuple[Hashable, ...], list[int]] = {}
    for k in members:
        surface = scene.surfaces[k]
        stated = surface.extras.get(SUBSTANCE_KEY)
        key = (
            ("node", surface.name, str(stated))
            if stated
            else ("material", looks[surface.finish], hint(surface, scene.finishes[surface.finish]))
        )
        groups.setdefault(key, []).append(k)
    return groups


def _finish_key(finish: Finish) -> Hashable:
    """Two finishes that differ in a running number only are one."""
    picture = None if finish.texture is None else zlib.crc32(finish.texture[::8, ::8].tobytes())
    numbers = (*finish.colour, finish.metallic, finish.roughness, finish.transmission, finish.emission)
    plain = re.sub(r"[\W\d_]+", "", finish.name).lower()
    return (plain, tuple(round(x, 3) for x in numbers), finish.alpha_mode, picture)


def _part_names(scene: Scene, number: int, groups: dict) -> list[str]:
    """Name each part as its file does, where that says anything; otherwise after the object."""
    thing, names = scene.objects[number], []
    for surfaces in groups.values():
        first = scene.surfaces[surfaces[0]]
        finish = scene.finishes[first.finish].name
        own = (first.name,) if first.extras.get(SUBSTANCE_KEY) else _name_candidates(first, finish, surfaces)
        named = next((n for n in own if name_words(n)), "")
        whole = thing.class_name or thing.name
        if len(groups) == 1:
            named = named if first.extras.get(SUBSTANCE_KEY) and named else whole
        names.append(named or f"{whole} part")
    return _distinct_names(names)


def _name_candidates(first: Surface, finish: str, surfaces: list[int]) -> tuple[str, ...]:
    """One surface goes by its own name, several by the finish they share."""
    return (first.name, finish) if len(surfaces) == 1 and name_words(first.name) else (finish, first.name)


def _distinct_names(names: list[str]) -> list[str]:
    counts: dict[str, int] = {}
    numbered = []
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        again = names.count(name) > 1
        numbered.append(f"{name} {counts[name]}" if again else name)
    return numbered
