"""Everyday words from file, node and mesh names."""

import re
import unicodedata
from collections.abc import Sequence
from itertools import groupby


def compose_accents(name: str) -> str:
    """Return a name with each accented letter as one character, however a file system wrote it."""
    return unicodedata.normalize("NFC", name)


def is_letter(character: str) -> bool:
    """Return whether a character is a letter, or a mark that belongs to one (a vowel sign)."""
    return unicodedata.category(character)[0] in "LM"


def is_ideograph(character: str) -> bool:
    """Return whether a character is a word by itself, as in Chinese and Japanese."""
    return unicodedata.name(character, "").startswith("CJK ")


def letter_runs(name: str) -> list[str]:
    """Return the unbroken runs of letters in a name: ``"013_Größe.x"`` gives Größe and x."""
    return ["".join(run) for letter, run in groupby(compose_accents(name), is_letter) if letter]


def has_meaning(word: str) -> bool:
    """Return whether a word has two letters or more, or is an ideograph."""
    return len(word) > 1 or (word != "" and is_ideograph(word))


VENDOR_WORDS = frozenset(
    "khronos smallhouse kenney gazebo kaolin polyhaven market gso playcanvas bullet aws robomaker "
    "residential sketchfab ycb objaverse abo chefmate google scanned collada blender maya".split()
)
"""Where models come from says nothing about what they are."""
FILLER_WORDS = frozenset(
    "notex visual textured texture model mesh meshes scene root node object obj geometry geom lib "
    "lowpoly lp low poly high hp lod final copy export untitled default material mat group fbx dae "
    "gltf glb draft version defaultmaterial rootnode nonetype the a an".split()
)


def everyday_words(name: str) -> str:
    """Return the words of a name that say what an object is: "soda can coke"; may be empty.

    Words of any alphabet are kept.
    """
    name = re.sub(r"\.[A-Za-z0-9]{2,4}$", "", name)
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = [w.lower() for w in letter_runs(name)]
    kept = [w for w in words if has_meaning(w) and w not in VENDOR_WORDS and w not in FILLER_WORDS]
    return " ".join(kept)[:60].strip()


def safe_name(name: str) -> str:
    """Return a name that can stand in a path or a table: word characters, spaces, dots, dashes."""
    plain = (c if is_letter(c) or re.match(r"[\w .()-]", c) else "\0" for c in compose_accents(name))
    return re.sub("\0+", "_", "".join(plain)).strip(" .")[:80]


def single_line_text(text: str) -> str:
    """Return a text that any file, program and terminal takes: one line, no half characters."""
    line = re.sub(r"[\x00-\x1f\x7f\s]+", " ", text).strip()
    return line.encode("utf-8", "replace").decode("utf-8")


def unique_names(names: list[str]) -> list[str]:
    """Return the names, later doubles counted up ("duck_0", "duck_1"), so that each occurs once."""
    taken: set[str] = set()
    result = []
    for name in names:
        stem, k, fresh = re.sub(r"_\d+$", "", name), 1, name
        while fresh in taken:
            fresh, k = f"{stem}_{k}", k + 1
        taken.add(fresh)
        result.append(fresh)
    return result


def numbered_names(classes: Sequence[str], titles: Sequence[str] = ()) -> list[str]:
    """Return a node name ``<class>_<k>`` for each class.

    Args:
        classes: What each object is, in words.
        titles: What each is called in its file. Where all of a class end in numbers of their own ("block_10",
            "block_11"), these are kept: a scene file that names them means them. Otherwise k counts from 0.
    """
    stems = [safe_name(words).replace(" ", "_") or "object" for words in classes]
    own = [re.search(r"(\d{1,6})$", title) for title in titles] or [None] * len(stems)
    members: dict[str, list[int]] = {}
    for k, stem in enumerate(stems):
        members.setdefault(stem, []).append(k)
    names = list(stems)
    for stem, mine in members.items():
        ends = [int(found[1]) for k in mine if (found := own[k]) is not None]
        kept = len(mine) > 1 and len(set(ends)) == len(mine)
        for k, number in zip(mine, ends if kept else range(len(mine)), strict=True):
            names[k] = f"{stem}_{number}"
    return unique_names(names)
