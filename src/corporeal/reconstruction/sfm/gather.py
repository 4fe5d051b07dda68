"""Photographs made ready to be posed: upright, of moderate size, each once, and their masks."""

import numbers
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.io.images import FORMATS, MAX_PIXELS, eight_bit
from corporeal.io.photographs import INSTANCES, MASKS, companion, unused_masks
from corporeal.io.shots import FEWEST, Bad, across, left_out, unreadable
from corporeal.io.sources import below, not_read_below, not_read_beside, photographs_in
from corporeal.recognition.words import safe, writable

Progress = Callable[[float, str], None]

LONGEST = 1600
"""Longer side of what points are looked for in [px]."""
MOST = 120
"""Photographs; of more, one is taken of each so many."""
GOLDEN = (5**0.5 - 1) / 2
"""Multiples of it, less their whole numbers, fill 0 to 1 evenly and never repeat."""
THUMBNAIL = (24, 24)
SAME = 0.5
"""Mean difference of thumbnails, of 255, below which two show the same from the same place."""
BLANK = 2.0
"""Standard deviation of a thumbnail, of 255, below which there is nothing on it."""
EXIF, FILM_FOCAL = 0x8769, 0xA405
"""Tags of EXIF: where its own tags lie; the focal length as on 35 mm film."""
MAKER = (0x010F, 0x0110)
"""Tags of who made a camera, and of its model."""
OF_LENS = (FILM_FOCAL, 0x920A, 0xA20E, 0xA210, 0xA002, 0xA003)
"""Its own tags that say how long a lens is: in mm, and in pixels of a picture so wide and high."""
LONGEST_WORD = 64
"""Of a tag that is copied, in letters: a camera's name has no more."""
CLEAR = 255
"""Alpha of what is not transparent."""
HALF = 127
"""Alpha above which it is rather seen than not."""
STRIP = 2.4
"""Longer side over the shorter, above which a picture is no camera's: films have 21 : 9. For one
of 1600 × 120 a lens was found that nobody has, and 24 good photographs were refused with it."""
QUALITY = 95
"""Of JPEG copies."""
IMAGES = "images"
TAKE = "Take 40 to 80 photographs of the thing from all around."


@dataclass(frozen=True)
class Gathered:
    """Photographs as they lie in the folder ``images``."""

    names: tuple[str, ...]
    sizes: tuple[tuple[int, int], ...]
    """Width and height of each [px]."""
    said: tuple[str, ...]
    """What was left out, and why, in sentences."""
    doubled: bool = True
    """Whether points are looked for in pictures of twice their size, too, where small ones are."""
    pairs: tuple[tuple[int, int], ...] | None = None
    """Numbers of pictures that are matched with one another; None: as many as time allows."""
    reduced: tuple[float, ...] = ()
    """Length of each over that of its photograph [-]; none: all were as large."""


def gather(source: Path, folder: Path, progress: Progress) -> Gathered:
    """Copy the photographs of a folder, turned as their EXIF says, with their masks.

    Args:
        source: The folder.
        folder: Gets ``images``, and ``masks`` and ``instances`` where there are some.
        progress: Told the fraction done and what is being done.

    Raises:
        BadFileError: Too few can be used.

    """
    found = photographs_in(source)
    step = max(1, -(-len(found) // MOST))
    taken, bad, twins = spread(found, step), [], 0
    names: dict[str, tuple[int, int]] = {}
    reduced: list[float] = []
    cut_out: dict[str, Image.Image] = {}
    strips = _strips(taken)
    known = np.zeros((0, *THUMBNAIL))
    for number, file in enumerate(taken):
        progress(number / len(taken), "reading photographs")
        try:
            picture, alpha = _upright(file, file in strips)
            thumbnail = _thumbnail(picture)
            _check(thumbnail, known, list(names))
            masks = [_mask_of(file, source, kinds, picture.size) for kinds in (MASKS, INSTANCES)]
        except _UnusableError as problem:
            bad.append((writable(file.name), str(problem)))
            twins += isinstance(problem, _TwinError)
            continue
        known = np.concatenate([known, thumbnail[None]])
        name = _name(file, set(names))
        names[name] = picture.size
        reduced.append(picture.info["reduced"])
        _write(picture, folder / IMAGES / name)
        for kinds, mask in zip((MASKS, INSTANCES), masks, strict=True):
            if mask is not None:
                _write_mask(mask, folder / kinds[0] / f"{Path(name).stem}.png")
        if alpha is not None:
            cut_out[name] = alpha
    said = [
        *([f"Of {len(found)} photographs, one in {step} was used."] if step > 1 else []),
        *left_out(len(taken), bad),
        *not_read_beside(found),
        *not_read_below(source, found),
        *unused_masks(source, found),
        *_cropped(tuple(names.values())),
        *_write_alphas(cut_out, len(names), folder),
    ]
    _refuse_few(source, len(names), len(taken), bad, twins)
    return Gathered(tuple(names), tuple(names.values()), tuple(said), reduced=tuple(reduced))


def spread(found: Sequence[Path], step: int) -> list[Path]:
    """Return one of each so many that follow one another, at no fixed place among them.

    Two cameras, or two things by turns, would lie at equal steps, and one of them at all places.
    """
    firsts = range(0, len(found), step)
    offsets = (int(step * (k * GOLDEN % 1)) for k in range(len(firsts)))
    ends = (min(first + k, len(found) - 1) for first, k in zip(firsts, offsets, strict=True))
    return [found[k] for k in ends]


def _strips(files: Sequence[Path]) -> set[Path]:
    """Return the pictures that are too long for a camera's, if most are not."""
    long, known = set(), 0
    for file in files:
        if not file.is_file():  # a pipe would be waited for
            continue
        try:
            with Image.open(file, formats=FORMATS) as opened:
                size = opened.size
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
            continue  # whoever reads it says why
        known += 1
        if max(size) > STRIP * min(size):
            long.add(file)
    return long if len(long) < known / 2 else set()


def as_gathered(folder: Path) -> Gathered:
    """Return what was gathered into a folder before."""
    sizes = {}
    for file in sorted((folder / IMAGES).iterdir()):
        with Image.open(file, formats=FORMATS) as picture:
            sizes[file.name] = picture.size
    return Gathered(tuple(sizes), tuple(sizes.values()), ())


def lens_stated(picture: Path) -> float:
    """Return the focal length that a picture's EXIF states, as on 35 mm film [mm]; 0: none."""
    with Image.open(picture, formats=FORMATS) as opened:
        stated = opened.getexif().get_ifd(EXIF).get(FILM_FOCAL, 0)
    try:
        return float(stated)
    except (TypeError, ValueError, ZeroDivisionError):
        return 0.0


def sized_alone(sizes: Sequence[tuple[int, int]]) -> int:
    """Return how many pictures have a size of their own, if they are most; 0: cameras made them.

    Args:
        sizes: Width and height of each; held upright or level is one size.

    """
    counts = Counter((min(size), max(size)) for size in sizes)
    alone = sum(count == 1 for count in counts.values())
    return alone if alone >= FEWEST and alone > len(sizes) / 2 else 0


def _cropped(sizes: Sequence[tuple[int, int]]) -> list[str]:
    """Say what sizes say of how pictures were cropped, if they do."""
    if not (alone := sized_alone(sizes)):
        return []
    what = f"{alone} of {len(sizes)} photographs have a size that no other has"
    why = "of a picture that was cropped the middle is not where its lens looked"
    return [f"{what}: {why}, and poses are found less well."]


def _refuse_few(source: Path, good: int, asked: int, bad: list[Bad], twins: int) -> None:
    """Refuse what shows too little; that some show the same as others says nothing against these.

    Args:
        source: The folder.
        good: Photographs that can be used.
        asked: Those that were looked at.
        bad: Why the others cannot be used.
        twins: How many of them show the same as others.

    Raises:
        BadFileError: Too few are left, or most are broken or blank.

    """
    if good >= max(FEWEST, (asked - twins) / 2):
        return
    if not bad:
        count = "1 photograph is" if good == 1 else f"{good} photographs are"
        raise BadFileError(source, f"{count} too few to show a thing.", _elsewhere(source) or TAKE)
    why = f" The first of the others, {bad[0][0]}, {bad[0][1]}."
    count = f"only {good}" if good else "none"
    what = f"{count} of {asked} photographs can be used.{why}"
    raise BadFileError(source, what, TAKE)


def _elsewhere(source: Path) -> str:
    """Say where more pictures lie than in the folder itself; empty: nowhere."""
    own = photographs_in(source)
    more = below(source, own)
    if len(more) <= len(own):
        return ""
    return f"{len(more)} more lie in folders of it: name the one that is meant: {more[0].parent}."


class _UnusableError(Exception):
    """Why one photograph cannot be used, in a clause."""


class _TwinError(_UnusableError):
    """It shows the same as another, which is used."""


def _upright(file: Path, strip: bool = False) -> tuple[Image.Image, Image.Image | None]:
    """Return a photograph turned as it says, reduced, with what it says of its lens; its alpha."""
    if not file.is_file():
        raise _UnusableError("is no file, or a link to none")
    if strip:
        raise _UnusableError("is a strip, as a panorama is, which no one lens takes")
    why = unreadable(file)
    try:
        with Image.open(file, formats=FORMATS) as opened:
            why = "is damaged: its pixels cannot be read to the end"
            if opened.width * opened.height > MAX_PIXELS:
                raise _UnusableError(f"claims {opened.width} × {opened.height} pixels")
            longest = max(opened.size)
            opened.draft("RGB", (LONGEST, LONGEST))
            turned = ImageOps.exif_transpose(opened)
            exif = _of_lens(turned.getexif())
            picture = eight_bit(turned)
    except _UnusableError:
        raise
    except Exception as problem:  # Pillow's decoders raise almost anything on broken input
        raise _UnusableError(why) from problem
    picture.thumbnail((LONGEST, LONGEST), Image.Resampling.LANCZOS)
    alpha = picture.getchannel("A") if picture.mode == "RGBA" else None
    picture = picture.convert("RGB")
    # Nothing else that the file says: Pillow would copy comments.
    picture.info = {"exif": exif, "reduced": max(picture.size) / longest}
    return picture, alpha


def _of_lens(exif: Image.Exif) -> bytes:
    """Return what EXIF says of camera and lens, as EXIF; b"" where it says nothing.

    The rest is left out: it may be longer than a JPEG can hold, broken, or say where somebody
    lives.
    """
    kept = Image.Exif()
    own, of_lens = exif.get_ifd(EXIF), kept.get_ifd(EXIF)
    for tags, stated, copy in ((MAKER, exif, kept), (OF_LENS, own, of_lens)):
        copy.update({t: stated[t] for t in tags if t in stated and _is_short(stated[t])})
    return kept.tobytes() if len(kept) or of_lens else b""


def _is_short(stated: object) -> bool:
    return isinstance(stated, numbers.Number) or (
        isinstance(stated, str) and len(stated) <= LONGEST_WORD
    )


def _thumbnail(picture: Image.Image) -> np.ndarray:
    small = picture.convert("L").resize(THUMBNAIL, Image.Resampling.BOX)
    return np.asarray(small, float)


def _check(thumbnail: np.ndarray, known: np.ndarray, names: list[str]) -> None:
    if thumbnail.std() < BLANK:
        raise _UnusableError("shows nothing but one colour")
    apart = np.abs(known - thumbnail).mean(axis=(1, 2))
    if len(apart) and apart.min() < SAME:
        raise _TwinError(f"shows the same as {names[int(apart.argmin())]}")


def _name(file: Path, taken: set[str]) -> str:
    """Return a name that occurs once and holds no blanks, which end names in COLMAP's lists."""
    stem, k = re.sub(r"\s", "_", safe(file.stem)) or "photograph", 1
    name = f"{stem}.jpg"
    while name in taken:
        name, k = f"{stem}_{k}.jpg", k + 1
    return name


def _write(picture: Image.Image, path: Path) -> None:
    with store.writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        exif = picture.info["exif"]
        more = {"exif": exif} if exif else {}
        picture.save(path, "JPEG", quality=QUALITY, subsampling=0, **more)


def _write_mask(mask: Image.Image, path: Path) -> None:
    with store.writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        mask.save(path, "PNG")


def _write_alphas(alphas: dict[str, Image.Image], total: int, folder: Path) -> list[str]:
    """Write masks of photographs that were cut out, if most were; say so where few are.

    Of an alpha that hides all, or nothing, nobody can tell what is meant.

    Args:
        alphas: By the names of the photographs.
        total: Photographs, those without alpha, too.
        folder: Gets masks; what lies there already was given beside the photographs, and counts.

    """
    opaque = {name: np.asarray(alpha) for name, alpha in alphas.items()}
    clear = [name for name, own in opaque.items() if own.min() == CLEAR]
    parted = [name for name, own in opaque.items() if own.min() <= HALF < own.max()]
    if len(clear) == len(alphas):
        return []
    if len(parted) <= total / 2:
        return [
            f"{len(alphas) - len(clear)} of {total} photographs are transparent in parts or all "
            "over, and most were not cut out: this was not taken for masks. Cut out all of them, "
            "or none."
        ]
    for name, alpha in alphas.items():
        place = folder / MASKS[0] / f"{Path(name).stem}.png"
        if not place.exists():
            _write_mask(alpha, place)
    return []


def _mask_of(
    file: Path, source: Path, kinds: tuple[str, ...], size: tuple[int, int]
) -> Image.Image | None:
    """Return what goes with a photograph, turned with it where it is as the camera stored it.

    Raises:
        _UnusableError: It lies across the photograph.

    """
    mask = companion(file, source, kinds)
    if mask is None:
        return None
    try:
        with Image.open(file, formats=FORMATS) as stored, Image.open(mask, formats=FORMATS) as own:
            wide = stored.width > stored.height
            same = (own.width > own.height) == wide
            turn = stored.getexif() if same else Image.Exif()
            copy = own.copy()
        copy.getexif().clear()
        copy.getexif().update({0x0112: turn.get(0x0112, 1)})
        upright = ImageOps.exif_transpose(copy)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None  # a photograph without its mask is left out where the others have one
    if wrong := across(upright.size, size):
        raise _UnusableError(wrong)
    return upright
