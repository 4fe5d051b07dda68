"""A scene's surfaces as flat arrays that the ray caster's loops can read."""

from typing import NamedTuple

import numpy as np
from PIL import Image

from corporeal.core.types import Finish, Scene, Surface
from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.srgb import linear_to_srgb, srgb_to_linear

MAX_TEXTURE_PX = 2048
"""Larger pictures are halved: a video of 1280 pixels cannot show more."""
ALPHA_MODES = {"OPAQUE": 0.0, "MASK": 1.0, "BLEND": 2.0}
RED, GREEN, BLUE, ALPHA, METAL, ROUGH, TRANSMIT, TRANSLUCENT, GLOW, MODE, CUT, TEXTURE = range(12)
"""Columns of ``Look.finish``."""


class PackedScene(NamedTuple):
    """All surfaces as one triangle soup; V vertices, T triangles, F finishes. Kernels read it."""

    triangles: np.ndarray
    """(T, 3) int32"""
    uv: np.ndarray
    """(V, 2) float32, v down"""
    colours: np.ndarray
    """(V, 4) float32, linear"""
    finish_of_triangle: np.ndarray
    """(T,) int32"""
    smooth: np.ndarray
    """(T,) bool: normals came with the mesh; otherwise they bend only up to a crease."""
    density: np.ndarray
    """(T,) float32: texels per metre"""
    finish: np.ndarray
    """(F, 12) float32"""
    texels: np.ndarray
    """All pyramids one after the other, RGBA sRGB uint8"""
    levels: np.ndarray
    """(textures, levels, 3) int64: offset, height, width; height 0 ends a pyramid"""


def pack_scene(scene: Scene) -> PackedScene:
    """Gather what does not move."""
    surfaces = scene.surfaces
    finish = np.array([_row(f) for f in scene.finishes], dtype=np.float32).reshape(-1, 12)
    texels, levels = _pyramids(scene.finishes, finish)
    counts = [len(s.triangles) for s in surfaces]
    own = [np.full(n, s.normals is not None) for s, n in zip(surfaces, counts, strict=True)]
    return PackedScene(
        triangles=join_meshes(surfaces).triangles.astype(np.int32),
        uv=_join([_uv(s) for s in surfaces], (0, 2), np.float32),
        colours=_join([_colours(s) for s in surfaces], (0, 4), np.float32),
        finish_of_triangle=np.repeat([s.finish for s in surfaces], counts).astype(np.int32),
        smooth=_join(own, (0,), np.bool_),
        density=_join([_density(s, finish, levels) for s in surfaces], (0,), np.float32),
        finish=finish,
        texels=texels,
        levels=levels,
    )


def with_plain_colours(look: PackedScene, shades: np.ndarray, shade_of_triangle: np.ndarray) -> PackedScene:
    """Return the same triangles without textures, each in one of the ``shades`` (S, 3) linear."""
    finish = np.zeros((len(shades), 12), dtype=np.float32)
    finish[:, :3] = shades
    finish[:, ALPHA] = 1
    finish[:, ROUGH] = 0.8
    finish[:, TEXTURE] = -1
    return look._replace(
        colours=np.ones_like(look.colours), finish=finish, finish_of_triangle=shade_of_triangle.astype(np.int32)
    )


def with_new_triangles(
    look: PackedScene, kept: np.ndarray, triangles: np.ndarray, finish: np.ndarray, vertices: int
) -> PackedScene:
    """Return some of the triangles and new ones behind them, which are smooth and plain.

    Args:
        look: Before.
        kept: Which of its triangles stay (T,).
        triangles: New ones (N, 3), int32.
        finish: Of each new one (N,), int32.
        vertices: How many there are then, of which the first are those before.
    """
    more, new = vertices - len(look.uv), len(triangles)
    return look._replace(
        triangles=np.ascontiguousarray(np.concatenate([look.triangles[kept], triangles])),
        uv=np.concatenate([look.uv, np.zeros((more, 2), np.float32)]),
        colours=np.concatenate([look.colours, np.ones((more, 4), np.float32)]),
        finish_of_triangle=np.concatenate([look.finish_of_triangle[kept], finish]),
        smooth=np.concatenate([look.smooth[kept], np.ones(new, np.bool_)]),
        density=np.concatenate([look.density[kept], np.zeros(new, np.float32)]),
    )


def has_transparency(look: PackedScene) -> bool:
    """Whether any ray may pass a surface that it meets."""
    f = look.finish
    return bool(((f[:, MODE] > 0) | (f[:, TRANSMIT] > 0)).any())


def vertex_normals(scene: Scene) -> np.ndarray:
    """(V, 3) unit normals of the scene at rest, made where the file has none."""
    return _join([_normals(s) for s in scene.surfaces], (0, 3), np.float64)


def vertex_positions(scene: Scene) -> np.ndarray:
    """(V, 3) of all surfaces in order [m]."""
    places = _join([s.vertices for s in scene.surfaces], (0, 3), np.float64)
    return np.where(np.all(np.isfinite(places), axis=1)[:, None], places, 0.0)


def _join(arrays: list[np.ndarray], empty: tuple[int, ...], kind: type) -> np.ndarray:
    if not arrays:
        return np.zeros(empty, dtype=kind)
    return np.ascontiguousarray(np.concatenate(arrays), dtype=kind)


def _row(f: Finish) -> list[float]:
    return [
        *(float(c) for c in f.colour),
        f.metallic,
        f.roughness,
        f.transmission,
        f.translucency,
        f.emission,
        ALPHA_MODES[f.alpha_mode],
        f.alpha_cutoff,
        -1.0,
    ]


def _uv(s: Surface) -> np.ndarray:
    uv = np.zeros((len(s.vertices), 2)) if s.uv is None else s.uv
    return np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)


def _colours(s: Surface) -> np.ndarray:
    out = np.ones((len(s.vertices), 4))
    if s.colours is not None:
        out[:, : s.colours.shape[1]] = s.colours
    return np.nan_to_num(out, nan=1.0)


def _normals(s: Surface) -> np.ndarray:
    made = _smooth_normals(s)
    if s.normals is None:
        return made
    length = np.linalg.norm(s.normals, axis=1, keepdims=True)
    good = np.isfinite(length) & (length > 1e-6)
    return np.where(good, s.normals / np.where(good, length, 1), made)


def _smooth_normals(s: Surface) -> np.ndarray:
    """Area-weighted over all triangles that meet at a position."""
    p = s.vertices[s.triangles]
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    total = np.zeros((len(s.vertices), 3))
    for corner in range(3):
        np.add.at(total, s.triangles[:, corner], face)
    _, group = np.unique(s.vertices, axis=0, return_inverse=True)
    group = group.reshape(-1)
    welded = np.zeros((group.max(initial=-1) + 1, 3))
    np.add.at(welded, group, total)
    total = welded[group]
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 1e-30, total / np.maximum(length, 1e-30), [0.0, 0.0, 1.0])


def _density(s: Surface, finish: np.ndarray, levels: np.ndarray) -> np.ndarray:
    k = int(finish[s.finish, TEXTURE])
    if k < 0 or s.uv is None:
        return np.zeros(len(s.triangles))
    p, q = s.vertices[s.triangles], _uv(s)[s.triangles] * levels[k, 0, :0:-1]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    e, g = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    area_uv = np.abs(e[:, 0] * g[:, 1] - e[:, 1] * g[:, 0])
    return np.sqrt(area_uv / np.maximum(area, 1e-30))


def _pyramids(finishes: tuple[Finish, ...], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every texture once, halved again and again; writes the texture's number into ``rows``."""
    known: dict[int, int] = {}
    stacks: list[list[np.ndarray]] = []
    for k, f in enumerate(finishes):
        if f.texture is None or f.texture.size == 0:
            continue
        if id(f.texture) not in known:
            known[id(f.texture)] = len(stacks)
            stacks.append(_pyramid(f.texture))
        rows[k, TEXTURE] = known[id(f.texture)]
    levels = np.zeros((len(stacks), max((len(s) for s in stacks), default=1) + 1, 3), np.int64)
    offset = 0
    for t, stack in enumerate(stacks):
        for n, level in enumerate(stack):
            levels[t, n] = offset, *level.shape[:2]
            offset += level.shape[0] * level.shape[1]
    flat = [level.reshape(-1, 4) for stack in stacks for level in stack]
    return (np.concatenate(flat) if flat else np.zeros((1, 4), np.uint8)), levels


def _pyramid(texture: np.ndarray) -> list[np.ndarray]:
    image = _rgba(texture)
    levels = [image]
    light = np.concatenate([srgb_to_linear(image[..., :3] / 255), image[..., 3:] / 255], axis=2)
    light[..., :3] *= light[..., 3:]
    light = light.astype(np.float32)
    while max(light.shape[:2]) > 1:
        h, w = light.shape[:2]
        down = 2 if h > 1 else 1, 2 if w > 1 else 1
        light = light.reshape(h // down[0], down[0], w // down[1], down[1], 4).mean(axis=(1, 3))
        alpha = light[..., 3:]
        rgb = linear_to_srgb(light[..., :3] / np.maximum(alpha, 1e-4))
        levels.append((np.concatenate([rgb, alpha], axis=2) * 255 + 0.5).astype(np.uint8))
    return levels


def _rgba(texture: np.ndarray) -> np.ndarray:
    """Power-of-two sides, four channels."""
    channels = texture.shape[2] if texture.ndim == 3 else 1
    mode = {1: "L", 2: "LA", 3: "RGB", 4: "RGBA"}[channels]
    flat = np.ascontiguousarray(texture if channels > 1 else texture.reshape(texture.shape[:2]))
    image = Image.frombytes(mode, (texture.shape[1], texture.shape[0]), flat.tobytes())
    image = image.convert("RGBA")
    size = tuple(min(2 ** max(int(np.round(np.log2(n))), 0), MAX_TEXTURE_PX) for n in image.size)
    if size != image.size:
        image = image.resize(size, Image.Resampling.LANCZOS)
    return np.asarray(image)
