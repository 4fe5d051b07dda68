"""A scene for ray casting: hits, occlusion, and studio lighting."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Float

from corporeal.core.types import Scene, Vector
from corporeal.render import kernels_hits
from corporeal.render.liquid_surface import LiquidSurface
from corporeal.render.packed_scene import (
    PackedScene,
    has_transparency,
    pack_scene,
    vertex_normals,
    vertex_positions,
    with_new_triangles,
    with_plain_colours,
)

MAX_BOUNDING_BOXES = 12
"""About what can be hit, for rays that need not be cast."""
MAX_TRANSPARENT_LAYERS = 4
"""Of see-through surfaces, one behind the other."""
BOX_MARGIN_RATIO = 1e-3
"""Of the scene: how much larger they are, so that no rounding matters."""


@dataclass(frozen=True)
class StudioLight:
    """The studio. Colours are light, or sRGB where they are written in hex."""

    front: Vector | None = None
    """From where the scene is seen that the sun stands by; None: from the camera, so that the sun stands at the same
    side of every picture."""
    sun: tuple[float, float, float] = (-0.69, -0.41, 0.90)
    """Towards the sun, as seen from the front: right, ahead, up."""
    sun_colour: tuple[float, float, float] = (3.0, 2.75, 2.4)
    softness: float = 0.07
    zenith: tuple[float, float, float] = (0.62, 0.74, 0.95)
    horizon: tuple[float, float, float] = (1.0, 0.96, 0.90)
    floor: str = "#c4bbae"
    backdrop: tuple[str, str] = ("#bccbdb", "#efe9e0")


class RayScene:
    """A scene's surfaces in one pose, ready to be hit."""

    def __init__(self, scene: Scene, light: StudioLight | None = None) -> None:
        self.look: PackedScene = pack_scene(scene)
        self.light = light or StudioLight()
        rest = vertex_positions(scene)
        low, high = (f(rest, axis=0) if len(rest) else np.zeros(3) for f in (np.min, np.max))
        self.size = max(float(np.linalg.norm(high - low)), 1e-9)
        self.origin = np.array([*(low + high)[:2] / 2, 0.0])
        self.centre = ((low + high) / 2 - self.origin).astype(np.float32)
        self.see_through = has_transparency(self.look)
        self.vertices = (rest - self.origin).astype(np.float32)
        self.normals = vertex_normals(scene).astype(np.float32)
        counts = [len(s.triangles) for s in scene.surfaces]
        self.starts = np.cumsum([0, *counts[:-1]])
        """First triangle of each surface."""
        self.corners = self.look.triangles.astype(object)
        """Of all triangles, as objects of Python: those of every pose are copied one by one."""
        self.scene = self._built()
        self.shown = True

    def posed(self, vertices: np.ndarray, normals: np.ndarray) -> "RayScene":
        """Return the stage with vertices (V, 3) [m] and unit normals (V, 3) elsewhere."""
        there = copy(self)
        local = np.nan_to_num(vertices - self.origin, nan=0.0, posinf=0.0, neginf=0.0)
        there.vertices = np.ascontiguousarray(local, dtype=np.float32)
        there.normals = np.ascontiguousarray(normals, dtype=np.float32)
        if not np.array_equal(there.vertices, self.vertices):
            there.scene = there._built()
        return there

    def with_liquids(self, gone: np.ndarray, liquids: Sequence[LiquidSurface]) -> "RayScene":
        """Return the stage with surfaces of liquids in place of some of its triangles.

        Args:
            gone: Of each triangle (T,), whether it is a liquid's at rest.
            liquids: New surfaces, behind all that stay.
        """
        there, first, look = copy(self), len(self.vertices), self.look
        vertices, normals, triangles, finish = [self.vertices], [self.normals], [], []
        for surface in liquids:
            triangles.append(surface.triangles.astype(np.int32) + first)
            finish.append(np.full(len(surface.triangles), surface.finish, np.int32))
            vertices.append((surface.vertices - self.origin).astype(np.float32))
            normals.append(surface.normals.astype(np.float32))
            first += len(surface.vertices)
        starts = np.cumsum([(~gone).sum(), *(len(t) for t in triangles)])
        there.starts = np.concatenate([np.cumsum([0, *~gone])[self.starts], starts])
        there.look = with_new_triangles(look, ~gone, np.concatenate(triangles), np.concatenate(finish), first)
        there.vertices = np.ascontiguousarray(np.concatenate(vertices))
        there.normals = np.ascontiguousarray(np.concatenate(normals))
        there.corners = there.look.triangles.astype(np.uint32)
        there.scene = there._built()
        return there

    def painted(self, shades: np.ndarray, shade_of_triangle: np.ndarray, light: StudioLight) -> "RayScene":
        """Return the stage in matt plain colours: each triangle has one of (S, 3) linear ones."""
        there = copy(self)
        there.look = with_plain_colours(self.look, shades, shade_of_triangle)
        there.light, there.see_through = light, False
        return there

    def cleared(self) -> "RayScene":
        """Return the stage with nothing on it."""
        there = copy(self)
        there.look = self.look._replace(triangles=self.look.triangles[:0])
        return there

    def shadows(self) -> "RayScene":
        """Return the scene with surfaces that are only visible by their shadows on the floor."""
        there = copy(self)
        there.shown = False
        return there

    def _built(self) -> EmbreeScene:
        scene = EmbreeScene()
        if len(self.look.triangles):
            # Numbers that Python itself has are copied in half the time.
            TriangleMesh(scene, self.vertices.astype(np.float64), self.corners)
            # Embree builds at the first ray; several threads must not be the first at once.
            scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        return scene

    def boxes(self) -> Float[np.ndarray, "B 2 3"]:
        """Corners of a few boxes about all that can be hit, in the stage's frame [m]."""
        triangles = self.look.triangles
        if not len(triangles):
            return np.zeros((0, 2, 3), np.float32)
        cuts = np.unique(self.starts[self.starts < len(triangles)])
        cuts = cuts[:: -(-len(cuts) // MAX_BOUNDING_BOXES)]
        a, b, c = (self.vertices[triangles[:, k]] for k in range(3))
        low = np.minimum.reduceat(np.minimum(np.minimum(a, b), c), cuts)
        high = np.maximum.reduceat(np.maximum(np.maximum(a, b), c), cuts)
        margin = np.float32(BOX_MARGIN_RATIO * self.size)
        return np.stack([low - margin, high + margin], axis=1)

    def hit(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, ...]:
        """Nearest triangle (-1: none), barycentric u, v and distance of each ray."""
        if not len(self.look.triangles) or not len(o):
            return self.missed(o)
        r = self.scene.run(o, d, output=True)
        return r["primID"], r["u"], r["v"], r["tfar"]

    def missed(self, o: np.ndarray) -> tuple[np.ndarray, ...]:
        """As ``hit`` where no ray hits anything."""
        none = np.zeros(len(o), np.float32)
        return np.full(len(o), -1, np.int32), none, none, none

    def free(self, o: np.ndarray, d: np.ndarray, ray: np.ndarray) -> np.ndarray:
        """Whether each ray gets away; holes and glass let it through (by ``ray``'s fixed dice)."""
        if not len(self.look.triangles) or not len(o):
            return np.ones(len(o), np.bool_)
        if not self.see_through:
            return self.scene.run(o, d, query="OCCLUDED") < 0
        free = np.zeros(len(o), np.bool_)
        alive = np.arange(len(o))
        for depth in range(2 * MAX_TRANSPARENT_LAYERS):
            prim, u, v, t = self.hit(o, d)
            free[alive[prim < 0]] = True
            on = kernels_hits.passes_through(self.look, prim, u, v, ray[alive], depth)
            if not on.any():
                break
            o = continue_ray(o[on], d[on], t[on], self.size)
            d, alive = np.ascontiguousarray(d[on]), alive[on]
        return free


def continue_ray(o: np.ndarray, d: np.ndarray, t: np.ndarray, size: float) -> np.ndarray:
    """Where rays go on behind what they met at distance t, a little past it."""
    return np.ascontiguousarray(o + (t + np.float32(2e-5 * size))[:, None] * d, dtype=np.float32)
