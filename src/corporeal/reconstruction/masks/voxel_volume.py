"""Voxels carved by masks, and their silhouettes."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, Int32
from scipy.ndimage import binary_dilation, label

from corporeal.core.types import Camera
from corporeal.multiview.epipolar import projection_matrix
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.silhouette_coherence import is_outside_silhouettes
from corporeal.multiview.viewed_region import ViewedRegion

VOXELS_ACROSS = 72
"""Cells along the diameter of the ball that objects are looked for in."""
MIN_SEEING_VIEWS_FRACTION = 0.25
"""Share of the views that must see a cell."""
MIN_PIECE_TO_LARGEST = 0.1
"""Pieces of a hull smaller than that share of the largest are chance."""
HIDING_HEIGHT_RADII = 0.15
"""Height above the floor, in radii of the ball, of cells that surely hide the floor."""
MAX_EDGE_FRACTION = 0.15
"""Share of a piece at the edge of the ball that cameras look at, above which it is a
wall: .27 of one behind a chair, 1.0 of others, up to .06 of objects.
"""
FLOOR_LAYER_RADII = 0.01
"""Height of the layer that is the floor, in radii of the ball."""


@dataclass(frozen=True)
class VoxelVolume:
    """Cells that may be filled, and where each view shows them; M cells, V views."""

    index: Int[np.ndarray, " M"]
    """In the cube of ACROSS³ cells."""
    pixel: Int32[np.ndarray, "V M"]
    """Row · width + column; -1: not in the picture."""
    shape: tuple[int, int, int]
    """Views, height and width [px]."""
    footprint: Int[np.ndarray, " V"]
    """How far a cell reaches beside the pixel of its middle [px]."""
    outer: Bool[np.ndarray, " M"]
    """Whether a cell is at the edge of the ball."""
    height: Float[np.ndarray, " M"]
    """Above the floor, in radii of the ball; 0 where it is unknown."""

    @property
    def tall(self) -> Bool[np.ndarray, " M"]:
        """Whether a cell is so high above the floor that before it no floor is seen."""
        return self.height > HIDING_HEIGHT_RADII

    def carved(self, masks: Bool[np.ndarray, "V H W"], piece: float | None = None) -> Bool[np.ndarray, " M"]:
        """Return which cells masks leave, without pieces smaller than a share of the largest.

        That share is ``piece``, or PIECE.
        As few views may see a cell beside the masks as ``geometry.silhouettes.outside`` forgives.
        Where something is above the floor, what hovers at the edge of the ball is not of it.
        """
        beside, looking = self.votes(masks)
        kept = ~is_outside_silhouettes(beside, looking) & (looking >= MIN_SEEING_VIEWS_FRACTION * len(masks))
        return self._without_walls(self._without_crumbs(kept, MIN_PIECE_TO_LARGEST if piece is None else piece))

    def votes(self, masks: Bool[np.ndarray, "V H W"]) -> tuple[Int32[np.ndarray, " M"], Int32[np.ndarray, " M"]]:
        """Return how many views see each cell beside masks, and how many see it at all."""
        beside = np.zeros(len(self.index), np.int32)
        looking = np.zeros(len(self.index), np.int32)
        for mask, pixel in zip(masks.reshape(len(masks), -1), self.pixel, strict=True):
            sees = pixel >= 0
            looking += sees
            beside += sees & ~mask[pixel]
        return beside, looking

    def silhouettes(self, filled: Bool[np.ndarray, " M"]) -> Bool[np.ndarray, "V H W"]:
        """Return the pixels in which filled cells are seen."""
        views, height, width = self.shape
        made = np.zeros((views, height * width), bool)
        for one, pixel in zip(made, self.pixel, strict=True):
            shown = pixel[filled]
            one[shown[shown >= 0]] = True
        pairs = zip(made.reshape(self.shape), self.footprint, strict=True)
        return np.stack([binary_dilation(one, iterations=int(n)) for one, n in pairs])

    def pieces(self, kept: Bool[np.ndarray, " M"]) -> tuple[Int[np.ndarray, " M"], int]:
        """Return the number of the piece that each cell is of, from 1 on, and how many there are.

        0: it is not kept.
        """
        cube = np.zeros(VOXELS_ACROSS**3, bool)
        cube[self.index[kept]] = True
        found = label(cube.reshape(VOXELS_ACROSS, VOXELS_ACROSS, VOXELS_ACROSS), np.ones((3, 3, 3)))
        assert isinstance(found, tuple)
        return found[0].ravel()[self.index], found[1]

    def _without_crumbs(self, kept: np.ndarray, least: float) -> np.ndarray:
        if not kept.any():
            return kept
        piece, count = self.pieces(kept)
        sizes = np.bincount(piece, minlength=count + 1)
        sizes[0] = 0
        return kept & (sizes >= least * sizes.max())[piece]

    def _without_walls(self, kept: np.ndarray) -> np.ndarray:
        """Leave out pieces that hover, and lie at the edge of the ball, if others do not.

        Objects stand on the floor; what is as high as that there is a wall of their colours.
        """
        piece, count = self.pieces(kept)
        made = np.zeros_like(kept)
        for k in range(1, count + 1):
            one = piece == k
            if not (self.wall(one) and self.tall[one].all()):
                made |= one
        return made if made.any() else kept

    def wall(self, piece: Bool[np.ndarray, " M"]) -> bool:
        """Return whether a piece goes on beyond the edge of the ball that cameras look at."""
        return bool(self.outer[piece].mean() > MAX_EDGE_FRACTION)


def voxel_volume(
    cameras: tuple[Camera, ...],
    around: ViewedRegion,
    floor: GroundPlane | None,
    cone: Bool[np.ndarray, "V H W"] | None = None,
) -> VoxelVolume:
    """Fill a ball with cells.

    Args:
        cameras: Of the pictures.
        around: The ball.
        floor: Nothing is below it, and nothing in a thin layer above; None: unknown.
        cone: Pixels that cells must be seen in, if a view shows them; None: any.
    """
    line = (np.arange(VOXELS_ACROSS) + 0.5) / VOXELS_ACROSS * 2 - 1
    cells = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    far = np.linalg.norm(cells, axis=1)
    places = np.array(around.centre) + around.radius * cells
    good, height = far < 1, np.zeros(len(cells))
    if floor is not None:
        height = (places @ floor.normal - floor.offset) / around.radius
        good &= height > FLOOR_LAYER_RADII
    index = np.flatnonzero(good)
    pixel = np.stack([pixels_of(places[index], c) for c in cameras])
    if cone is not None:
        within = [(p < 0) | allowed.ravel()[p] for p, allowed in zip(pixel, cone, strict=True)]
        kept = np.all(within, axis=0)
        index, pixel = index[kept], pixel[:, kept]
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    away = np.linalg.norm(eyes - np.array(around.centre), axis=1)
    focal = np.array([c.K[0, 0] for c in cameras])
    side = 2 * around.radius / VOXELS_ACROSS * focal / away
    footprint = np.maximum(np.ceil(side / 2), 1).astype(np.int64)
    shape = len(cameras), cameras[0].height, cameras[0].width
    outer = far[index] > 1 - 4 / VOXELS_ACROSS
    return VoxelVolume(index, pixel.astype(np.int32), shape, footprint, outer, height[index])


def lower_floor(floor: GroundPlane | None, around: ViewedRegion) -> GroundPlane | None:
    """Return a floor so far below that cells hold what lies flat on the true one."""
    down = (FLOOR_LAYER_RADII + 2 / VOXELS_ACROSS) * around.radius
    return None if floor is None else replace(floor, offset=floor.offset - down)


def pixels_of(points: Float[np.ndarray, "N 3"], camera: Camera) -> Int[np.ndarray, " N"]:
    """Return which pixel shows each point; -1: none."""
    P = projection_matrix(camera)
    u, v, depth = P[:, :3] @ points.T + P[:, 3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        column, row = np.floor(u / depth), np.floor(v / depth)
    seen = (depth > 0) & (column >= 0) & (column < camera.width)
    seen &= (row >= 0) & (row < camera.height)
    return np.where(seen, row * camera.width + column, -1).astype(np.int64)
