"""Admission of models to a pool: classes, credits, units, duplicates."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from corporeal.pool.asset_pool import UNKNOWN_LICENCE, PoolAsset, PoolRejection
from corporeal.pool.gate_verdicts import MODELS_FOLDER, GateVerdict
from corporeal.pool.pool_candidates import PoolCandidate
from corporeal.recognition.readable_names import safe_name, single_line_text
from corporeal.recognition.typical_extents import (
    MAX_PLAUSIBLE_EXTENT_M,
    MIN_PLAUSIBLE_EXTENT_M,
    extent_warning,
    typical_extent,
)

MAX_USUAL_SIZE_RATIO = 10.0
"""How many times beyond the usual sizes of its class an object that is in metres may be."""
UNIT_DOUBT_RELATIVE_DIFFERENCE = 0.1
"""Relative difference of a stated and a measured extent from which the units are in doubt."""


@dataclass(frozen=True)
class PoolMember:
    """An asset, and what tells it from others."""

    asset: PoolAsset
    found: Path
    """The file that was judged."""
    mesh: str
    """Names its shape."""
    look: str
    """Names its colours and pictures."""


class PoolAdmission:
    """Lets candidates into a pool, one after the other."""

    def __init__(self, pool: Path, members: Iterable[PoolMember], rejections: Iterable[PoolRejection]):
        self.pool = pool
        self.members = list(members)
        self.rejections = list(rejections)
        self._names = {m.asset.name for m in self.members}
        self._doubles: dict[tuple[str, str], str] = {}
        for member in self.members:
            self._remember(member)

    def ask(self, candidate: PoolCandidate, verdict: GateVerdict) -> None:
        """Let a candidate in, or write down why not."""
        declared = candidate.declared
        words = _class_in_words(declared.class_name or verdict.class_name) or "object"
        metric = is_in_metres(candidate, verdict.extent, words)
        reason = verdict.reason or self._why_not(verdict, words, bool(declared.metric) and metric)
        if reason:
            self.rejections.append(PoolRejection(single_line_text(str(candidate.file)), words, reason))
            return
        asset = PoolAsset(
            name=self._name(candidate),
            class_name=words,
            file=self.pool / MODELS_FOLDER / verdict.copy if verdict.copy else candidate.file.resolve(),
            source=declared.source or str(candidate.file),
            sha256=verdict.sha256,
            licence=declared.licence or verdict.licence or UNKNOWN_LICENCE,
            attribution=declared.attribution or verdict.attribution,
            extent=verdict.extent,
            metric=metric,
            triangles=verdict.triangles,
            open_edges=verdict.open_edges,
            texture=verdict.texture,
        )
        self._names.add(asset.name)
        member = PoolMember(asset, candidate.file.resolve(), verdict.mesh, verdict.look)
        self.members.append(member)
        self._remember(member)

    def _remember(self, member: PoolMember) -> None:
        """Keep what a double would share: the mesh, and either the class or the look.

        A rubber ball and a steel ball may well have one mesh; they are two objects.
        """
        for other in (member.asset.class_name, member.look):
            self._doubles.setdefault((member.mesh, other), member.asset.name)

    def _why_not(self, verdict: GateVerdict, words: str, in_metres: bool) -> str:
        for other in (words, verdict.look):
            if (verdict.mesh, other) in self._doubles:
                return f"has the same mesh as {self._doubles[verdict.mesh, other]}"
        return why_absurd_extent(verdict.extent, words) if in_metres else ""

    def _name(self, candidate: PoolCandidate) -> str:
        """Return a name that is not taken, counted up where the file's is."""
        stem = safe_name(candidate.name or candidate.file.stem).replace(" ", "_") or "object"
        name, k = stem, 1
        while name in self._names:
            name, k = f"{stem}_{k}", k + 1
        return name


def _class_in_words(class_name: str) -> str:
    """Return a class as one writes it, so that "Soda_Can" and "soda can" are one."""
    return " ".join(single_line_text(class_name).replace("_", " ").lower().split())


def is_in_metres(candidate: PoolCandidate, extent: float, words: str) -> bool:
    """Return whether lengths are metres: as declared, unless the mesh has another extent.

    If not stated, they are if the object is then as large as such objects are: glTF is in metres by its specification,
    and most files are not.
    """
    declared = candidate.declared
    if declared.extent is not None and abs(declared.extent / max(extent, 1e-300) - 1) > UNIT_DOUBT_RELATIVE_DIFFERENCE:
        return False
    return extent_warning("", words, extent) is None if declared.metric is None else declared.metric


def why_absurd_extent(extent: float, words: str) -> str:
    """Return why an object of such an extent [m] can't be in metres; empty where it can."""
    known = typical_extent(words)
    low, high = (known.low, known.high) if known else (MIN_PLAUSIBLE_EXTENT_M, MAX_PLAUSIBLE_EXTENT_M)
    if low / MAX_USUAL_SIZE_RATIO <= extent <= high * MAX_USUAL_SIZE_RATIO:
        return ""
    usual = f"a {known.words} is usually {known.usual:g} m" if known else "nothing is so"
    return f"is declared as in metres and is {extent:.3g} m large; {usual}. Set metric = no if only its shape counts"
