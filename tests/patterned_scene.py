"""Photographs that a test makes itself: a patterned block on a patterned slab, from a ring."""

from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core.types import Camera, Finish, Scene, SceneObject, Surface
from corporeal.render.camera_placement import CameraAim, camera_from_aim
from corporeal.render.embree import render_image
from corporeal.render.ray_scene import RayScene, StudioLight

OF_SLAB = 12
"""Triangles of the slab, which come first."""


def blots(seed, side=256):
    """A picture of blots of three sizes: something to find again at any scale."""
    rng, picture = np.random.default_rng(seed), np.zeros((side, side))
    for cell in (2, 8, 32):
        small = rng.random((side // cell, side // cell))
        picture += np.kron(small > 0.5, np.ones((cell, cell)))
    grey = (40 + 60 * picture).astype(np.uint8)
    return np.dstack([grey, grey[::-1], grey[:, ::-1]])


def box(low, high):
    """Vertices, triangles and texture coordinates of a box, each face with the whole picture."""
    low, high = np.array(low, float), np.array(high, float)
    vertices, triangles, uv = [], [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = [k for k in range(3) if k != axis]
            corners = np.zeros((4, 3))
            corners[:, axis] = (low, high)[side][axis]
            corners[:, u] = np.array([low[u], high[u], high[u], low[u]])
            corners[:, v] = np.array([low[v], low[v], high[v], high[v]])
            outwards = (side == 1) == (axis != 1)
            order = [0, 1, 2, 0, 2, 3] if outwards else [0, 2, 1, 0, 3, 2]
            triangles += (np.array(order).reshape(2, 3) + len(vertices)).tolist()
            vertices += corners.tolist()
            uv += [[0, 0], [1, 0], [1, 1], [0, 1]]
    return np.array(vertices), np.array(triangles), np.array(uv, float)


def patterned(seed=0):
    """A block of 10 × 8 × 12 cm on a slab of 60 cm."""
    return on_slab(box((-0.05, -0.04, 0), (0.05, 0.04, 0.12)), seed)


def stepped(turned_over=False):
    """A tower beside a step on the same slab, whose sides all look otherwise; also upside down."""
    made = [box((-0.05, -0.04, 0), (0.05, 0.04, 0.04)), box((-0.05, -0.04, 0.04), (0, 0.04, 0.12))]
    vertices = np.concatenate([v for v, _, _ in made])
    triangles = np.concatenate([t + len(made[0][0]) * k for k, (_, t, _) in enumerate(made)])
    face = np.arange(len(vertices)) // 4
    uv = (np.concatenate([u for _, _, u in made]) + np.stack([face % 4, face // 4], axis=1)) / 4
    if turned_over:  # by half a turn about x, and pushed aside
        vertices = vertices * (1, -1, -1) + np.array([0.02, 0.01, 0.12])
    return on_slab((vertices, triangles, uv), side=512)


def on_slab(block, seed=0, side=256):
    """A block, or whatever, on a slab of 60 cm; the slab's twelve triangles come first."""
    made = [box((-0.3, -0.3, -0.02), (0.3, 0.3, 0)), block]
    surfaces = tuple(
        Surface(name, k, k, v, t, uv=uv)
        for k, (name, (v, t, uv)) in enumerate(zip(("slab", "block"), made, strict=True))
    )
    finishes = tuple(Finish(f"look{k}", texture=blots(seed + k, (512, side)[k]), roughness=1.0) for k in range(2))
    things = (SceneObject("slab", "slab", 0.6), SceneObject("block", "block", 0.12))
    return Scene("patterned", "made by a test", things, surfaces, finishes)


def ring(angles, size=(400, 300), height=0.35, away=0.5):
    """Aims from a circle [deg] above the slab, at the block."""
    return [
        CameraAim((away * np.cos(a), away * np.sin(a), height), (0.0, 0.0, 0.04), 38.0, size[0], size[1])
        for a in np.radians(angles)
    ]


def photographs(folder: Path, aims, scene=None):
    """Write photographs into a folder, by number; return their cameras."""
    folder.mkdir(parents=True, exist_ok=True)
    stage = RayScene(scene or patterned(), StudioLight(front=(0.0, -1.0, 0.5)))
    for k, aim in enumerate(aims):
        picture = Image.fromarray(render_image(stage, aim, "draft"))
        picture.save(folder / f"photo_{k:03d}.jpg", quality=95)
    return [camera_from_aim(aim) for aim in aims]


def on_its_side(camera: Camera) -> Camera:
    """The camera whose picture is this one's turned by a quarter to the left."""
    turned = camera.world_from_camera.copy()
    turned[:3, 0], turned[:3, 1] = camera.world_from_camera[:3, 1], -camera.world_from_camera[:3, 0]
    K = camera.K.copy()
    K[0, 2], K[1, 2] = camera.K[1, 2], camera.width - camera.K[0, 2]
    return Camera(K, turned, camera.height, camera.width)


def pose_errors(found, true):
    """Rotation [deg] and place [share of the mean distance from the middle] after a similarity."""
    a = np.stack([c.world_from_camera[:3, 3] for c in found])
    b = np.stack([c.world_from_camera[:3, 3] for c in true])
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    u, s, vt = np.linalg.svd((b - middle_b).T @ (a - middle_a))
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn = u @ sign @ vt  # Kabsch, with Umeyama's scale
    scale = (s * np.diag(sign)).sum() / np.square(a - middle_a).sum()
    off = scale * (a - middle_a) @ turn.T - (b - middle_b)
    place = np.linalg.norm(off, axis=1) / np.linalg.norm(b - middle_b, axis=1).mean()
    pairs = zip(found, true, strict=True)
    between = [turn @ f.world_from_camera[:3, :3] @ t.world_from_camera[:3, :3].T for f, t in pairs]
    angle = np.degrees(np.arccos(np.clip([(np.trace(r) - 1) / 2 for r in between], -1, 1)))
    return angle, place
