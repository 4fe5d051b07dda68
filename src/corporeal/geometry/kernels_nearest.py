"""Nearest neighbours by cells. Loops compiled by numba."""

import numba
import numpy as np

CELL_RINGS_COUNT = 3
"""Shells of cells about a place that are looked through."""


@numba.njit(cache=True)
def nearest_in_cells(places, points, low, width, counts, first, found):
    """Look shell by shell; ``found`` stays as it was where nothing is certain."""
    for n in range(len(places)):
        x, y, z = places[n]
        i, j, k = int((x - low[0]) // width), int((y - low[1]) // width), int((z - low[2]) // width)
        # How near the faces of its own cell are.
        edge = min(
            x - (low[0] + i * width), (low[0] + (i + 1) * width) - x,
            y - (low[1] + j * width), (low[1] + (j + 1) * width) - y,
            z - (low[2] + k * width), (low[2] + (k + 1) * width) - z,
        )  # fmt: skip
        best, chosen = np.inf, -1
        for ring in range(CELL_RINGS_COUNT + 1):
            for a in range(max(i - ring, 0), min(i + ring + 1, counts[0])):
                for b in range(max(j - ring, 0), min(j + ring + 1, counts[1])):
                    shell = abs(a - i) == ring or abs(b - j) == ring
                    for c in range(k - ring, k + ring + 1, 1 if shell else 2 * ring):
                        if c < 0 or c >= counts[2]:
                            continue
                        cell = (a * counts[1] + b) * counts[2] + c
                        for p in range(first[cell], first[cell + 1]):
                            dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
                            squared = dx * dx + dy * dy + dz * dz
                            if squared < best:
                                best, chosen = squared, p
            # Nothing outside these shells is nearer than their faces.
            away = edge + ring * width
            if best <= away * away:
                found[n] = chosen
                break
