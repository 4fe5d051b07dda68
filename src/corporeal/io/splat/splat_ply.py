"""Gaussians as PLY in the layout of INRIA's 3D Gaussian splatting, which most tools read and write.

Each vertex has x y z, f_dc_0…2 (band 0 of R, G, B), f_rest_0… (all other coefficients of R, then of G, then of B),
opacity (its logit), scale_0…2 (logarithms) and rot_0…3 (w, x, y, z; any length). Normals and other properties are
ignored.
"""

from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians
from corporeal.geometry.spherical_harmonics import SH_DEGREE_OF_COUNT
from corporeal.io.ply_container import PlyColumns, format_ply_header

MEAN_PROPERTIES = ["x", "y", "z"]
COLOUR_PROPERTIES = [f"f_dc_{k}" for k in range(3)]
SCALE_PROPERTIES = [f"scale_{k}" for k in range(3)]
ROTATION_PROPERTIES = [f"rot_{k}" for k in range(4)]
REQUIRED_PROPERTIES = [*MEAN_PROPERTIES, *COLOUR_PROPERTIES, "opacity", *SCALE_PROPERTIES, *ROTATION_PROPERTIES]
SH_COUNT_OF_REST_PROPERTIES = {3 * (K - 1): K for K in SH_DEGREE_OF_COUNT}
"""Number of coefficients per channel for each number of f_rest properties."""
MAX_OPACITY = 1 - 2.0**-24
"""Largest opacity that has a finite logit in single precision."""


def gaussians_from_vertices(path: Path, vertices: PlyColumns) -> Gaussians:
    """Return the Gaussians as the file says them, unchecked.

    Raises:
        BadFileError: Properties are missing, or there is an odd number of harmonics.
    """
    missing = [name for name in REQUIRED_PROPERTIES if name not in vertices]
    if missing:
        kind = "a cloud of points or a mesh, " if "x" in vertices and len(missing) > 7 else ""
        what = f"is {kind}no Gaussian splat: its vertices lack {', '.join(missing)}."
        raise BadFileError(path, what, "Name a splat as INRIA's 3D Gaussian splatting writes it.")
    return Gaussians(
        mean=stack_columns(vertices, MEAN_PROPERTIES),
        rotation=stack_columns(vertices, ROTATION_PROPERTIES),
        scale=exponential(stack_columns(vertices, SCALE_PROPERTIES)),
        opacity=logistic(vertices["opacity"]),
        sh=np.concatenate(
            [stack_columns(vertices, COLOUR_PROPERTIES)[:, None], sh_rest_coefficients(path, vertices)], axis=1
        ),
    )


def sh_rest_coefficients(path: Path, columns: PlyColumns) -> np.ndarray:
    """Return the coefficients above band 0, (N, K - 1, 3), of columns f_rest_0….

    Raises:
        BadFileError: Their number fits no degree from 0 to 3.
    """
    names = [name for name in columns if name.startswith("f_rest_")]
    if len(names) not in SH_COUNT_OF_REST_PROPERTIES or set(names) != {f"f_rest_{k}" for k in range(len(names))}:
        fit = ", ".join(str(n) for n in SH_COUNT_OF_REST_PROPERTIES)
        what = f"has {len(names)} properties f_rest_*; degrees 0 to 3 have {fit}, from f_rest_0 on."
        raise BadFileError(path, what, "Export it again with harmonics of degree 3 or less.")
    if not names:
        return np.zeros((len(next(iter(columns.values()), [])), 0, 3), np.float32)
    values = stack_columns(columns, [f"f_rest_{k}" for k in range(len(names))])
    return values.reshape(len(values), 3, len(names) // 3).swapaxes(1, 2)


def write_splat_ply(path: Path, gaussians: Gaussians) -> Path:
    """Write the Gaussians so that other viewers open them.

    Raises:
        DiskError: The disk refuses it.
    """
    rests = [f"f_rest_{k}" for k in range(3 * (gaussians.sh.shape[1] - 1))]
    names = [
        *MEAN_PROPERTIES,
        "nx",
        "ny",
        "nz",
        *COLOUR_PROPERTIES,
        *rests,
        "opacity",
        *SCALE_PROPERTIES,
        *ROTATION_PROPERTIES,
    ]
    count = gaussians.count
    table = np.concatenate(
        [
            gaussians.mean,
            np.zeros((count, 3)),
            gaussians.sh[:, 0],
            gaussians.sh[:, 1:].swapaxes(1, 2).reshape(count, -1),
            logit(gaussians.opacity)[:, None],
            np.log(gaussians.scale.astype(np.float64)),
            gaussians.rotation,
        ],
        axis=1,
    ).astype("<f4")
    path = Path(path)
    with store.disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(format_ply_header(names, count, "written by corporeal") + table.tobytes())
    return path


def stack_columns(columns: PlyColumns, names: list[str]) -> np.ndarray:
    """Return columns side by side, (N, names), in single precision."""
    return np.stack([columns[name] for name in names], axis=-1).astype(np.float32)


def exponential(logarithms: np.ndarray) -> np.ndarray:
    """Return e to the power of numbers; infinite where there is no such number."""
    with np.errstate(over="ignore", under="ignore"):
        return np.exp(logarithms.astype(np.float64)).astype(np.float32)


def logistic(logits: np.ndarray) -> np.ndarray:
    """Return 1 / (1 + e^-x)."""
    with np.errstate(over="ignore", under="ignore"):
        return (1 / (1 + np.exp(-logits.astype(np.float64)))).astype(np.float32)


def logit(shares: np.ndarray) -> np.ndarray:
    """Return ln(p / (1 - p)); of 0 and 1, of the nearest numbers that have one."""
    p = np.clip(shares.astype(np.float64), 1e-12, MAX_OPACITY)
    return np.log(p / (1 - p))
