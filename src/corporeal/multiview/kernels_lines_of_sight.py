"""Traversal of grid cells by lines of sight. Compiled by numba."""

import numba
import numpy as np

LINE_END_MARGIN_CELLS = 3.0
"""Cells before a point where its line ends: the place of a point is not exact."""
MARCH_STEP_CELLS = 0.5
"""Between places on a line that are looked at [cells]."""
UNSEEN_NEAR_FRACTION = 0.05
"""Share of a line, from the camera on, that is not looked at: nothing is so near."""


@numba.njit(nogil=True, cache=True)
def march_lines(ends, eye, passed):
    """Mark the cells between an eye and points; all in cells from the middle of the first."""
    for n in range(len(ends)):
        way = ends[n] - eye
        length = np.sqrt((way * way).sum())
        for step in range(
            int(UNSEEN_NEAR_FRACTION * length / MARCH_STEP_CELLS),
            int((length - LINE_END_MARGIN_CELLS) / MARCH_STEP_CELLS),
        ):
            share = MARCH_STEP_CELLS * step / length
            x = int(np.floor(eye[0] + share * way[0] + 0.5))
            y = int(np.floor(eye[1] + share * way[1] + 0.5))
            z = int(np.floor(eye[2] + share * way[2] + 0.5))
            if 0 <= x < passed.shape[0] and 0 <= y < passed.shape[1] and 0 <= z < passed.shape[2]:
                passed[x, y, z] = True
