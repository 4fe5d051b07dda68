"""Evaluation of recognized materials: right, wrong or unknown, and calibration of margins."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal import materials
from corporeal.core.errors import BadFileError, UserError
from corporeal.description.describe_config import DescribeConfig
from corporeal.io.input_files import model_files_in
from corporeal.lab.evaluation.result_table import ResultTable
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.describe import describe

TRUTH_FILE_ADVICE = "Write [file] with part = ['material', ...], the likeliest first."

MaterialTruth = Mapping[str, Mapping[str, tuple[str, ...]]]
"""File's stem → part → materials that are right, the likeliest first."""


@dataclass(frozen=True)
class RecognitionRow:
    """One part, answered and judged."""

    file: str
    part: str
    answer: str | None
    margin: float
    accepted: tuple[str, ...]
    reason: str = ""
    group: str = ""

    @property
    def verdict(self) -> str:
        """One of right, wrong and unknown."""
        if self.answer is None:
            return "unknown"
        return "right" if self.answer in self.accepted else "wrong"


@dataclass(frozen=True)
class RecognitionScore:
    """Shares of all parts."""

    parts: int
    right: float
    wrong: float
    unknown: float
    likeliest: float
    """Share answered with the material that was thought likeliest."""
    ordering: float | None
    """How often a right answer has a larger margin than a wrong one; None: not both exist."""


def evaluate_materials(
    folder: Path, truth: MaterialTruth, config: DescribeConfig, library: str, progress: Callable[[float, str], None]
) -> list[RecognitionRow]:
    """Describe every model of a folder that the truth speaks of, and judge each part it names.

    Raises:
        UserError: The folder holds none of them, or an object has no part of a name.
    """
    found = model_files_in(folder) if folder.is_dir() else []
    known = [path for path in found if path.stem in truth]
    if not known:
        raise UserError(f"None of the models in {folder} is in the truth. {TRUTH_FILE_ADVICE}")
    rows = []
    for number, path in enumerate(known):
        progress(number / len(known), path.stem)
        described = describe(assemble([path]), config, library)
        words = {w.name: w for obj in described.objects for w in obj.parts}
        for part, accepted in truth[path.stem].items():
            if part not in words:
                raise UserError(f"{path.stem} has no part {part!r}. Its parts: {', '.join(sorted(words))}.")
            said = words[part]
            rows.append(RecognitionRow(path.stem, part, said.material, said.margin, accepted, said.reason))
    return rows


def read_material_truth(path: Path, library: str = "default") -> MaterialTruth:
    """Read what parts are made of; tables of files may stand in tables of sets.

    Raises:
        BadFileError: The file cannot be read, or says something else.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadFileError(path, f"cannot be read ({error}).", TRUTH_FILE_ADVICE) from error
    truth: dict[str, dict[str, tuple[str, ...]]] = {}
    for name, table in tables.items():
        nested = isinstance(table, dict) and all(isinstance(v, dict) for v in table.values())
        for file, parts in (table if nested else {name: table}).items():
            if not (isinstance(parts, dict) and parts):
                raise BadFileError(path, f"{file}: must map part names to materials.", TRUTH_FILE_ADVICE)
            truth[file] = {p: _accepted(path, f"{file}: {p}", m, library) for p, m in parts.items()}
    return truth


def _accepted(path: Path, where: str, names: object, library: str) -> tuple[str, ...]:
    if not (isinstance(names, list) and names and all(isinstance(m, str) for m in names)):
        raise BadFileError(path, f"{where}: is {names!r}, not a list of materials.", TRUTH_FILE_ADVICE)
    return tuple(materials.find_material_or_default(name, library).name for name in names)


def recognition_score(rows: Sequence[RecognitionRow]) -> RecognitionScore:
    """Count verdicts; there must be a row."""
    total = len(rows)

    def share(verdict: str) -> float:
        return sum(r.verdict == verdict for r in rows) / total

    first = sum(r.answer == r.accepted[0] for r in rows) / total
    return RecognitionScore(total, share("right"), share("wrong"), share("unknown"), first, margin_roc_area(rows))


def margin_roc_area(rows: Sequence[RecognitionRow]) -> float | None:
    """Return how often a right answer has a larger margin than a wrong one, as ``roc_area``."""
    right, wrong = (np.array([r.margin for r in rows if r.verdict == kind]) for kind in ("right", "wrong"))
    return roc_area(right, wrong)


def recognition_tables(rows: Sequence[RecognitionRow]) -> list[ResultTable]:
    """Return title, heads and cells of what a person is shown."""
    s = recognition_score(rows)
    shares = (s.right, s.likeliest, s.wrong, s.unknown)
    order = "–" if s.ordering is None else f"{s.ordering:.2f}"
    heads = ("parts", "right", "likeliest", "wrong", "unknown", "margin orders")
    wrong = [(r.file, r.part, str(r.answer), f"{r.margin:.2f}", r.accepted[0]) for r in rows if r.verdict == "wrong"]
    return [
        ResultTable("Materials of parts", heads, [(str(s.parts), *(f"{x:.0%}" for x in shares), order)]),
        ResultTable("Wrong answers", ("object", "part", "answer", "margin", "likeliest"), wrong),
    ]


def recognition_record(rows: Sequence[RecognitionRow]) -> dict:
    """Return rows and scores as plain data."""
    verdicts = [asdict(r) | {"verdict": r.verdict} for r in rows]
    return {"rows": verdicts, "scores": asdict(recognition_score(rows))}


def roc_area(right: Float[np.ndarray, " R"], wrong: Float[np.ndarray, " W"]) -> float | None:
    """Return how often what is right is surer than what is wrong (area under the ROC curve).

    Ties count half; 0.5 is chance, None where there is only one kind.
    """
    if not (len(right) and len(wrong)):
        return None
    ordered = np.sort(wrong)
    below = np.searchsorted(ordered, right, "left") + np.searchsorted(ordered, right, "right")
    return float(below.mean() / (2 * len(wrong)))
