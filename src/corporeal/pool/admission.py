"""From verdicts to members: classes, credits and units; no shape twice, no name twice."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from corporeal.pool.asset import UNKNOWN, Asset, Rejection
from corporeal.pool.candidate import Candidate
from corporeal.pool.verdict import MODELS, Verdict
from corporeal.recognition.typical_extents import LARGEST, SMALLEST, doubt, typical_extent
from corporeal.recognition.words import safe, writable

ABSURD = 10.0
"""How many times beyond the usual sizes of its class an object that is in metres may be."""
OTHER = 0.1
"""Relative difference of a stated and a measured extent from which the units are in doubt."""


@dataclass(frozen=True)
class Member:
    """An asset, and what tells it from others."""

    asset: Asset
    found: Path
    """The file that was judged."""
    mesh: str
    """Names its shape."""
    look: str
    """Names its colours and pictures."""


class Admission:
    """Lets candidates into a pool, one after the other."""

    def __init__(self, pool: Path, members: Iterable[Member], rejections: Iterable[Rejection]):
        self.pool = pool
        self.members = list(members)
        self.rejections = list(rejections)
        self._names = {m.asset.name for m in self.members}
        self._doubles: dict[tuple[str, str], str] = {}
        for member in self.members:
            self._remember(member)

    def ask(self, candidate: Candidate, verdict: Verdict) -> None:
        """Let a candidate in, or write down why not."""
        declared = candidate.declared
        words = _in_words(declared.class_name or verdict.class_name) or "object"
        metric = is_metric(candidate, verdict.extent, words)
        reason = verdict.reason or self._why_not(verdict, words, bool(declared.metric) and metric)
        if reason:
            self.rejections.append(Rejection(writable(str(candidate.file)), words, reason))
            return
        asset = Asset(
            name=self._name(candidate),
            class_name=words,
            file=self.pool / MODELS / verdict.copy if verdict.copy else candidate.file.resolve(),
            source=declared.source or str(candidate.file),
            sha256=verdict.sha256,
            licence=declared.licence or verdict.licence or UNKNOWN,
            attribution=declared.attribution or verdict.attribution,
            extent=verdict.extent,
            metric=metric,
            triangles=verdict.triangles,
            open_edges=verdict.open_edges,
            texture=verdict.texture,
        )
        self._names.add(asset.name)
        member = Member(asset, candidate.file.resolve(), verdict.mesh, verdict.look)
        self.members.append(member)
        self._remember(member)

    def _remember(self, member: Member) -> None:
        """Keep what a double would share: the mesh, and either the class or the look.

        A rubber ball and a steel ball may well have one mesh; they are two objects.
        """
        for other in (member.asset.class_name, member.look):
            self._doubles.setdefault((member.mesh, other), member.asset.name)

    def _why_not(self, verdict: Verdict, words: str, in_metres: bool) -> str:
        for other in (words, verdict.look):
            if (verdict.mesh, other) in self._doubles:
                return f"has the same mesh as {self._doubles[verdict.mesh, other]}"
        return absurd(verdict.extent, words) if in_metres else ""

    def _name(self, candidate: Candidate) -> str:
        """Return a name that is not taken, counted up where the file's is."""
        stem = safe(candidate.name or candidate.file.stem).replace(" ", "_") or "object"
        name, k = stem, 1
        while name in self._names:
            name, k = f"{stem}_{k}", k + 1
        return name


def _in_words(class_name: str) -> str:
    """Return a class as one writes it, so that "Soda_Can" and "soda can" are one."""
    return " ".join(writable(class_name).replace("_", " ").lower().split())


def is_metric(candidate: Candidate, extent: float, words: str) -> bool:
    """Tell whether lengths are metres: as declared, unless the mesh has another extent.

    Where nobody says, they are if the object is then as large as such objects are: glTF is in
    metres by its specification, and most files are not.
    """
    declared = candidate.declared
    if declared.extent is not None and abs(declared.extent / max(extent, 1e-300) - 1) > OTHER:
        return False
    return doubt("", words, extent) is None if declared.metric is None else declared.metric


def absurd(extent: float, words: str) -> str:
    """Return why an object of such an extent [m] can't be in metres; empty where it can."""
    known = typical_extent(words)
    low, high = (known.low, known.high) if known else (SMALLEST, LARGEST)
    if low / ABSURD <= extent <= high * ABSURD:
        return ""
    usual = f"a {known.words} is usually {known.usual:g} m" if known else "nothing is so"
    return (
        f"is declared as in metres and is {extent:.3g} m large; {usual}. Set metric = no if only "
        "its shape counts"
    )
