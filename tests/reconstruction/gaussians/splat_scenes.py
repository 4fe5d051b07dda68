"""Small scenes for tests: cameras about the origin, and pictures of known Gaussians."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from corporeal.core.types import Camera, Gaussians, Views
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.gaussians.gaussian_parameters import parameters_of_gaussians
from corporeal.reconstruction.gaussians.rasteriser_numba import draw, picture_of_drawing, pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool


def around(count, size=(48, 40), distance=3.0, focal=50.0, centre=(0.0, 0.0, 0.0)):
    """Cameras on a spiral about a point, looking at it."""
    cameras = []
    for k in range(count):
        z = 0.8 - 1.2 * (k + 0.5) / count
        turn = 2.4 * k
        flat = np.sqrt(1 - z * z)
        back = np.array([flat * np.cos(turn), flat * np.sin(turn), z])
        right = np.cross([0, 0, 1], back) / flat
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(right, back), -back, centre + distance * back], axis=1)
        K = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1]])
        cameras.append(Camera(K, pose, *size))
    return tuple(cameras)


def blobs(count=60, seed=0, degree=0):
    """Coloured blobs within a ball of radius 0.6."""
    rng = np.random.default_rng(seed)
    sh = np.zeros((count, (degree + 1) ** 2, 3))
    sh[:, 0] = (rng.random((count, 3)) - 0.5) / 0.2821
    return Gaussians(
        mean=rng.normal(size=(count, 3)) * 0.25,
        rotation=np.tile([1.0, 0, 0, 0], (count, 1)),
        scale=rng.uniform(0.05, 0.15, (count, 3)),
        opacity=rng.uniform(0.7, 0.95, count),
        sh=sh,
    )


def pictured(gaussians, cameras, background=(0.0, 0.0, 0.0)):
    """Views of some Gaussians, and masks of where they are."""
    made = []
    with ThreadPool(1) as pool:
        for camera in cameras:
            drawing = draw(parameters_of_gaussians(gaussians), pinhole_of_camera(camera), np.array(background), pool)
            made.append(picture_of_drawing(drawing))
    rgb = np.stack([np.round(np.clip(p.rgb, 0, 1) * 255).astype(np.uint8) for p in made])
    return Views(rgb, cameras), np.stack([p.alpha > 0.5 for p in made])


def clad(mesh, count=5000, colour=(0.8, 0.3, 0.1), seed=0):
    """Flat Gaussians on a mesh's surface."""
    points, face = trimesh.sample.sample_surface_even(mesh, count, seed=seed)
    normal = mesh.face_normals[face]
    across = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    axes = np.stack([across, np.cross(normal, across), normal], axis=2)
    wide = 0.8 * np.sqrt(mesh.area / count)
    sh = np.tile((np.array(colour) - 0.5) / SH_DC_COEFFICIENT, (len(points), 1, 1))
    return Gaussians(
        mean=np.asarray(points),
        rotation=Rotation.from_matrix(axes).as_quat(scalar_first=True),
        scale=np.tile([wide, wide, 0.1 * wide], (len(points), 1)),
        opacity=np.full(len(points), 0.95),
        sh=sh,
    )


def together(*some):
    """All Gaussians, and which of these each is one of."""
    owner = np.repeat(np.arange(len(some)), [g.count for g in some])
    names = ("mean", "rotation", "scale", "opacity", "sh")
    whole = {n: np.concatenate([getattr(g, n) for g in some]) for n in names}
    return Gaussians(**whole), owner


def eyes(count=16, focal=168.0, centre=(0.0, 0.0, 0.5)):
    """Cameras above the floor."""
    return tuple(
        c for c in around(2 * count, (192, 192), 3.5, focal, np.array(centre)) if c.world_from_camera[2, 3] > 0.8
    )
