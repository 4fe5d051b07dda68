"""Similarity transforms of a scene: points, cameras and Gaussians.

A similarity is a matrix (4, 4) that takes x to s R x + t: its upper left is s R, its last column t. Pictures before and
after are the same, but that depths are multiplied by s.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera, Gaussians, Vector
from corporeal.geometry.gaussian_transforms import transform_gaussians

SimilarityMatrix = Float[np.ndarray, "4 4"]
SIMILARITY_TOLERANCE = 1e-6


class SimilarityTransform(NamedTuple):
    """A similarity in its parts."""

    rotation: Float[np.ndarray, "3 3"]
    scale: float
    shift: Vector


def similarity_matrix(
    rotation: Float[np.ndarray, "3 3"] | None = None,
    scale: float = 1.0,
    shift: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
) -> SimilarityMatrix:
    """Return the matrix that takes x to scale · R x + shift."""
    made = np.eye(4)
    made[:3, :3] = scale * (np.eye(3) if rotation is None else rotation)
    made[:3, 3] = shift
    return made


def decompose_similarity(matrix: SimilarityMatrix) -> SimilarityTransform:
    """Return the parts of a similarity.

    Raises:
        ValueError: The matrix mirrors, shears, or is not finite.
    """
    if not np.isfinite(matrix).all():
        raise ValueError("A matrix with numbers that are not finite is not a similarity.")
    scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
    if not scale > 0:
        raise ValueError(f"A matrix of determinant {scale**3:.3g} is not a similarity.")
    rotation = matrix[:3, :3] / scale
    off = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if not off < SIMILARITY_TOLERANCE or not np.allclose(matrix[3], [0, 0, 0, 1]):
        raise ValueError(f"A matrix that shears by {off:.3g} is not a similarity.")
    x, y, z = matrix[:3, 3].tolist()
    return SimilarityTransform(rotation, scale, (x, y, z))


def apply_similarity_to_points(points: Float[np.ndarray, "N 3"], matrix: SimilarityMatrix) -> Float[np.ndarray, "N 3"]:
    """Return where points come to be."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def apply_similarity_to_cameras(cameras: Sequence[Camera], matrix: SimilarityMatrix) -> tuple[Camera, ...]:
    """Return cameras that see the moved scene as they saw it before; lenses stay."""
    rotation, scale, shift = decompose_similarity(matrix)

    def moved(camera: Camera) -> Camera:
        pose = camera.world_from_camera.astype(np.float64)
        turned = similarity_matrix(rotation @ pose[:3, :3], 1.0, scale * rotation @ pose[:3, 3] + shift)
        return replace(camera, world_from_camera=turned)

    return tuple(moved(camera) for camera in cameras)


def apply_similarity_to_gaussians(gaussians: Gaussians, matrix: SimilarityMatrix) -> Gaussians:
    """Return the same Gaussians elsewhere: places, rotations, scales and harmonics."""
    return transform_gaussians(gaussians, *decompose_similarity(matrix))
