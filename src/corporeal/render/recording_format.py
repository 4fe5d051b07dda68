"""Format of recordings: all data of a run for the viewer, as one block of bytes.

    length of the header (uint32) | header (JSON) | arrays, each on a multiple of 4 bytes

The header names every array as [offset, count, kind]. Every object moves by a rigid pose per frame. One that deforms
has, per vertex, what is left after that motion (3 × int16, ``RESIDUAL_STEP_M`` each) and a normal (2 bytes,
octahedral), both in the pose's frame: 8 bytes where float32 takes 24. Frames are kept as differences in time
(``deltas.in_time``).
"""

import io
import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, Int8, Int16, UInt8
from PIL import Image

from corporeal.core.types import Finish, Frame, Particles, Parts, Scene, Surface
from corporeal.geometry.rotation import fit_rigid_motion
from corporeal.geometry.srgb import linear_to_srgb
from corporeal.render.packed_scene import vertex_normals, vertex_positions
from corporeal.render.skin_binding import SkinBinding

MAX_SIGNED_BYTE = 127
"""Largest value of a signed byte."""


def encode_octahedral(normals: Float[np.ndarray, "N 3"]) -> Int8[np.ndarray, "N 2"]:
    """Put unit vectors into two bytes: the unit octahedron folded flat (Cigolle et al. 2014).

    The angle to the vector that is read back is about 1° at worst.
    """
    flat = normals / np.maximum(np.abs(normals).sum(axis=1, keepdims=True), 1e-12)
    corner = np.where(flat[:, :2] >= 0, 1.0, -1.0)
    folded = (1.0 - np.abs(flat[:, [1, 0]])) * corner
    return np.round(MAX_SIGNED_BYTE * np.where(flat[:, 2:] < 0, folded, flat[:, :2])).astype(np.int8)


def encode_time_deltas(values: np.ndarray) -> UInt8[np.ndarray, " N"]:
    """Lay out what changes little from frame to frame: (T, V, C) integers as bytes.

    Differences between frames, which wrap around; then axis by axis; then all low bytes before all high ones. Deflate
    finds long runs in the result.
    """
    change = values.copy()
    change[1:] -= values[:-1]
    planes = np.ascontiguousarray(np.moveaxis(change, -1, 0))
    return planes.view(np.uint8).reshape(-1, values.itemsize).T.ravel().copy()


RESIDUAL_STEP_M = 5e-5
"""Resolution of what is left after the rigid motion [m]; 16 bits of it reach 1.6 m."""
MAX_RESIDUAL_STEPS = 32767
"""Largest number of steps."""
MAX_TEXTURE_PX = 512
"""Textures are shrunk to this [px]."""
MAX_VIEW_DIAGONALS = 1.5
"""Diagonals of the scene at rest beyond which the first view lets objects go."""
MAX_STRESS_BYTE = 255
"""Byte of the largest stress: bytes are √(σ/σ_max), which keeps small stresses apart."""
STRESS_SCALE_PERCENTILE = 99.5
"""Percentile of the stresses that the scale of colours ends at: a few particles are far above."""


@dataclass(frozen=True)
class ObjectFrame:
    """One object at one instant; V vertices."""

    pose: Float[np.ndarray, "12"]
    """Rotation, row by row, and translation [m]: x = R X + t."""
    residual: Int16[np.ndarray, "V 3"] | None = None
    """In steps, in the pose's frame; None: a rigid object."""
    normal: Int8[np.ndarray, "V 2"] | None = None
    stress: Float[np.ndarray, " V"] | None = None
    """Von Mises [Pa]; None: not known."""


@dataclass(frozen=True)
class SceneBinding:
    """Who moves how; B objects, V vertices of all surfaces in order."""

    skin: SkinBinding
    vertices: tuple[Int[np.ndarray, " N"], ...]
    """Per object, its vertices."""
    members: tuple[Int[np.ndarray, " N"], ...]
    """Per object, its particles."""
    rigid: Bool[np.ndarray, " B"]
    soft: SkinBinding
    """Of vertices of objects that deform."""
    row: Int[np.ndarray, " V"]
    """Of every vertex, where it is in ``soft``; -1: nowhere."""

    @classmethod
    def of(cls, scene: Scene, particles: Particles, skin: SkinBinding) -> "SceneBinding":
        """Bind a scene's objects to their particles."""
        count = len(scene.objects)
        sizes = [len(s.vertices) for s in scene.surfaces]
        owner = np.repeat(np.array([s.object for s in scene.surfaces], dtype=np.int64), sizes)
        stiff = np.array([t.kind == "rigid" for t in particles.treatments])[particles.part]
        members = tuple(np.flatnonzero(particles.object == k) for k in range(count))
        rigid = np.array([bool(stiff[mine].all()) for mine in members])
        keep = np.flatnonzero(~rigid[owner])
        row = np.full(len(owner), -1, dtype=np.int64)
        row[keep] = np.arange(len(keep))
        names = ("rest", "normals", "near", "weight")
        soft = replace(skin, flowing=None, **{n: getattr(skin, n)[keep] for n in names})
        vertices = tuple(np.flatnonzero(owner == k) for k in range(count))
        return cls(skin, vertices, members, rigid, soft, row)

    def at(self, frame: Frame) -> list[ObjectFrame]:
        """Return every object at one instant."""
        place, turned = self.soft.pose(frame)
        stress = None
        if frame.stress is not None:
            stress = (self.soft.weight * frame.stress[self.soft.near]).sum(axis=1)
        return [self._object(k, frame, place, turned, stress) for k in range(len(self.rigid))]

    def _object(
        self, k: int, frame: Frame, place: np.ndarray, turned: np.ndarray, stress: np.ndarray | None
    ) -> ObjectFrame:
        R, t = self._pose(k, frame)
        pose = np.concatenate([R.ravel(), t])
        if self.rigid[k]:
            return ObjectFrame(pose)
        mine, rest = self.row[self.vertices[k]], self.skin.rest[self.vertices[k]]
        left = ((place[mine] - t) @ R - rest) / RESIDUAL_STEP_M
        whole = np.clip(np.round(left), -MAX_RESIDUAL_STEPS, MAX_RESIDUAL_STEPS).astype(np.int16)
        normal = encode_octahedral(turned[mine] @ R)
        return ObjectFrame(pose, whole, normal, None if stress is None else stress[mine])

    def _pose(self, k: int, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Rotation and translation [m] of an object as a whole."""
        mine = self.members[k]
        now, start = frame.position[mine].astype(float), self.skin.start[mine]
        here = np.isfinite(now).all(axis=1)
        if not here.any():
            return np.eye(3), np.zeros(3)
        if self.rigid[k]:
            R = np.asarray(frame.deformation[mine[0]], dtype=float)
            return R, now[here].mean(axis=0) - R @ start[here].mean(axis=0)
        fit = fit_rigid_motion(start[here], now[here], np.ones(int(here.sum())))
        return fit.rotation, fit.moved - fit.rotation @ fit.centre


@dataclass(frozen=True)
class RecordedGaussians:
    """N Gaussians at rest, those of one object after those of another."""

    mean: Float[np.ndarray, "N 3"]
    """[m]"""
    covariance: Float[np.ndarray, "N 6"]
    """xx, xy, xz, yy, yz, zz [m²]."""
    colour: UInt8[np.ndarray, "N 4"]
    """sRGB and opacity."""
    object: Int[np.ndarray, " N"]
    """-1: of none, it does not move."""
    vertex: Int[np.ndarray, " N"]
    """Of its object: the one that it follows."""
    all: int
    """How many there were."""


@dataclass(frozen=True)
class Recording:
    """What happened, frame by frame."""

    time: Float[np.ndarray, " T"]
    """[s]"""
    objects: tuple[tuple[ObjectFrame, ...], ...]
    """Per object, its frames."""
    since: Mapping[int, float] = field(default_factory=dict)
    """From when on an object is there [s], of those that are not from the start."""

    def every(self, step: int) -> "Recording":
        """Leave frames out: keep one of ``step``."""
        objects = tuple(frames[::step] for frames in self.objects)
        return Recording(self.time[::step], objects, self.since)

    @property
    def largest_stress(self) -> float:
        """Where the scale of colours ends [Pa]; 0: stress is not known, or there is none."""
        every = [f.stress for frames in self.objects for f in frames if f.stress is not None]
        tops = [float(np.percentile(s, STRESS_SCALE_PERCENTILE)) for s in every if len(s)]
        return max(tops, default=0.0)

    @property
    def out_of_reach(self) -> int:
        """Number of vertices that went farther from their object than 16 bits reach."""
        soft = [[f.residual for f in frames if f.residual is not None] for frames in self.objects]
        far = [np.any([(np.abs(r) == MAX_RESIDUAL_STEPS).any(axis=1) for r in rows], axis=0) for rows in soft]
        return int(sum(np.sum(f) for f in far))


def record_frames(cast: SceneBinding, frames: Iterable[Frame]) -> Recording:
    """Take down every object in every frame."""
    times, rows = [], []
    for frame in frames:
        times.append(frame.time)
        rows.append(cast.at(frame))
    return Recording(np.array(times), tuple(zip(*rows, strict=True)))


class ArrayBlock:
    """Arrays laid one behind the other."""

    def __init__(self) -> None:
        self.data: list[bytes] = []
        self.size = 0

    def add(self, array: np.ndarray) -> list:
        """Add an array; return where it is, how many numbers it has, and of which kind."""
        array = np.ascontiguousarray(array)
        raw = array.tobytes() + b"\0" * (-array.nbytes % 4)
        here, self.size = self.size, self.size + len(raw)
        self.data.append(raw)
        return [here, array.size, array.dtype.str[1:]]

    def under(self, header: Mapping[str, Any]) -> bytes:
        """Return the header and all arrays."""
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        return len(text).to_bytes(4, "little") + text + b"".join(self.data)


def pack_recording(
    scene: Scene,
    parts: Parts,
    cast: SceneBinding,
    recording: Recording | None,
    summary: Mapping[str, Any],
    splats: RecordedGaussians | None = None,
) -> bytes:
    """Return the whole block.

    Args:
        scene: Surfaces at rest, and how they look.
        parts: Which triangle belongs to which part.
        cast: From ``Cast.of``.
        recording: From ``record_frames``; None: frames come later, from a simulation that runs.
        summary: What the page shows of the run: goes into the header as it is.
        splats: Of a scene that was made of Gaussians.
    """
    block = ArrayBlock()
    low, high = _view_bounds(cast, recording)
    header = {
        "name": scene.name,
        "duration": scene.duration,
        "step": RESIDUAL_STEP_M,
        "low": low.tolist(),
        "high": high.tolist(),
        "objects": [
            {
                "name": o.name,
                "rigid": bool(r),
                "vertices": len(v),
                "velocity": list(o.velocity),
                "height": float(cast.skin.rest[v, 2].min()) if len(v) else 0.0,
            }
            for o, r, v in zip(scene.objects, cast.rigid, cast.vertices, strict=True)
        ],
        "surfaces": _surfaces(scene, parts, cast, block),
        "finishes": [_finish(f) for f in scene.finishes],
        "video": None if recording is None else _frames_block(recording, block),
        "splats": None if splats is None else _splats(splats, block),
    }
    return block.under({**header, **summary})


def _splats(splats: RecordedGaussians, block: ArrayBlock) -> dict:
    return {
        "count": len(splats.mean),
        "all": splats.all,
        "mean": block.add(splats.mean.astype("<f4")),
        "covariance": block.add(splats.covariance.astype("<f4")),
        "colour": block.add(splats.colour),
        "object": block.add(splats.object.astype("<i2")),
        "vertex": block.add(splats.vertex.astype("<u4")),
    }


def _view_bounds(cast: SceneBinding, recording: Recording | None) -> tuple[np.ndarray, np.ndarray]:
    """Corners of what there is to see [m]: floor, objects and their way, but not what goes far."""
    rest = cast.skin.rest
    low, high = np.append(rest.min(axis=0)[:2], min(rest[:, 2].min(), 0.0)), rest.max(axis=0)
    middle, reach = (low + high) / 2, MAX_VIEW_DIAGONALS * np.linalg.norm(high - low)
    corners = [low, high]
    for k, frames in enumerate(recording.objects if recording else ()):
        mine = rest[cast.vertices[k]]
        box = np.array([mine.min(axis=0), mine.max(axis=0)])
        corner = box[(np.arange(8)[:, None] >> np.arange(3)) & 1, np.arange(3)]
        for frame in frames:
            there = corner @ frame.pose[:9].reshape(3, 3).T + frame.pose[9:]
            if np.linalg.norm(there.mean(axis=0) - middle) < reach:
                corners += [there.min(axis=0), there.max(axis=0)]
    ends = np.array(corners)
    ends[:, 2] = np.maximum(ends[:, 2], low[2])
    return ends.min(axis=0), ends.max(axis=0)


def _surfaces(scene: Scene, parts: Parts, cast: SceneBinding, block: ArrayBlock) -> list[dict]:
    first = np.cumsum([0, *(len(s.vertices) for s in scene.surfaces)])
    corner = np.cumsum([0, *(len(s.triangles) for s in scene.surfaces)])
    rest, normal = vertex_positions(scene), vertex_normals(scene)
    out = []
    for k, s in enumerate(scene.surfaces):
        mine = slice(int(first[k]), int(first[k + 1]))
        part = parts.part_of_point[corner[k] : corner[k + 1]]
        small = len(s.vertices) <= np.iinfo(np.uint16).max
        out.append(
            {
                "object": s.object,
                "finish": s.finish,
                "start": int(np.searchsorted(cast.vertices[s.object], first[k])),
                "count": len(s.vertices),
                "place": block.add(rest[mine].astype("<f4")),
                "normal": block.add(encode_octahedral(normal[mine])),
                "triangles": block.add(s.triangles.astype("<u2" if small else "<u4")),
                "part": block.add(part.astype("<i2")),
                "uv": None if s.uv is None else block.add(np.nan_to_num(s.uv).astype("<f4")),
                "colour": None if s.colours is None else block.add(_bytes_of(s)),
            }
        )
    return out


def _bytes_of(surface: Surface) -> UInt8[np.ndarray, "V 3"]:
    """Return the colours of vertices as sRGB."""
    assert surface.colours is not None
    return np.round(255 * linear_to_srgb(np.nan_to_num(surface.colours[:, :3], nan=1.0))).astype(np.uint8)


def _frames_block(recording: Recording, block: ArrayBlock) -> dict:
    top = recording.largest_stress
    return {
        "time": recording.time.tolist(),
        "stress": top,
        "out_of_reach": recording.out_of_reach,
        "since": {str(number): time for number, time in recording.since.items()},
        "objects": [_frames_bytes(frames, top, block) for frames in recording.objects],
    }


def _frames_bytes(frames: Sequence[ObjectFrame], top: float, block: ArrayBlock) -> dict:
    tracks: dict[str, Any] = {"pose": block.add(np.array([f.pose for f in frames], "<f4"))}
    residual = [f.residual for f in frames if f.residual is not None]
    normal = [f.normal for f in frames if f.normal is not None]
    stress = [f.stress for f in frames if f.stress is not None]
    if residual:
        tracks["residual"] = block.add(encode_time_deltas(np.array(residual, "<i2")))
        tracks["normal"] = block.add(encode_time_deltas(np.array(normal)))
    if stress and top > 0:
        tracks["stress"] = block.add(encode_time_deltas(stress_bytes(np.array(stress), top)[..., None]))
    return tracks


def stress_bytes(stress: Float[np.ndarray, "*N"], top: float) -> UInt8[np.ndarray, "*N"]:
    """Return stresses [Pa] as bytes on the page's scale, which ends at ``top`` [Pa]."""
    return np.round(MAX_STRESS_BYTE * np.sqrt(np.clip(stress / top, 0.0, 1.0))).astype(np.uint8)


def _finish(finish: Finish) -> dict:
    return {
        "colour": [float(c) for c in finish.colour],
        "roughness": float(finish.roughness),
        "metallic": float(finish.metallic),
        "transmission": float(finish.transmission),
        "alpha": finish.alpha_mode,
        "cutoff": float(finish.alpha_cutoff),
        "texture": None if finish.texture is None else _picture(finish.texture),
    }


def _picture(texture: np.ndarray) -> str:
    """Return a texture, shrunk, as an address that holds it."""
    image = Image.fromarray(texture.squeeze())
    image.thumbnail((MAX_TEXTURE_PX, MAX_TEXTURE_PX))
    kind = "png" if "A" in image.mode else "jpeg"
    file = io.BytesIO()
    image.save(file, kind, quality=85)
    return f"data:image/{kind};base64,{b64encode(file.getvalue()).decode()}"
