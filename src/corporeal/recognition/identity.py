"""Which surfaces make one part: what the file itself says, by node, mesh and material."""

import re
import unicodedata
import zlib
from collections.abc import Callable, Collection, Hashable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Int

from corporeal.core.types import SUBSTANCE, Finish, Part, Scene, Surface
from corporeal.recognition.letters import letter_runs, says_something

NOISE = frozenset(
    "a aws blinn circle collada common cone001 cube curve cylinder default defaultmaterial "
    "diffuse export fbx finish fx geom geometry glb gltf grp group high id imported instance "
    "lambert lib lod low lp mat material materials matte mesh meshes model models nd node none "
    "nurbspath obj object objects part phong piece plain plane poly prim primitive residential "
    "root rootnode scene shader shape sketchfab sp sphere standard surface textured texture "
    "textures untitled uv vert visual collision wire x y z".split()
)
"""Words that exporters write whatever the object is."""
SPLIT = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")
"""Of a run of Latin letters without accents; in other runs a capital begins a word."""

Hint = Callable[[Surface, Finish], str]


@dataclass(frozen=True)
class Identity:
    """The parts of a scene, segmented by identity."""

    catalogue: tuple[Part, ...]
    """Object by object, in the scene's order."""
    part_of_surface: Int[np.ndarray, " S"]

    def surfaces(self, part: int) -> list[int]:
        """Numbers of the surfaces that make up one part."""
        return np.flatnonzero(self.part_of_surface == part).tolist()


def words(name: str, phrases: Collection[tuple[str, ...]] = ()) -> list[str]:
    """Split a name into lower-case words, without what exporters write.

    ``"M_LeatherParts.001"`` gives ``["leather", "parts"]``.

    Args:
        name: Of a node, a mesh, a finish or a file.
        phrases: Of two words in which such a word means something: "yoga mat", "ice cube".

    """
    found = [w.lower() for run in letter_runs(name) for w in _cut(run)]
    pairs = [pair in phrases for pair in pairwise(found)]
    meant = [a or b for a, b in zip([False, *pairs], [*pairs, False], strict=True)]
    return [w for w, m in zip(found, meant, strict=False) if m or _means(w)]


def _means(word: str) -> bool:
    return says_something(word) and word not in NOISE


def _cut(run: str) -> list[str]:
    """Cut a run of letters where a capital stands behind a small letter."""
    if run.isascii():
        return SPLIT.findall(run)
    inner = range(1, len(run))
    cuts = [0, *(k for k in inner if run[k - 1].islower() and run[k].isupper()), len(run)]
    return [run[a:b] for a, b in pairwise(cuts)]


def plain(text: str) -> str:
    """Return a text without accents: "Mülltonne" as "Mulltonne"."""
    apart = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return "".join(c for c in apart if not unicodedata.combining(c))


def identify(scene: Scene, hint: Hint = lambda surface, finish: "") -> Identity:
    """Tell the parts of every object apart.

    A node whose extras state a substance is a part. Other surfaces of an object form one part when
    they wear the same finish, unless ``hint`` (what the names say of the matter) differs.
    """
    looks = [_look(finish) for finish in scene.finishes]
    members = _members(scene)
    catalogue: list[Part] = []
    part_of_surface = np.zeros(len(scene.surfaces), dtype=np.int64)
    for number in range(len(scene.objects)):
        groups = _groups(scene, members[number], looks, hint)
        names = _names(scene, number, groups)
        for (key, surfaces), name in zip(groups.items(), names, strict=True):
            found_by = "whole object" if len(groups) == 1 else str(key[0])
            part_of_surface[surfaces] = len(catalogue)
            catalogue.append(Part(name, number, found_by))
    return Identity(tuple(catalogue), part_of_surface)


def _members(scene: Scene) -> list[list[int]]:
    members: list[list[int]] = [[] for _ in scene.objects]
    for k, surface in enumerate(scene.surfaces):
        members[surface.object].append(k)
    return members


def _groups(
    scene: Scene, members: list[int], looks: list[Hashable], hint: Hint
) -> dict[tuple[Hashable, ...], list[int]]:
    groups: dict[tuple[Hashable, ...], list[int]] = {}
    for k in members:
        surface = scene.surfaces[k]
        stated = surface.extras.get(SUBSTANCE)
        key = (
            ("node", surface.name, str(stated))
            if stated
            else (
                "material",
                looks[surface.finish],
                hint(surface, scene.finishes[surface.finish]),
            )
        )
        groups.setdefault(key, []).append(k)
    return groups


def _look(finish: Finish) -> Hashable:
    """Two finishes that differ in a running number only are one."""
    picture = None if finish.texture is None else zlib.crc32(finish.texture[::8, ::8].tobytes())
    numbers = (*finish.colour, finish.metallic, finish.roughness, finish.transmission, finish.glow)
    plain = re.sub(r"[\W\d_]+", "", finish.name).lower()
    return (plain, tuple(round(x, 3) for x in numbers), finish.alpha_mode, picture)


def _names(scene: Scene, number: int, groups: dict) -> list[str]:
    """Name each part as its file does, where that says anything; otherwise after the object."""
    thing, names = scene.objects[number], []
    for surfaces in groups.values():
        first = scene.surfaces[surfaces[0]]
        finish = scene.finishes[first.finish].name
        own = (first.name,) if first.extras.get(SUBSTANCE) else _order(first, finish, surfaces)
        named = next((n for n in own if words(n)), "")
        whole = thing.class_name or thing.name
        if len(groups) == 1:
            named = named if first.extras.get(SUBSTANCE) and named else whole
        names.append(named or f"{whole} part")
    return _distinct(names)


def _order(first: Surface, finish: str, surfaces: list[int]) -> tuple[str, ...]:
    """One surface goes by its own name, several by the finish they share."""
    return (
        (first.name, finish) if len(surfaces) == 1 and words(first.name) else (finish, first.name)
    )


def _distinct(names: list[str]) -> list[str]:
    counts: dict[str, int] = {}
    numbered = []
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        again = names.count(name) > 1
        numbered.append(f"{name} {counts[name]}" if again else name)
    return numbered
