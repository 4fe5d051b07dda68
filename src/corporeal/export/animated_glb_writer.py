"""A scene as one animated GLB: rigid objects move as nodes, soft ones by a few morph targets.

Morph targets are modes of the shapes (``export/animated_glb_writer.py``), kept as normalised 16 and 8 bit integers
(KHR_mesh_quantization): a video takes a sixth of what keyframes of all vertices would.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.core.errors import UserError
from corporeal.core.store import write_bytes
from corporeal.core.types import Surface
from corporeal.export.export_target import ExportRequest, WrittenTarget
from corporeal.export.exported_solids import ExportedSolid
from corporeal.export.scene_motion import PosedSurfaces
from corporeal.io.gltf.glb_writer import ACCESSOR_TYPE_OF_WIDTH, FLOAT, VERTEX_BUFFER, GlbDocument

BLOCK_VERTICES_COUNT = 8192
"""Vertices that are looked at together."""
MIN_MODE_EIGENVALUE_RATIO = 1e-14
"""Of the largest: eigenvalues below it are rounding."""


@dataclass(frozen=True)
class ShapeModes:
    """Vertices at frame f are base + Σ_k weights[f, k] targets[k]; r modes."""

    base: Float[np.ndarray, "V 3"]
    """[m]"""
    targets: Float[np.ndarray, "r V 3"]
    """[m]"""
    weights: Float[np.ndarray, "F r"]
    """In [0, 1], so that no viewer clips them."""
    error: float
    """Largest distance of any vertex at any frame from where it should be [m]."""

    @property
    def count(self) -> int:
        """Number of modes r."""
        return len(self.targets)


def fit_shape_modes(shapes: Float[np.ndarray, "F V 3"], tolerance: float, most: int) -> ShapeModes:
    """Take the fewest leading singular vectors of the shapes that keep the tolerance.

    The singular value decomposition gives the r shapes with the least sum of squares (Eckart and Young 1936); r grows
    until the largest error is small enough. It is taken of the F × F products of shapes, block by block, so that long
    videos of large meshes fit into memory.

    Args:
        shapes: Vertices at every frame [m]; may lie on the disk.
        tolerance: Largest error of any vertex [m].
        most: So many modes at most; the error may then be larger.
    """
    frames, vertices = shapes.shape[:2]
    blocks = [slice(a, a + BLOCK_VERTICES_COUNT) for a in range(0, vertices, BLOCK_VERTICES_COUNT)]
    products = np.zeros((frames, frames))
    for block in blocks:
        away = _deviations_from_mean(shapes, block)
        products += away @ away.T
    size, left = np.linalg.eigh(products)
    left = left[:, ::-1][:, size[::-1] > MIN_MODE_EIGENVALUE_RATIO * max(size[-1], 0.0)][:, :most]
    count = max((_modes_needed(_deviations_from_mean(shapes, b), left, tolerance) for b in blocks), default=0)
    left = left[:, :count]
    low, span = left.min(axis=0), np.maximum(np.ptp(left, axis=0), 1e-12)
    base, targets, error = np.empty((vertices, 3)), np.empty((count, vertices, 3)), 0.0
    for block in blocks:
        away = _deviations_from_mean(shapes, block)
        modes = left.T @ away
        mean = shapes[:, block].mean(axis=0, dtype=np.float64)
        base[block] = mean + (low @ modes).reshape(-1, 3)
        targets[:, block] = (modes * span[:, None]).reshape(count, -1, 3)
        error = max(error, _largest_distance(away - left @ modes))
    return ShapeModes(base, targets, (left - low) / span, error)


def _deviations_from_mean(shapes: np.ndarray, block: slice) -> np.ndarray:
    """Differences (F, 3 n) from the mean over time [m]."""
    own = shapes[:, block].astype(np.float64)
    return (own - own.mean(axis=0)).reshape(len(shapes), -1)


def _modes_needed(away: np.ndarray, left: np.ndarray, tolerance: float) -> int:
    """Return how many modes keep the tolerance in one block; all there are if none do."""
    rest = away.copy()
    for count in range(left.shape[1]):
        if _largest_distance(rest) <= tolerance:
            return count
        rest -= np.outer(left[:, count], left[:, count] @ away)
    return left.shape[1]


def _largest_distance(rest: np.ndarray) -> float:
    """Return the largest distance of any vertex at any frame [m]."""
    return float(np.linalg.norm(rest.reshape(len(rest), -1, 3), axis=2).max(initial=0.0))


def refit_shape_modes(
    modes: ShapeModes, values: Float[np.ndarray, "F V 3"]
) -> tuple[Float[np.ndarray, "V 3"], Float[np.ndarray, "r V 3"]]:
    """Return the base and the targets that come nearest to other values with the same weights."""
    frames = len(values)
    A = np.column_stack([np.ones(frames), modes.weights])
    found = np.einsum("kf,fvi->kvi", np.linalg.pinv(A), values, optimize=True)
    return found[0], found[1:]


GLB_FILE_NAME = "video.glb"
MAX_MORPH_TARGETS = 64
"""Modes of one surface: with more a sequence of shapes is the better format."""
QUANTIZATION_EXTENSION = "KHR_mesh_quantization"
INTEGER_TYPES = {16: (5122, "<i2"), 8: (5120, "i1")}
"""Bits → component type of glTF, and of NumPy."""
TOLERANCE_RANGE = (1e-6, 1.0)


def write_animated_glb(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write ``video.glb``.

    Raises:
        UserError: The tolerance makes no sense.
    """
    low, high = TOLERANCE_RANGE
    if not low <= asked.config.tolerance <= high:
        raise UserError(f"--tolerance is {asked.config.tolerance:g} m. Give a length from {low:g} to {high:g}.")
    video = _AnimatedGlbDocument(asked)
    write_bytes(folder / GLB_FILE_NAME, video.whole())
    return WrittenTarget(tuple(video.unsaid), video.measured)


class _AnimatedGlbDocument(GlbDocument):
    """The scene's document, with motion."""

    def __init__(self, asked: ExportRequest) -> None:
        super().__init__(asked.motion.scene)
        self.asked, self.motion = asked, asked.motion
        self.unsaid: list[str] = []
        self.measured: dict[str, float] = {"modes": 0.0, "vertex_error_m": 0.0}
        self.samplers: list[dict] = []
        self.channels: list[dict] = []
        self.times = self._clock() if self.motion.moves else -1

    def whole(self) -> bytes:
        """Return the file."""
        soft = [s for s in self.asked.scene.solids if not s.rigid] if self.motion.moves else []
        shapes = self.motion.shapes(soft)
        self.close([self._solid(s, shapes) for s in self.asked.scene.solids])
        if self.channels:
            animation = {"name": self.asked.scene.title, "samplers": self.samplers}
            self.json["animations"] = [animation | {"channels": self.channels}]
        if QUANTIZATION_EXTENSION in self.extensions:
            self.json["extensionsRequired"] = [QUANTIZATION_EXTENSION]
        return self.bytes()

    def _clock(self) -> int:
        time = self.motion.time - self.motion.time[0]
        accessor = self._numbers(time[:, None])
        low, high = time[[0, -1]].astype(np.float32).tolist()
        self.json["accessors"][accessor] |= {"min": [low], "max": [high]}
        return accessor

    def _solid(self, solid: ExportedSolid, shapes: PosedSurfaces) -> int:
        moving = self.motion.moves
        rows = zip(solid.surface_numbers, solid.surfaces, strict=True)
        if solid.rigid or not moving:
            children = [self.surface_node(surface) for _, surface in rows]
        else:
            children = [self._soft(number, surface, shapes) for number, surface in rows]
        matter = [self.asked.scene.matter[k] for k in solid.parts]
        extras = {"mass_kg": solid.mass, "rigid": solid.rigid}
        extras |= {"parts": [m.provenance for m in matter]}
        node = self.add("nodes", {"name": solid.title, "children": children, "extras": extras})
        if solid.rigid and moving:
            self._carry(node, solid)
        elif not moving:
            self.json["nodes"][node]["translation"] = solid.origin.tolist()
        return node

    def _carry(self, node: int, solid: ExportedSolid) -> None:
        """Let a rigid solid's node go where the solid went."""
        poses = self.motion.poses(solid)
        turned = poses.quaternion[:, [1, 2, 3, 0]]
        first = {"translation": poses.position[0].tolist(), "rotation": turned[0].tolist()}
        self.json["nodes"][node] |= first
        self._track(node, "translation", poses.position)
        self._track(node, "rotation", turned)

    def _soft(self, number: int, surface: Surface, shapes: PosedSurfaces) -> int:
        """Add a surface whose shape changes; its vertices are the world's."""
        vertices, normals = shapes.of(number)
        modes = fit_shape_modes(vertices, self.asked.config.tolerance, MAX_MORPH_TARGETS)
        self._measure(surface, modes)
        middle = modes.base.mean(axis=0)
        # Base and targets share one scale, the node's, which undoes the quantisation.
        largest = max(np.abs(modes.base - middle).max(), np.abs(modes.targets).max(initial=0.0))
        scale = float(largest) or 1.0
        unit = replace(modes, base=(modes.base - middle) / scale, targets=modes.targets / scale)
        mesh = {"name": surface.name, "primitives": [self._morphing(surface, unit, normals)]}
        if modes.count:
            mesh["weights"] = modes.weights[0].tolist()
        node = {"name": surface.name, "mesh": self.add("meshes", mesh)}
        node |= {"translation": middle.tolist(), "scale": [scale] * 3}
        place = self.add("nodes", node)
        if modes.count:
            self._track(place, "weights", modes.weights.reshape(-1, 1))
        return place

    def _morphing(self, surface: Surface, unit: ShapeModes, normals: np.ndarray) -> dict:
        """Return the primitive of unit size, with its targets."""
        attributes = {"POSITION": self._small(unit.base, 16)}
        targets = [{"POSITION": self._small(t, 16)} for t in unit.targets]
        if surface.normals is not None:
            straight, turns = refit_shape_modes(unit, normals)
            size = np.linalg.norm(straight, axis=1, keepdims=True)
            attributes["NORMAL"] = self.array(np.where(size > 1e-6, straight / size, [0, 0, 1]))
            for target, turn in zip(targets, turns, strict=True):
                target["NORMAL"] = self._small(turn, 8)
        for name, values in (("TEXCOORD_0", surface.uv), ("COLOR_0", surface.colours)):
            if values is not None:
                attributes[name] = self.array(values)
        drawn = {
            "attributes": attributes,
            "indices": self.indices(surface.triangles, len(surface.vertices)),
            "material": self.material(surface.finish),
        }
        return drawn | ({"targets": targets} if targets else {})

    def _measure(self, surface: Surface, modes: ShapeModes) -> None:
        kept = self.measured
        kept["modes"] = max(kept["modes"], float(modes.count))
        kept["vertex_error_m"] = max(kept["vertex_error_m"], modes.error)
        if modes.error > self.asked.config.tolerance:
            self.unsaid.append(
                f"{surface.name} moves in more than {MAX_MORPH_TARGETS} modes: its vertices are up to "
                f"{modes.error * 1e3:.2g} mm off. USD and Alembic keep all of its shapes."
            )

    def _numbers(self, values: np.ndarray) -> int:
        """Add floats that no vertex has: times and keyframes."""
        data = np.ascontiguousarray(values, "<f4")
        view = self.view(data.tobytes())
        item = {"bufferView": view, "componentType": FLOAT, "count": len(data)}
        return self.add("accessors", item | {"type": ACCESSOR_TYPE_OF_WIDTH[data.shape[1]]})

    def _small(self, values: np.ndarray, bits: int) -> int:
        """Add numbers in [-1, 1] as normalised integers, each vertex on a four-byte boundary."""
        component, kind = INTEGER_TYPES[bits]
        data = np.zeros((len(values), 4), kind)
        data[:, :3] = np.rint(np.clip(values, -1, 1) * (2 ** (bits - 1) - 1))
        view = self.view(data.tobytes(), VERTEX_BUFFER)
        self.json["bufferViews"][view]["byteStride"] = data.itemsize * 4
        self.extensions.add(QUANTIZATION_EXTENSION)
        item = {"bufferView": view, "componentType": component, "normalized": True}
        item |= {"count": len(data), "type": "VEC3"}
        item |= {"min": data[:, :3].min(axis=0).tolist(), "max": data[:, :3].max(axis=0).tolist()}
        return self.add("accessors", item)

    def _track(self, node: int, path: str, values: np.ndarray) -> None:
        sampler = {"input": self.times, "output": self._numbers(values), "interpolation": "LINEAR"}
        self.samplers.append(sampler)
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})
