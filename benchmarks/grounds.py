"""What photographed things stand on, other than the floor of a room, and what is around that.

``table``: a top of birch, whose edge is seen, high above a floor of planks, amid shelves of books.
``cloth``: a round, printed cloth on a plain floor. ``newspaper``: a printed sheet on a plain floor.
``grass``: a lawn, a hedge and a sky. Lengths are in distances of the farthest camera from the
middle.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

BIRCH, PRINT, INK = (0.80, 0.69, 0.52), (0.83, 0.82, 0.78), (0.18, 0.18, 0.19)
LINEN, LAWN, SOIL = (0.86, 0.83, 0.76), (0.28, 0.40, 0.14), (0.36, 0.30, 0.18)
SKY, CLOUD, LEAVES = (0.50, 0.66, 0.86), (0.93, 0.94, 0.96), (0.12, 0.22, 0.09)
TABLE, SHEET, CLOTH = (0.58, 0.42), (0.46, 0.34), 0.5
"""Half the sides of a table top and of a newspaper; radius of a cloth."""
SPOTS, HEDGE = 60, 3.0
"""Prints on a cloth; height of a hedge."""


@dataclass(frozen=True)
class Ground:
    """The plane z = 0 under things."""

    paint: Callable[[np.ndarray], np.ndarray] | None
    """Colours (N, 3) of places on it (N, 3); None: those of the room's floor."""
    covers: Callable[[np.ndarray], np.ndarray]
    """Which places (N, 3) of the plane it is at (N,); beside it is the floor."""
    drop: float = 0.0
    """How far below it the floor is."""
    room: float = 1.5
    """Half the side of what is around it."""
    walls: Callable[[np.ndarray], np.ndarray] | None = None
    """Colours of places at its end; None: of walls and floors as rooms have them."""
    plain: bool = False
    """Whether floor and walls of the room have one colour each."""


def everywhere(points: np.ndarray) -> np.ndarray:
    """Return that a plane is at all places (N, 3) of it (N,)."""
    return np.ones(len(points), bool)


FLOOR = Ground(None, everywhere)
"""Of a room."""


def noise(points: np.ndarray, wave: float, seed: int) -> np.ndarray:
    """Return smooth noise in [-1, 1] at points (N, 3) with features of such a size."""
    cells = np.random.default_rng(seed).uniform(-1, 1, (48, 48, 48))
    return map_coordinates(cells, (points / wave).T % 48, order=1, mode="grid-wrap")


def _birch(points: np.ndarray) -> np.ndarray:
    along = points * [0.08, 1, 1]
    grain = 0.07 * noise(along, 0.02, 11) + 0.05 * noise(along, 0.006, 12)
    return np.array(BIRCH) * (1 + grain + 0.04 * noise(points, 0.2, 13))[:, None]


def _rectangle(sides: tuple[float, float]) -> Callable[[np.ndarray], np.ndarray]:
    return lambda points: np.abs(points[:, :2] / sides).max(axis=1) < 1


def _disc(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, :2], axis=1) < CLOTH


def _printed_cloth(points: np.ndarray) -> np.ndarray:
    """Rings and spots of many sizes and colours on linen."""
    rng, away = np.random.default_rng(5), np.linalg.norm(points[:, :2], axis=1)
    made = np.array(LINEN) * (1 + 0.05 * noise(points, 0.005, 14))[:, None]
    made[np.abs(away - 0.88 * CLOTH) < 0.02] = (0.20, 0.34, 0.52)
    made[np.abs(away - 0.45 * CLOTH) < 0.008] = (0.62, 0.20, 0.18)
    for _ in range(SPOTS):
        middle = 0.8 * CLOTH * rng.uniform(-1, 1, 2)
        near = np.linalg.norm(points[:, :2] - middle, axis=1) < rng.uniform(0.008, 0.035)
        made[near] = rng.uniform(0.15, 0.8, 3)
    return made


def _chance(a: np.ndarray, b: np.ndarray, c: np.ndarray | float = 0.0) -> np.ndarray:
    """Return a number in [0, 1) for each cell of a grid."""
    return np.sin(12.9898 * a + 78.233 * b + 37.719 * c) * 43758.5453 % 1


def _newsprint(points: np.ndarray) -> np.ndarray:
    """Columns of letters, headlines and a few grey pictures."""
    turned = np.radians(17)
    x, y, _ = points.T
    x, y = x * np.cos(turned) - y * np.sin(turned), x * np.sin(turned) + y * np.cos(turned)
    column, row, block = np.floor(x / 0.15), np.floor(y / 0.012), np.floor(y / 0.096)
    kind, gap = _chance(column, block), (x / 0.15) % 1 < 0.08
    letters = _chance(np.floor(x / 0.007), row, column) > 0.42
    letters &= (y / 0.012) % 1 < 0.6
    large = (_chance(np.floor(x / 0.02), block) > 0.35) & ((y / 0.096) % 1 > 0.45)
    ink = np.where(kind < 0.2, large, letters) & ~gap
    grey = 0.5 + 0.3 * noise(points, 0.02, 15)
    tone = np.where((kind > 0.8) & ~gap, grey, np.where(ink, 0.0, 1.0))[:, None]
    return tone * PRINT + (1 - tone) * INK


def _lawn(points: np.ndarray) -> np.ndarray:
    blades = 0.35 * noise(points, 0.006, 16) + 0.2 * noise(points, 0.02, 17)
    bare = np.clip(2 * noise(points, 0.15, 18) - 1, 0, 0.8)[:, None]
    return ((1 - bare) * LAWN + bare * SOIL) * (1 + blades + 0.1 * noise(points, 0.4, 19))[:, None]


def _outdoors(points: np.ndarray) -> np.ndarray:
    """Return colours of a hedge, and of clouds in the sky above it."""
    height = points[:, 2] - HEDGE * (1 + 0.3 * noise(points * [1, 1, 0], 2.0, 20))
    leaves = np.array(LEAVES) * (1 + 0.5 * noise(points, 0.3, 21) + 0.3 * noise(points, 1, 22))[:, None]
    cloudy = np.clip(0.5 + noise(points, 8.0, 23), 0, 1)[:, None]
    return np.where(height[:, None] < 0, leaves, (1 - cloudy) * SKY + cloudy * np.array(CLOUD))


def _shelves(points: np.ndarray) -> np.ndarray:
    """Return colours of rows of books, as high and of such colours as it happens."""
    along, z = points[:, 0] - points[:, 1], points[:, 2]
    shelf = np.floor(z / 0.5)
    book = np.floor(along / 0.07 + 0.3 * _chance(np.floor(along / 0.35), shelf))
    hues = [_chance(book, shelf, float(k)) for k in (1, 2, 3)]
    made = 0.15 + 0.6 * np.stack(hues, axis=1)
    above = (z / 0.5) % 1 > 0.6 + 0.3 * _chance(book, shelf, 4.0)
    made[above] = 0.1
    return made * (1 + 0.1 * noise(points, 0.03, 24))[:, None]


GROUNDS = {
    "table": Ground(_birch, _rectangle(TABLE), drop=1.5, room=3.0, walls=_shelves),
    "cloth": Ground(_printed_cloth, _disc, plain=True),
    "newspaper": Ground(_newsprint, _rectangle(SHEET), plain=True),
    "grass": Ground(_lawn, everywhere, room=30.0, walls=_outdoors),
}
