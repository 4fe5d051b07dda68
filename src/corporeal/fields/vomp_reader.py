"""VoMP's voxels: the npz that its ``save_materials`` writes.

``voxel_data`` is a structured array of x, y, z in the frame and unit of the mesh file,
youngs_modulus [Pa], poissons_ratio and density [kg/m³] (vomp/inference/utils.py, Apache-2.0).
"""

import zipfile
from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.fields.sampled_field import SampledField

VOMP_COLUMNS = {"young": "youngs_modulus", "poisson": "poissons_ratio", "density": "density"}
VOMP_WRITE_AGAIN = "Write it again with VoMP's save_materials."


def read_vomp(path: Path) -> SampledField:
    """Read a file without unpickling anything.

    Raises:
        BadFileError: It is damaged, holds pickled objects, or lacks a column.

    """
    try:
        with np.load(path, allow_pickle=False) as file:
            rows = file["voxel_data"]
    except KeyError as error:
        raise BadFileError(path, "has no array voxel_data.", VOMP_WRITE_AGAIN) from error
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        pickled = "Object arrays" in str(error)
        what = "holds pickled objects, which are not read." if pickled else "is no sound npz file."
        raise BadFileError(path, what, VOMP_WRITE_AGAIN) from error
    except (AttributeError, TypeError, IndexError) as error:  # an npy file: one array, no names
        raise BadFileError(path, "is no npz file.", VOMP_WRITE_AGAIN) from error
    missing = [
        n for n in ("x", "y", "z", *VOMP_COLUMNS.values()) if n not in (rows.dtype.names or ())
    ]
    if missing:
        raise BadFileError(path, f"voxel_data has no {', '.join(missing)}.", VOMP_WRITE_AGAIN)
    rows = rows.reshape(-1)
    return SampledField(
        method="VoMP",
        path=path,
        position=np.stack([rows[axis].astype(float) for axis in "xyz"], axis=1),
        values={ours: rows[theirs].astype(float) for ours, theirs in VOMP_COLUMNS.items()},
    )
