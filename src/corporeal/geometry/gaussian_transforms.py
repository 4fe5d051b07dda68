"""Similarity transforms and validation of Gaussians."""

from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import Gaussians, Vector
from corporeal.geometry.rotation import quaternion_from_matrix, quaternion_product
from corporeal.geometry.spherical_harmonics import rotate_sh

UpAxis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
"""Which of a file's axes points up."""
UpAxisChoice = Literal["auto", "x", "-x", "y", "-y", "z", "-z"]
"""Transform given by the user."""
MAX_COORDINATE_UNITS = 1e6
"""Nothing is as far away or as large as this, in the file's unit."""
MIN_GAUSSIAN_SCALE_UNITS = 1e-9
"""Flatter ones are taken to be that thick, in the file's unit."""
MIN_QUATERNION_NORM = 1e-6
"""A quaternion shorter than this is no rotation."""


def rotation_to_z_up(up: UpAxis) -> Float[np.ndarray, "3 3"]:
    """Return the rotation to +Z up: a quarter turn about x for ±y, about y for ±x.

    What INRIA's and COLMAP's files call down is +y, so that their up is "-y".
    """
    sign = 1.0 if up[0] == "+" else -1.0
    rotations = {
        "x": [[0, 0, -sign], [0, 1, 0], [sign, 0, 0]],
        "y": [[1, 0, 0], [0, 0, -sign], [0, sign, 0]],
        "z": [[1, 0, 0], [0, sign, 0], [0, 0, sign]],
    }
    return np.array(rotations[up[1]], dtype=float)


def chosen_up_axis(asked: UpAxisChoice) -> UpAxis | None:
    """Return the axis that a person named; None: they leave it to the file."""
    names: dict[UpAxisChoice, UpAxis] = {"x": "+x", "y": "+y", "z": "+z", "-x": "-x", "-y": "-y", "-z": "-z"}
    return names.get(asked)


def transform_gaussians(
    gaussians: Gaussians, rotation: Float[np.ndarray, "3 3"], scale: float = 1.0, shift: Vector = (0.0, 0.0, 0.0)
) -> Gaussians:
    """Return the same scene after x → scale · R x + shift; its colours turn with it."""
    kind = gaussians.mean.dtype
    mean = scale * gaussians.mean.astype(np.float64) @ rotation.T + np.array(shift)
    return replace(
        gaussians,
        mean=mean.astype(kind),
        rotation=quaternion_product(quaternion_from_matrix(rotation), gaussians.rotation).astype(kind),
        scale=(scale * gaussians.scale).astype(kind),
        sh=rotate_sh(gaussians.sh, rotation),
    )


def gaussian_subset(gaussians: Gaussians, which: Bool[np.ndarray, " N"]) -> Gaussians:
    """Return some of the Gaussians."""
    fields = ("mean", "rotation", "scale", "opacity", "sh")
    return replace(gaussians, **{name: getattr(gaussians, name)[which] for name in fields})


def drop_invalid_gaussians(raw: Gaussians) -> tuple[Gaussians, dict[str, int]]:
    """Return what can be used, with unit quaternions, and how many were left out for what."""
    length = np.linalg.norm(raw.rotation.astype(np.float64), axis=1)
    finite = _finite_rows(raw)
    reasons = {
        "hold NaN or infinite numbers": ~finite,
        "have a rotation of length 0": finite & ~(length >= MIN_QUATERNION_NORM),
        f"are {MAX_COORDINATE_UNITS:.0e} units or more away or large": finite & _huge_rows(raw),
    }
    bad = np.any(list(reasons.values()), axis=0)
    counts = {why: int(which.sum()) for why, which in reasons.items() if which.any()}
    good = slice(None) if not counts else ~bad
    unit = raw.rotation[good] / length[good, None]
    return (
        replace(
            raw,
            mean=_single_precision(raw.mean[good]),
            rotation=_single_precision(unit),
            scale=_single_precision(np.maximum(raw.scale[good], MIN_GAUSSIAN_SCALE_UNITS)),
            opacity=_single_precision(np.clip(raw.opacity[good], 0, 1)),
            sh=_single_precision(raw.sh[good]),
        ),
        counts,
    )


def _finite_rows(raw: Gaussians) -> Bool[np.ndarray, " N"]:
    good = np.isfinite(raw.opacity)
    for values in (raw.mean, raw.rotation, raw.scale, raw.sh.reshape(raw.count, -1)):
        good &= np.isfinite(values).all(axis=1)
    return good


def _huge_rows(raw: Gaussians) -> Bool[np.ndarray, " N"]:
    return (np.abs(raw.mean).max(axis=1) >= MAX_COORDINATE_UNITS) | (raw.scale.max(axis=1) >= MAX_COORDINATE_UNITS)


def _single_precision(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=np.float32)
