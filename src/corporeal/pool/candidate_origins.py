"""Sources of candidates: plain folders and known collections."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from corporeal.core.errors import UserError
from corporeal.io.load_model import readable_model_formats
from corporeal.pool import abo, objaverse
from corporeal.pool.pool_candidates import PoolCandidate, candidates_in

CandidateOrigin = Literal["folders", "objaverse", "abo"]


@dataclass(frozen=True)
class OriginConfig:
    """What the folders are, and what is declared about the files in them."""

    origin: CandidateOrigin = "folders"
    """Plain folders, the cache of the package objaverse, or Amazon Berkeley Objects."""
    csv: Path | None = None
    """Of plain folders: table with columns file, class and, where known, licence, attribution,
    extent_m, metric."""
    wanted: objaverse.WantedModels = field(default_factory=objaverse.WantedModels)


def find_candidates(
    folders: Sequence[Path], config: OriginConfig, pool: Path
) -> list[PoolCandidate]:
    """Return what asks to be let into the pool.

    Raises:
        UserError: There is nothing, or a folder, table or collection cannot be used.

    """
    if config.origin == "folders":
        found = candidates_in(folders, config.csv, pool)
    elif config.origin == "abo":
        found = [c for folder in folders for c in abo.abo_candidates(folder)]
    else:
        found = _of_objaverse(folders, config.wanted)
    if not found:
        named = ", ".join(map(str, folders)) or str(objaverse.OBJAVERSE_CACHE)
        raise UserError(f"{named}: no model ({readable_model_formats()}) lies there or below.")
    return found


def _of_objaverse(folders: Sequence[Path], wanted: objaverse.WantedModels) -> list[PoolCandidate]:
    """Return what the caches hold; of the wanted categories only, where some are named."""
    if wanted.classes and not folders:
        folders = [objaverse.fetch_objaverse(wanted)]
    found = [c for cache in folders or [None] for c in objaverse.objaverse_candidates(cache)]
    names = {objaverse.category_words(c) for c in wanted.classes}
    return [c for c in found if not names or c.declared.class_name in names]
