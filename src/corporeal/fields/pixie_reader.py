"""Pixie's points: ``mapped_preds.ply`` or ``world_mapped_preds.ply``.

Columns x, y, z, density [kg/m³], E [Pa], nu and material_id beside colours
(pixie/voxel/map_pred_to_coords.py, MIT); the names of the ids are those of its simulator
(MATERIAL_ID_TO_NAME in mpm_solver_warp.py), 7 being the background of its training.
"""

from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.fields.sampled_field import SampledField
from corporeal.io.ply_container import read_ply_elements

PIXIE_KINDS = ("jelly", "metal", "sand", "visplas", "fluid", "snow", "stationary", "background")
"""By material_id."""
PIXIE_COLUMNS = {"young": "E", "poisson": "nu", "density": "density"}
PIXIE_FILE_NAMES = "mapped_preds.ply or world_mapped_preds.ply"


def read_pixie(path: Path) -> SampledField:
    """Read a file; points of the background are left out.

    Raises:
        BadFileError: It is damaged, lacks a column, or is the normalised prediction.

    """
    if path.suffix.lower() in (".npy", ".npz"):
        what = "is Pixie's normalised prediction, without places and units."
        raise BadFileError(path, what, f"Name {PIXIE_FILE_NAMES} instead.")
    rows = read_ply_elements(path, memoryview(path.read_bytes())).get("vertex", {})
    missing = [n for n in ("x", "y", "z", "material_id", *PIXIE_COLUMNS.values()) if n not in rows]
    if missing:
        raise BadFileError(
            path, f"its vertices have no {', '.join(missing)}.", f"Name {PIXIE_FILE_NAMES}."
        )
    number = rows["material_id"].astype(float)
    known = np.isin(number, range(len(PIXIE_KINDS)))
    if not known.all():
        what = f"{int((~known).sum())} points have a material_id that is none of 0 to 7."
        raise BadFileError(path, what, "Write it again with Pixie.")
    kind = np.array(PIXIE_KINDS)[number.astype(int)]
    there = kind != "background"
    return SampledField(
        method="Pixie",
        path=path,
        position=np.stack([rows[axis][there].astype(float) for axis in "xyz"], axis=1),
        values={ours: rows[theirs][there].astype(float) for ours, theirs in PIXIE_COLUMNS.items()},
        kind=kind[there],
    )
