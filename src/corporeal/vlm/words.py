"""From a model's answers to what flows on: words about parts, and places in ranges."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from corporeal.types import ObjectWords, PartWords, Placement, SceneObject
from corporeal.vlm.answers import MaterialsAnswer, PartAnswer, Vocabulary
from corporeal.vlm.prices import date, dollars

Asked = Literal["model", "recording"]
LOOKED = {"model": "the model", "recording": "a recorded answer"}
"""Who looks at pictures."""
ALIKE = 1.25
"""By what factor a wall's thickness may differ from the stated one before anybody is told."""
FAR = 2.5
"""By what factor a size may differ from the usual one before anybody is told."""


def part_words(answer: MaterialsAnswer, by: Asked, names: Vocabulary) -> list[PartWords]:
    """Turn an answer that was checked into words, one per part; unknown parts have no material."""
    total = [
        sum(getattr(p, what) or 0.0 for p in answer.parts)
        for what in ("volume_share", "surface_share")
    ]
    return [_words(part, by, names, (total[0], total[1])) for part in answer.parts]


def _words(said: PartAnswer, by: Asked, names: Vocabulary, total: tuple[float, float]) -> PartWords:
    made = None if said.material is None else names.material(said.material)
    others = [(names.material(a.material) or "", a.probability) for a in said.alternatives]
    return PartWords(
        name=said.part,
        material=made,
        structure=said.structure,
        answered_by=by if made else "unknown",
        margin=said.probability if made else 0.0,
        reason=said.reason,
        contents=names.contents(said.contents) if said.contents else None,
        fill=said.fill if said.structure == "filled" else None,
        alternatives=tuple((n, p) for n, p in others if n != made and p > 0),
        volume_share=_share(said.volume_share, total[0]),
        surface_share=_share(said.surface_share, total[1]),
        built_by=by,
    )


def _share(said: float | None, total: float) -> float:
    """Make shares add up to 1 exactly; a part that shares with nobody has the whole."""
    return 1.0 if said is None or total <= 0 else said / total


def gathered(name: str, pieces: Sequence[PartWords]) -> PartWords:
    """Let the largest piece whose material is known speak for the mesh that all of them share."""
    if len(pieces) == 1:
        return replace(pieces[0], name=name)
    known = [p for p in pieces if p.material is not None] or list(pieces)
    main = max(known, key=lambda p: (p.volume_share, p.surface_share))
    share = main.volume_share
    others = ", ".join(p.name for p in pieces if p is not main)
    reason = f"{main.name}, {share:.0%} of the volume, beside {others}. {main.reason}"
    return replace(
        main, name=name, reason=reason, volume_share=1.0, surface_share=1.0, pieces=tuple(pieces)
    )


def settled(said: PartWords, file: PartWords, walled: Callable[[str], bool]) -> PartWords:
    """Let the file name the material that a model could not, and keep all else that it said.

    Args:
        said: What the model said.
        file: What the file's own words say of the same part.
        walled: Tells whether walls of a material were ever measured.

    """
    if said.material is not None:
        return said
    why = f"{said.reason.rstrip('. ')}. " if said.reason else ""
    own = file
    if said.structure == "solid":
        own = replace(file, structure="solid", thickness=None, contents=None, fill=None)
        own = replace(own, built_by=said.built_by)
    elif said.structure and (file.thickness or file.material is None or walled(file.material)):
        kept = {"structure": said.structure, "contents": said.contents, "fill": said.fill}
        own = replace(file, **kept, built_by=said.built_by)
    return replace(
        own,
        name=said.name,
        reason=f"The pictures do not show what it is made of: {why}{file.reason}",
        alternatives=tuple((n, p) for n, p in said.alternatives if n != file.material),
        volume_share=said.volume_share,
        surface_share=said.surface_share,
        pieces=tuple(settled(piece, file, walled) for piece in said.pieces),
    )


def against(words: PartWords, material: str | None, wall: float | None, put: float | None) -> str:
    """Say in a clause where a model contradicts what the file states; "" where it does not.

    Args:
        words: What is believed of a part.
        material: What the file states it is made of.
        wall: How thick the file states its wall is [m]; 0: stated solid; None: not said.
        put: How thick the model put its wall [m].

    """
    stated, said = [], []
    if material not in (None, words.material) and words.answered_by in LOOKED:
        stated, said = [str(material)], [str(words.material)]
    other = words.structure == "solid" if wall else words.structure != "solid"
    apart = bool(wall and put and not 1 / ALIKE <= put / wall <= ALIKE)
    if wall is not None and words.built_by in LOOKED and (other or apart):
        stated.append(f"a wall {wall * 1e3:.3g} mm thick" if wall else "solid")
        said.append(f"a wall {put * 1e3:.3g} mm thick" if apart and put else str(words.structure))
    if not stated:
        return ""
    who = LOOKED[words.answered_by if words.answered_by in LOOKED else words.built_by]
    return f"the file states {', '.join(stated)} for {words.name}, {who} said {', '.join(said)}"


def placed(words: PartWords, placements: Mapping[str, Mapping[str, Placement]]) -> PartWords:
    """Give a part, and each of its pieces, the places that were chosen under its name."""
    own = dict(placements.get(words.name, {}))
    pieces = tuple(placed(piece, placements) for piece in words.pieces)
    if pieces:
        main = max(pieces, key=lambda p: (p.material == words.material, p.volume_share))
        own = dict(main.placements)
    return replace(words, placements=own, pieces=pieces)


def leaves(words: Sequence[PartWords]) -> list[PartWords]:
    """Parts, or their pieces where they have some."""
    return [leaf for part in words for leaf in (part.pieces or (part,))]


def length(metres: float) -> str:
    """Write a length as a person would."""
    if metres >= 1000:
        return f"{metres:.0f} m"
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"


def with_extents(
    things: Sequence[SceneObject], objects: Sequence[ObjectWords], usual: Mapping[str, float]
) -> tuple[list[ObjectWords], list[str]]:
    """Keep how large things usually are [m], and say which of them are far from it."""
    sized, doubts = [], []
    for thing, words in zip(things, objects, strict=True):
        kind = thing.class_name or thing.name
        size, usually = thing.real_extent, usual.get(kind)
        sized.append(replace(words, usual_extent=usually))
        if usually and not 1 / FAR <= size / usually <= FAR:
            doubts.append(
                f"{thing.name} is {length(size)} large, but the model says that a thing like that "
                f"({kind}) is usually about {length(usually)}. Set its size with --extent "
                f"{thing.name}={float(f'{usually:.3g}'):g}."
            )
    return sized, doubts


def usage(transcript: Sequence[Mapping]) -> dict:
    """Add up what the questions took; no price is given where one model's price is not known."""
    rows = [r for r in transcript if r.get("answer") is not None]
    if not rows:
        return {}
    costs = [
        dollars(r["model"], r["input_tokens"], r["output_tokens"]) if r["calls"] else 0.0
        for r in rows
    ]
    known = None if None in costs else round(sum(c or 0.0 for c in costs), 6)
    total = {
        what: sum(r[what] for r in rows)
        for what in ("calls", "input_tokens", "output_tokens", "seconds")
    }
    return {
        "models": sorted({r["model"] for r in rows}),
        "questions": len(transcript),
        **total,
        "dollars": known,
        "prices_of": date(),
    }
