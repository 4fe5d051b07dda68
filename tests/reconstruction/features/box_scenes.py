"""Boxes cast ray by ray: depth, and which box, of every pixel; and points on their faces."""

import numpy as np

from corporeal.core.types import Camera

TWO = (((-0.5, -0.25, 0.0), (0.0, 0.25, 0.5)), ((0.0, -0.2, 0.0), (0.4, 0.2, 0.3)))
"""Two boxes that touch: lowest and highest corner of each [m]."""


def around(count, size=96, distance=2.2, focal=120.0, centre=(0.0, 0.0, 0.2)):
    """Cameras on a spiral above the floor, looking at the middle."""
    cameras = []
    for k in range(count):
        z = 0.15 + 0.75 * (k + 0.5) / count
        flat = np.sqrt(1 - z * z)
        back = np.array([flat * np.cos(2.4 * k), flat * np.sin(2.4 * k), z])
        right = np.cross([0, 0, 1], back) / flat
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(right, back), -back, centre + distance * back], 1)
        K = np.array([[focal, 0, size / 2], [0, focal, size / 2], [0, 0, 1.0]])
        cameras.append(Camera(K, pose, size, size))
    return tuple(cameras)


def cast(boxes, camera):
    """Depth along z [m] and index of the box (-1: none) of every pixel's middle (slab method)."""
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    local = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(camera.K).T
    ray = local @ camera.world_from_camera[:3, :3].T
    eye = camera.world_from_camera[:3, 3]
    depth, which = np.full(u.shape, np.inf), np.full(u.shape, -1)
    for k, (low, high) in enumerate(boxes):
        with np.errstate(divide="ignore"):
            a, b = (low - eye) / ray, (high - eye) / ray
        enter, leave = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
        hit = (enter <= leave) & (enter > 0) & (enter < depth)
        depth[hit], which[hit] = enter[hit], k
    return depth, which


def on_faces(boxes, count, rng):
    """Points on all faces of every box, ``count`` each, with their normals and boxes."""
    points, normals, owner = [], [], []
    for k, (low, high) in enumerate(np.array(boxes)):
        edge = high - low
        area = np.repeat([edge[1] * edge[2], edge[0] * edge[2], edge[0] * edge[1]], 2)
        face = rng.choice(6, count, p=area / area.sum())
        p = low + rng.random((count, 3)) * edge
        axis, far = face // 2, face % 2 == 1
        p[np.arange(count), axis] = np.where(far, high[axis], low[axis])
        n = np.zeros((count, 3))
        n[np.arange(count), axis] = np.where(far, 1.0, -1.0)
        points.append(p), normals.append(n), owner.append(np.full(count, k))
    return np.concatenate(points), np.concatenate(normals), np.concatenate(owner)


def one_hot(which, patch, labels):
    """Share of each label (column 0: nothing) in every patch, as a model's map is coarse."""
    rows, columns = which.shape[0] // patch, which.shape[1] // patch
    flat = np.eye(labels + 1)[which + 1].reshape(rows, patch, columns, patch, labels + 1)
    return flat.mean((1, 3)).astype(np.float16)


def unhidden(boxes, position, normal, owner, camera):
    """Say which points on faces nothing stands before, ray by ray."""
    eye = camera.world_from_camera[:3, 3]
    ray = eye - position
    free = (ray * normal).sum(1) > 0
    for k, (low, high) in enumerate(np.array(boxes)):
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (low - position) / ray, (high - position) / ray
        enter, leave = np.fmin(a, b).max(1), np.fmax(a, b).min(1)
        free &= (owner == k) | (leave <= np.maximum(enter, 0) + 1e-9)
    return free
