"""Inference of the length unit of mesh files from usual sizes of objects."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.types import Note, NoteKind
from corporeal.recognition.typical_extents import extent_warning, length_text, typical_extent, with_article

METRES_OF_MODELLING_UNIT = {"metres": 1.0, "centimetres": 1e-2, "millimetres": 1e-3, "inches": 0.0254}
"""What programs usually model in [m]."""
PRINT_UNIT_ORDER = ("millimetres", "metres", "centimetres", "inches")
"""In which order they are likely in files that are made for printing."""
IMPLAUSIBLE_SIZE_RATIO = 10.0
"""No mesh is so many times smaller or larger than the smallest or largest of such objects."""
UNIT_ADVICE = "Override with --unit or --extent."
MAX_NAMED_FILES = 3
"""Files that are named in one sentence."""


@dataclass(frozen=True)
class InferredUnit:
    """What one unit of a file that states none was taken to be."""

    file: Path
    extent: float
    """Of its largest object [m]."""
    metres: float
    """Length of one unit [m]."""
    unit: str
    """Its name; "": none is likely, and the object is as large as such objects usually are."""
    usual: str = ""
    """What such objects are called, where they got their usual size."""
    shared: bool = False
    """It is the unit of the scene file's other meshes."""


def infer_length_unit(file: Path, class_name: str, extent: float) -> InferredUnit | None:
    """Return the first usual unit in which an object is as large as such objects are.

    One in which it is within the table's own range comes before one in which it is but nearly so. Where there is none,
    an object of the table gets its usual size; else None.

    Args:
        file: Its suffix tells whether it is of a kind that is made for printing.
        class_name: What it is.
        extent: Its largest extent, in the file's unit.
    """
    order = PRINT_UNIT_ORDER if file.suffix.lower() == ".stl" else METRES_OF_MODELLING_UNIT
    sizes = {name: extent * METRES_OF_MODELLING_UNIT[name] for name in order}
    likely = [name for name, size in sizes.items() if extent_warning("it", class_name, size) is None]
    known = typical_extent(class_name)
    within = [name for name in likely if known is None or known.low <= sizes[name] <= known.high]
    if likely:
        name = (within or likely)[0]
        return InferredUnit(file, sizes[name], METRES_OF_MODELLING_UNIT[name], name)
    if known is None:
        return None
    return InferredUnit(file, known.usual, known.usual / extent, "", known.words)


def infer_shared_unit(
    found: InferredUnit | None, file: Path, extent: float, others: Iterable[InferredUnit | None]
) -> InferredUnit | None:
    """Return the unit that a scene file's other meshes are in, where a mesh fits none by its size.

    Who places meshes manually in metres has modelled them in one unit. An object of the table that would be ten times
    smaller or larger in it than any such object is as large as they usually are.

    Args:
        found: What the mesh by itself was taken for; None: nothing.
        file: The mesh.
        extent: Its largest extent, in the file's unit.
        others: What the other meshes were taken for.
    """
    named = {o.unit for o in others if o is not None and o.unit}
    if (found is not None and found.unit) or len(named) != 1:
        return found
    unit = named.pop()
    size = extent * METRES_OF_MODELLING_UNIT[unit]
    known = None if found is None else typical_extent(found.usual)
    if known is not None and not known.low / IMPLAUSIBLE_SIZE_RATIO < size < known.high * IMPLAUSIBLE_SIZE_RATIO:
        return found
    return InferredUnit(file, size, METRES_OF_MODELLING_UNIT[unit], unit, shared=True)


def unit_notes(found: Sequence[InferredUnit]) -> list[str]:
    """Describe what files that state no unit were taken for, those in one unit in one sentence."""
    groups: dict[tuple[str, bool], list[InferredUnit]] = {}
    for row in dict.fromkeys(found):
        groups.setdefault((row.unit, row.shared), []).append(row)
    return [s for (unit, _), rows in groups.items() for s in _notes_of_unit(unit, rows)]


def _notes_of_unit(unit: str, rows: list[InferredUnit]) -> list[str]:
    names = list(dict.fromkeys(row.file.name for row in rows))
    if not unit:
        return [
            Note(
                f"{row.file.name} states no unit: it was scaled to the size that "
                f"{with_article(row.usual, 'usually is', 'usually are')}, "
                f"{length_text(row.extent)}. {UNIT_ADVICE}",
                NoteKind.ASSUMED,
            )
            for row in rows
        ]
    also = ", as the other meshes are" if rows[0].shared else ""
    if len(names) == 1:
        size = length_text(rows[0].extent)
        return [
            Note(
                f"{names[0]} states no unit: it was read in {unit}{also}, so that it is {size} large. {UNIT_ADVICE}",
                NoteKind.ASSUMED,
            )
        ]
    shown = names if len(names) <= MAX_NAMED_FILES + 1 else names[:MAX_NAMED_FILES]
    rest = [f"{len(names) - len(shown)} more"] if len(shown) < len(names) else []
    *first, last = [*shown, *rest]
    sizes = [row.extent for row in rows]
    return [
        Note(
            f"{', '.join(first)} and {last} state no unit: they were read in {unit}{also}, so that "
            f"they are {length_text(min(sizes))} to {length_text(max(sizes))} large. {UNIT_ADVICE}",
            NoteKind.ASSUMED,
        )
    ]
