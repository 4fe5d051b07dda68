"""Are wrong lenses noticed? Right cameras, then focal lengths and principal points that are wrong.

    python benchmarks/lenses.py FOLDER ... [--masks]

Each FOLDER holds photographs with right poses, such as ``corporeal capture`` writes. Told is what
``check_pose_consistency`` doubts: + rightly, ! of right cameras, - nothing. Without --masks it is not shown any.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from corporeal.core.terminal import show_table
from corporeal.core.types import Camera
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.multiview.pose_consistency import check_pose_consistency

WRONG = {
    "right": (1.0, 0.0, 0.0),
    "f × 0.7": (0.7, 0.0, 0.0),
    "f × 0.8": (0.8, 0.0, 0.0),
    "f × 1.25": (1.25, 0.0, 0.0),
    "f × 1.5": (1.5, 0.0, 0.0),
    "right 10 %": (1.0, 0.1, 0.0),
    "down 10 %": (1.0, 0.0, 0.1),
}
"""Factor of the focal length; shift of the principal point, in widths and heights."""
LONGEST = 256
"""Side of the pictures, as a draft takes them [px]."""


def other(camera: Camera, factor: float, right: float, down: float) -> Camera:
    """Return a camera with another lens."""
    K = camera.K.copy()
    K[0, 0], K[1, 1] = factor * K[0, 0], factor * K[1, 1]
    K[:2, 2] += right * camera.width, down * camera.height
    return replace(camera, K=K)


def main() -> None:
    """Doubt all, and show the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--masks", action="store_true")
    asked = parser.parse_args()
    rows = []
    for folder in asked.folders:
        shown = read_posed_photos(folder, LONGEST)
        told, matches = [], 0
        for name, lens in WRONG.items():
            cameras = tuple(other(c, *lens) for c in shown.views.cameras)
            views = replace(shown.views, cameras=cameras)
            found = check_pose_consistency(views, shown.masks if asked.masks else None)
            matches = max(matches, found.matches)
            told.append("-" if found.doubt is None else "!" if name == "right" else "+")
        rows.append((folder.name, f"{len(np.unique(shown.names))}", f"{matches}", *told))
    show_table(("folder", "views", "matches", *WRONG), rows)


if __name__ == "__main__":
    main()
